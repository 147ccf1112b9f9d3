"""Blobs: the regions of a foreground as measurements, with their moments."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import kernel
from vidtrack.config.video import BlobSettings
from vidtrack.estimate.noise import blob_noise
from vidtrack.scan import Scan
from vidtrack.video.blobs.regions import Regions, find_regions
from vidtrack.video.foreground import Foreground
from vidtrack.video.runs import Runs

_RIM = 1.5
"""Processed pixels by which blobs reach beyond vehicles on each side, since the picture is smoothed before it is
compared: the median at drawn sites (tools/score_speeds.py)."""
_TWO = np.uint64(2)  # without a sign, as the columns: there is no question whether to count from the end


@dataclass(slots=True)
class Blobs:
    """Connected regions, in source pixels; a pixel is a unit square around its integer position.

    centroid   (B, 2) x, y
    cov        (B, 2, 2) second central moments of the region
    box        (B, 4) left, top, width, height
    area       (B,)
    amplitude  (B,) mean strength
    step       source pixels per processed pixel
    settings   measurement noise of the centroids
    surveyed   (4,) left, top, right, bottom of the area in view; None: not known
    look       (B, 3) mean luminance and chroma; None: not known
    """

    centroid: Floats
    cov: Floats
    box: Floats
    area: Floats
    amplitude: Floats
    step: int
    settings: BlobSettings
    surveyed: Floats | None = None
    look: Floats | None = None

    def __len__(self) -> int:
        return len(self.area)

    def scan(self, time_s: float) -> Scan:
        """The blobs as measurements: z the centroids, boxes relative to them."""
        R, lasting = blob_noise(self.cov, self.step, self.settings.jitter_px, self.settings.jitter_share)
        box = self.box.copy()
        box[:, :2] -= self.centroid
        return Scan(
            time_s, self.centroid, R, box=box, amplitude=self.amplitude, lasting=lasting,
            surveyed=self.surveyed, pixel=self.step, look=self.look, rim=_RIM * self.step,
        )  # fmt: skip

    def moved(self, place: Floats | None) -> Blobs:
        """The blobs transformed by an affine map (2, 3); None is the identity."""
        if place is None:
            return self
        return replace(
            self,
            centroid=affine.points(place, self.centroid),
            cov=place[:, :2] @ self.cov @ place[:, :2].T,
            box=affine.boxes(place, self.box),
            area=self.area * affine.scale(place) ** 2,
        )


def find_blobs(foreground: Foreground, settings: BlobSettings) -> Blobs:
    """8-connected regions of at least `min_area_share` of the picture, in raster order, in scene coordinates."""
    regions = find_regions(foreground.mask, settings.min_area_share * foreground.mask.size)
    return measured(regions, foreground, settings)


def measured(regions: Regions, foreground: Foreground, settings: BlobSettings) -> Blobs:
    """Each region as one blob, in scene coordinates."""
    step = foreground.step
    n, mean, cov, box, amplitude = _measure(*regions, foreground.strength)
    return Blobs(
        centroid=(mean + 0.5) * step - 0.5,
        cov=cov * step**2,
        box=box * step,
        area=n * step**2,
        amplitude=amplitude,
        step=step,
        settings=settings,
        surveyed=foreground.surveyed,
        look=None if foreground.planes is None else _looks(*regions, *foreground.planes),
    ).moved(foreground.place)


@kernel
def _measure(
    row: Runs, start: Runs, stop: Runs, label: Ints, blobs: int, strength: NDArray
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Pixels (B,), mean (B, 2), covariance (B, 2, 2), box (B, 4) and mean strength (B,) of each region."""
    n = np.zeros(blobs)
    first = np.zeros((blobs, 2))
    second = np.zeros((blobs, 3))  # xx, xy, yy
    amplitude = np.zeros(blobs)
    box = np.zeros((blobs, 4))  # first left, top, right, bottom
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
        empty = box[i, 2] == 0
        box[i, 0], box[i, 1] = (a, y) if empty else (min(box[i, 0], a), min(box[i, 1], y))
        box[i, 2], box[i, 3] = max(box[i, 2], b), max(box[i, 3], y + 1)
        for x in range(a, b):
            amplitude[i] += strength[y, x]
    mean = np.empty((blobs, 2))
    cov = np.empty((blobs, 2, 2))
    for i in range(blobs):
        mx, my = first[i, 0] / n[i], first[i, 1] / n[i]
        mean[i, 0], mean[i, 1] = mx, my
        cov[i, 0, 0] = second[i, 0] / n[i] - mx * mx + 1 / 12  # a pixel has an extent of its own
        cov[i, 1, 1] = second[i, 2] / n[i] - my * my + 1 / 12
        cov[i, 0, 1] = cov[i, 1, 0] = second[i, 1] / n[i] - mx * my
        box[i, 2], box[i, 3] = box[i, 2] - box[i, 0], box[i, 3] - box[i, 1]
        amplitude[i] /= n[i]
    return n, mean, cov, box, amplitude


@kernel
def _looks(
    row: Runs, start: Runs, stop: Runs, label: Ints, blobs: int, luma: NDArray, cb: NDArray, cr: NDArray
) -> Floats:
    """(B, 3) mean luminance and chroma of each region; chroma is 128 where the picture has none."""
    look, n, coloured = np.zeros((blobs, 3)), np.zeros(blobs), len(cb) > 0
    for k in range(len(row)):
        i, y, light, blue, red = label[k], row[k], 0, 0, 0
        begin, end = np.uint64(start[k]), np.uint64(stop[k])
        for x in range(begin, end):
            light += luma[y, x]
        for x in range(begin, end):
            blue += cb[y // 2, x // _TWO] if coloured else 128
        for x in range(begin, end):
            red += cr[y // 2, x // _TWO] if coloured else 128
        n[i] += stop[k] - start[k]
        look[i, 0] += light
        look[i, 1] += blue
        look[i, 2] += red
    for i in range(blobs):
        for c in range(3):
            look[i, c] /= n[i]
    return look
