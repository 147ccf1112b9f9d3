"""Blobs: the connected regions of a foreground, their moments, and which of them belong together."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np
from scipy.sparse.csgraph import connected_components

from vidtrack.config import BlobSettings
from vidtrack.scan import Floats, Ints, Scan
from vidtrack.video.foreground import Foreground
from vidtrack.video.runs import connect, find_runs

_SPREAD = 1.2  # predicted boxes are taken this much larger about their centres before fragments are sought in them


@dataclass(frozen=True, slots=True)
class Blobs:
    """Connected regions, in source pixels; a pixel is a unit square around its integer position.

    centroid   (B, 2) x, y
    cov        (B, 2, 2) second central moments of the region
    box        (B, 4) left, top, width, height
    area       (B,)
    amplitude  (B,) mean strength
    step       source pixels per processed pixel
    settings   what noise `scan` gives the centroids
    """

    centroid: Floats
    cov: Floats
    box: Floats
    area: Floats
    amplitude: Floats
    step: int
    settings: BlobSettings

    def __len__(self) -> int:
        return len(self.area)

    def scan(self, time_s: float) -> Scan:
        """The blobs as measurements: z the centroids, boxes relative to them.

        R = (jitter_px step)^2 I + jitter_share^2 cov: the border is uncertain by a part of a processed pixel, and
        what is missed or added at an end moves the centroid along the extent. From frame to frame centroids of
        vehicles jitter by 0.1 to 0.25 px at 240 to 360 rows; the defaults are above that, because shadow and parts
        that look like the road come and go slowly.
        """
        base = (self.settings.jitter_px * self.step) ** 2
        R = base * np.eye(2) + self.settings.jitter_share**2 * self.cov
        box = self.box - np.pad(self.centroid, ((0, 0), (0, 2)))
        return Scan(time_s, self.centroid, R, box=box, amplitude=self.amplitude)


def find_blobs(foreground: Foreground, settings: BlobSettings) -> Blobs:
    """8-connected regions of at least `min_area_share` of the picture, in raster order of their first pixel."""
    mask, step = foreground.mask, foreground.step
    n, mean, cov, box, amplitude = _measure(mask, foreground.strength)
    large = n >= settings.min_area_share * mask.size
    return Blobs(
        centroid=(mean[large] + 0.5) * step - 0.5,
        cov=cov[large] * step**2,
        box=box[large] * float(step),
        area=n[large] * step**2,
        amplitude=amplitude[large],
        step=step,
        settings=settings,
    )


def join_fragments(blobs: Blobs, predicted: Floats) -> Blobs:
    """Blobs whose boxes lie for the most part in the same one of the predicted boxes (K, 4), joined; moments exact.

    A blob that has to do with no or with several predicted boxes stays as it is. So do pieces farther apart than
    `join_gap`: two vehicles that entered as one blob drift apart inside the box that was predicted for both.
    """
    overlap = _share_inside(blobs.box, _enlarged(predicted))
    most = blobs.settings.join_overlap
    own = (overlap >= most) & ((overlap > 1 - most).sum(axis=1, keepdims=True) == 1)
    of_one = own.any(axis=1)
    if of_one.sum() < 2:
        return blobs
    vehicle = np.where(of_one, own.argmax(axis=1), -1 - np.arange(len(blobs)))
    reach = np.zeros(len(blobs))
    reach[of_one] = blobs.settings.join_gap * predicted[vehicle[of_one], 2:].max(axis=1)
    close = (vehicle[:, None] == vehicle) & (_gap(blobs.box) <= reach[:, None])
    count, group = connected_components(close, directed=False)
    return blobs if count == len(blobs) else _joined(blobs, group, count)


def _gap(box: Floats) -> Floats:
    """(B, B) distance between boxes along the axis that separates them more; negative where they overlap."""
    low, high = box[:, :2], box[:, :2] + box[:, 2:]
    return np.maximum(low[:, None] - high[None], low[None] - high[:, None]).max(axis=2)


def _joined(blobs: Blobs, group: Ints, count: int) -> Blobs:
    """One blob for each of `count` groups; group (B,) numbers them. Means and moments are weighted by area."""

    def total(values: Floats) -> Floats:
        weighted = np.zeros((count, *values.shape[1:]))
        np.add.at(weighted, group, (values.T * blobs.area).T)
        return weighted

    area = total(np.ones(len(blobs)))
    centroid = total(blobs.centroid) / area[:, None]
    offset = blobs.centroid - centroid[group]
    cov = total(blobs.cov + offset[:, :, None] * offset[:, None, :]) / area[:, None, None]
    low = np.full((count, 2), np.inf)
    high = np.full((count, 2), -np.inf)
    np.minimum.at(low, group, blobs.box[:, :2])
    np.maximum.at(high, group, blobs.box[:, :2] + blobs.box[:, 2:])
    return replace(
        blobs,
        centroid=centroid,
        cov=cov,
        box=np.hstack([low, high - low]),
        area=area,
        amplitude=total(blobs.amplitude) / area,
    )


def _share_inside(box: Floats, other: Floats) -> Floats:
    """(B, K) share of each box's area that lies in each of the others."""
    low = np.maximum(box[:, None, :2], other[None, :, :2])
    high = np.minimum(box[:, None, :2] + box[:, None, 2:], other[None, :, :2] + other[None, :, 2:])
    return np.prod(np.maximum(high - low, 0), axis=2) / np.prod(box[:, None, 2:], axis=2)


def _enlarged(box: Floats) -> Floats:
    grown = _SPREAD * box[:, 2:]
    return np.hstack([box[:, :2] - (grown - box[:, 2:]) / 2, grown])


@numba.njit(cache=True, nogil=True)
def _measure(mask, strength):  # type: ignore[no-untyped-def]
    """Of each component, in mask pixels: count (B,), mean x, y (B, 2), covariance (B, 2, 2), box, mean strength."""
    row, start, stop = find_runs(mask, False)
    label, blobs = connect(row, start, stop, 1)
    n = np.zeros(blobs)
    first = np.zeros((blobs, 2))
    second = np.zeros((blobs, 3))  # xx, xy, yy
    amplitude = np.zeros(blobs)
    low = np.full((blobs, 2), 2**31)
    high = np.zeros((blobs, 2), np.int64)
    for k in range(len(row)):
        i, y, a, b = label[k], row[k], start[k], stop[k]
        length = b - a
        middle = (a + b - 1) / 2
        n[i] += length
        first[i, 0] += length * middle
        first[i, 1] += length * y
        second[i, 0] += length * (middle * middle + (length * length - 1) / 12)
        second[i, 1] += length * middle * y
        second[i, 2] += length * y * y
        low[i, 0], low[i, 1] = min(low[i, 0], a), min(low[i, 1], y)
        high[i, 0], high[i, 1] = max(high[i, 0], b), max(high[i, 1], y + 1)
        for x in range(a, b):
            amplitude[i] += strength[y, x]
    mean = np.empty((blobs, 2))
    cov = np.empty((blobs, 2, 2))
    box = np.empty((blobs, 4))
    for i in range(blobs):
        mx, my = first[i, 0] / n[i], first[i, 1] / n[i]
        mean[i, 0], mean[i, 1] = mx, my
        cov[i, 0, 0] = second[i, 0] / n[i] - mx * mx + 1 / 12  # a pixel has an extent of its own
        cov[i, 1, 1] = second[i, 2] / n[i] - my * my + 1 / 12
        cov[i, 0, 1] = cov[i, 1, 0] = second[i, 1] / n[i] - mx * my
        box[i, 0], box[i, 1] = low[i, 0], low[i, 1]
        box[i, 2], box[i, 3] = high[i, 0] - low[i, 0], high[i, 1] - low[i, 1]
        amplitude[i] /= n[i]
    return n, mean, cov, box, amplitude
