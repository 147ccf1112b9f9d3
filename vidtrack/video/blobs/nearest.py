"""Division of a region among the predicted boxes on it."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import inlined, kernel
from vidtrack.tracking.boxes import common
from vidtrack.video.frame import Image

_COVERED = 0.4  # share of a predicted box that the region fills if the vehicle is in it
_SAME = 0.5  # share of the smaller of two boxes in the other: they do not tell where one vehicle ends


@kernel
def nearest_box(inside: Image, box: Ints, predicted: Floats) -> tuple[Ints, int]:
    """Index of the predicted box nearest to each pixel (h, w), -1 outside, and the number of boxes with pixels.

    inside (h, w) uint8, 1 inside the region with this box (4,); predicted (K, 4), in pixels of the mask. The distance
    is in half sizes of the box, the larger of both axes. Boxes that the region does not fill are left out, and of
    boxes that lie on each other all but the first.
    """
    h, w = inside.shape
    label, used = np.full((h, w), -1), np.zeros(len(predicted), np.bool_)
    for k in range(len(predicted)):
        used[k] = _filled(inside, box, predicted[k]) >= _COVERED
        for j in range(k):
            used[k] &= not (used[j] and _share(predicted[j], predicted[k]) > _SAME)
    boxes, number = np.empty(len(used), np.int64), np.full(len(used), -1)
    some = count = 0
    for k in range(len(used)):
        boxes[some] = k
        some += used[k]
    if some < 2:
        return label, 0
    for y in range(h):
        for x in range(w):
            if not inside[y, x]:
                continue
            best, least = -1, np.inf
            for n in range(some):
                p = predicted[boxes[n]]
                across = abs(x + box[0] + 0.5 - p[0] - p[2] / 2) / p[2]
                along = abs(y + box[1] + 0.5 - p[1] - p[3] / 2) / p[3]
                if max(across, along) < least:
                    best, least = n, max(across, along)
            if number[best] < 0:
                number[best] = count
                count += 1
            label[y, x] = number[best]
    return label, count


@inlined
def _filled(inside: Image, box: Ints, p: Floats) -> float:
    """Share of the box p (4,) that the region fills."""
    h, w = inside.shape
    left, right = max(int(p[0] - box[0]), 0), min(int(p[0] + p[2] - box[0]) + 1, w)
    top, bottom = max(int(p[1] - box[1]), 0), min(int(p[1] + p[3] - box[1]) + 1, h)
    filled = 0
    for y in range(top, bottom):
        for x in range(left, right):
            filled += inside[y, x]
    return filled / (p[2] * p[3])


@inlined
def _share(a: Floats, b: Floats) -> float:
    """Intersection of two boxes as a share of the smaller one."""
    return common(a, b) / min(a[2] * a[3], b[2] * b[3])
