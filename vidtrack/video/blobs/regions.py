"""Regions of a mask, as runs of pixels with region numbers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays.types import Ints
from vidtrack.compiled import kernel
from vidtrack.video.frame import Image
from vidtrack.video.runs import CORNERS, OBJECTS, Runs, connect, find_runs


class Regions(NamedTuple):
    """Horizontal runs of pixels, and the region of each.

    row, start, stop  (N,) stop excluded
    label             (N,) region of each run, 0..total-1
    total             number of regions
    """

    row: Runs
    start: Runs
    stop: Runs
    label: Ints
    total: int

    def extents(self) -> tuple[Ints, Ints]:
        """(total, 4) boxes left, top, width, height in pixels of the mask, and (total,) areas."""
        return _extents(self.row, self.start, self.stop, self.label, self.total)

    def boxes(self) -> Ints:
        """(total, 4) those of `extents`."""
        return self.extents()[0]

    def areas(self) -> Ints:
        """(total,) pixels."""
        return self.extents()[1]

    def joined(self, group: Ints, total: int) -> Regions:
        """The runs in `total` larger regions; group (self.total,) has the new number of each region."""
        return self._replace(label=group[self.label], total=total)

    def without(self, region: int) -> Regions:
        """The runs of all other regions, with unchanged numbers."""
        stays = self.label != region
        return Regions(self.row[stays], self.start[stays], self.stop[stays], self.label[stays], self.total)

    def parted(self, region: int, parts: Regions) -> Regions:
        """`region` replaced by its parts: the first takes its number, the others are numbered from `total` on."""
        rest = self.without(region)
        label = np.where(parts.label == 0, region, self.total - 1 + parts.label)
        return Regions(
            np.concatenate([rest.row, parts.row]),
            np.concatenate([rest.start, parts.start]),
            np.concatenate([rest.stop, parts.stop]),
            np.concatenate([rest.label, label]),
            self.total + parts.total - 1,
        )


def find_regions(mask: Image, least: float) -> Regions:
    """The 8-connected regions of at least so many pixels, in raster order of their first pixel; mask (h, w) uint8."""
    return Regions(*_large(mask, least))


def patch(regions: Regions, region: int, box: Ints) -> Image:
    """(height, width) uint8: 1 inside the region, cropped to its box (4,)."""
    return _patch(regions.row, regions.start, regions.stop, regions.label, region, box)


def of_labels(labels: Ints, count: int, box: Ints) -> Regions:
    """Regions from an array of labels (height, width), -1 for none, with the upper left corner of box (4,)."""
    row, start, stop, label = _runs_of(labels, box)
    return Regions(row, start, stop, label, count)


@kernel
def _large(mask: Image, least: float) -> tuple[Runs, Runs, Runs, Ints, int]:
    row, start, stop = find_runs(mask, OBJECTS)
    label, count = connect(row, start, stop, CORNERS)
    area = np.zeros(count, np.int64)
    for k in range(len(row)):
        area[label[k]] += stop[k] - start[k]
    number, total = np.empty(count, np.int64), 0
    for i in range(count):
        number[i] = total if area[i] >= least else -1
        total += area[i] >= least
    n = 0
    for k in range(len(row)):
        row[n], start[n], stop[n], label[n] = row[k], start[k], stop[k], number[label[k]]
        n += label[n] >= 0
    return row[:n].copy(), start[:n].copy(), stop[:n].copy(), label[:n].copy(), total


@kernel
def _extents(row: Runs, start: Runs, stop: Runs, label: Ints, count: int) -> tuple[Ints, Ints]:
    box, area = np.zeros((count, 4), np.int64), np.zeros(count, np.int64)  # first left, top, right, bottom
    for k in range(len(row)):
        area[label[k]] += stop[k] - start[k]
        i, empty = label[k], box[label[k], 2] == 0
        box[i, 0] = start[k] if empty else min(box[i, 0], start[k])
        box[i, 1] = row[k] if empty else min(box[i, 1], row[k])
        box[i, 2], box[i, 3] = max(box[i, 2], stop[k]), max(box[i, 3], row[k] + 1)
    for i in range(count):
        for axis in range(2):
            box[i, 2 + axis] -= box[i, axis]
    return box, area


@kernel
def _patch(row: Runs, start: Runs, stop: Runs, label: Ints, region: int, box: Ints) -> Image:
    inside = np.zeros((box[3], box[2]), np.uint8)
    for k in range(len(row)):
        if label[k] == region:
            inside[row[k] - box[1], start[k] - box[0] : stop[k] - box[0]] = 1
    return inside


@kernel
def _runs_of(labels: Ints, box: Ints) -> tuple[Runs, Runs, Runs, Ints]:
    h, w = labels.shape
    row, start, stop = np.empty(h * w, np.int32), np.empty(h * w, np.int32), np.empty(h * w, np.int32)
    label = np.empty(h * w, np.int64)
    n = 0
    for y in range(h):
        for x in range(w):
            if labels[y, x] < 0:
                continue
            if x > 0 and labels[y, x - 1] == labels[y, x]:
                stop[n - 1] += 1
                continue
            row[n], start[n], stop[n], label[n] = y + box[1], x + box[0], x + box[0] + 1, labels[y, x]
            n += 1
    return row[:n], start[:n], stop[:n], label[:n]
