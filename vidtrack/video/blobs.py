"""Blobs: the connected regions of a foreground, their moments, and which of them belong together."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vidtrack import plane
from vidtrack.compiled import kernel
from vidtrack.config import BlobSettings
from vidtrack.scan import Floats, Ints, Scan
from vidtrack.video.foreground import Foreground
from vidtrack.video.frame import Image
from vidtrack.video.runs import components, connect, find_runs, join

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
    surveyed   (4,) left, top, right, bottom of what the detector saw; None: not known
    """

    centroid: Floats
    cov: Floats
    box: Floats
    area: Floats
    amplitude: Floats
    step: int
    settings: BlobSettings
    surveyed: Floats | None = None

    def __len__(self) -> int:
        return len(self.area)

    def scan(self, time_s: float) -> Scan:
        """The blobs as measurements: z the centroids, boxes relative to them.

        R = (jitter_px step)^2 I + jitter_share^2 cov: the border is uncertain by a part of a processed pixel, and
        what is missed or added at an end moves the centroid along the extent for many frames. From frame to frame
        centroids of vehicles jitter by 0.1 to 0.25 px at 240 to 360 rows; the defaults are above that, because
        shadow and parts that look like the road come and go slowly.
        """
        lasting = self.settings.jitter_share**2 * self.cov
        R = lasting + (self.settings.jitter_px * self.step) ** 2 * np.eye(2)
        box = self.box.copy()
        box[:, :2] -= self.centroid
        return Scan(
            time_s, self.centroid, R, box=box, amplitude=self.amplitude, lasting=lasting,
            surveyed=self.surveyed, pixel=self.step,
        )  # fmt: skip

    def moved(self, place: Floats | None) -> Blobs:
        """The blobs elsewhere, by a map of the plane (2, 3); None is the identity."""
        if place is None:
            return self
        return replace(
            self,
            centroid=plane.points(place, self.centroid),
            cov=place[:, :2] @ self.cov @ place[:, :2].T,
            box=plane.boxes(place, self.box),
            area=self.area * plane.scale(place) ** 2,
        )


def find_blobs(foreground: Foreground, settings: BlobSettings) -> Blobs:
    """8-connected regions of at least `min_area_share` of the picture, in raster order of their first pixel, where they
    are in the scene.
    """
    mask, step = foreground.mask, foreground.step
    n, mean, cov, box, amplitude = _measure(mask, foreground.strength, settings.min_area_share * mask.size)
    return Blobs(
        centroid=(mean + 0.5) * step - 0.5,
        cov=cov * step**2,
        box=box * step,
        area=n * step**2,
        amplitude=amplitude,
        step=step,
        settings=settings,
        surveyed=foreground.surveyed,
    ).moved(foreground.place)


def join_fragments(blobs: Blobs, predicted: Floats) -> Blobs:
    """Blobs whose boxes lie for the most part in the same one of the predicted boxes (K, 4), joined; moments exact.

    A blob that touches no predicted box, or several, stays as it is. So do pieces farther apart than `join_gap`: two
    vehicles that entered as one blob drift apart inside the box that was predicted for both.
    """
    most, gap = blobs.settings.join_overlap, blobs.settings.join_gap
    group, count = _fragments(blobs.box, predicted, most, gap)
    return blobs if count == len(blobs) else _joined(blobs, group, count)


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


@kernel
def _fragments(box: Floats, predicted: Floats, most: float, gap: float) -> tuple[Ints, int]:
    """Group of each box (B,) and the number of groups: close pieces of the same predicted vehicle are in one."""
    parent = np.arange(len(box))
    vehicle = np.empty(len(box), np.int64)
    for i in range(len(box)):
        vehicle[i] = _only_vehicle(box[i], predicted, most)
        for j in range(i):
            if vehicle[i] >= 0 and vehicle[j] == vehicle[i]:
                longer = max(predicted[vehicle[i], 2], predicted[vehicle[i], 3])
                if _gap(box[i], box[j]) <= gap * longer:
                    join(parent, i, j)
    return components(parent)


@kernel
def _only_vehicle(box: Floats, predicted: Floats, most: float) -> int:
    """The predicted box in which most of this box (4,) lies; -1 if there is none, or others have a part in it."""
    vehicle, sharers = -1, 0
    for k in range(len(predicted)):
        share = _share_inside(box, predicted[k])
        sharers += share > 1 - most
        if share >= most and vehicle < 0:
            vehicle = k
    return vehicle if sharers == 1 else -1


@kernel(inline="always")
def _share_inside(box: Floats, other: Floats) -> float:
    """Share of a box's area that lies in the other one, spread."""
    common = 1.0
    for axis in range(2):
        size = _SPREAD * other[axis + 2]
        low = other[axis] - (size - other[axis + 2]) / 2
        common *= max(min(box[axis] + box[axis + 2], low + size) - max(box[axis], low), 0.0)
    return common / (box[2] * box[3])


@kernel(inline="always")
def _gap(a: Floats, b: Floats) -> float:
    """Distance between two boxes along the axis that separates them more; negative where they overlap."""
    across = max(a[0] - (b[0] + b[2]), b[0] - (a[0] + a[2]))
    return max(across, max(a[1] - (b[1] + b[3]), b[1] - (a[1] + a[3])))


@kernel
def _measure(mask: Image, strength: NDArray, least: float) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Of each component of at least so many pixels: count (B,), mean (B, 2), covariance (B, 2, 2), box, strength."""
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
    large = np.flatnonzero(n >= least)
    mean = np.empty((len(large), 2))
    cov = np.empty((len(large), 2, 2))
    box = np.empty((len(large), 4))
    for j, i in enumerate(large):
        mx, my = first[i, 0] / n[i], first[i, 1] / n[i]
        mean[j, 0], mean[j, 1] = mx, my
        cov[j, 0, 0] = second[i, 0] / n[i] - mx * mx + 1 / 12  # a pixel has an extent of its own
        cov[j, 1, 1] = second[i, 2] / n[i] - my * my + 1 / 12
        cov[j, 0, 1] = cov[j, 1, 0] = second[i, 1] / n[i] - mx * my
        box[j, 0], box[j, 1] = low[i, 0], low[i, 1]
        box[j, 2], box[j, 3] = high[i, 0] - low[i, 0], high[i, 1] - low[i, 1]
    return n[large], mean, cov, box, amplitude[large] / n[large]
