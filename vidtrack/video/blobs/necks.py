"""Cuts a region at its necks: the narrow places between touching vehicles."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import kernel
from vidtrack.video.frame import Image

_LEVELS = 8  # per pixel of distance, for sorting


def half_width(inside: Image, border: tuple[int, int, int, int]) -> NDArray[np.float32]:
    """(h, w) distance from the nearest pixel outside a region.

    inside  (h, w) uint8, 1 inside the region
    border  1 for each side (left, top, right, bottom) at the picture's border, beyond which the region continues
    """
    left, top, right, bottom = border
    grown = cv2.copyMakeBorder(inside, 1, 1, 1, 1, cv2.BORDER_CONSTANT)
    for on, inner, outer in ((left, np.s_[:, 1], np.s_[:, 0]), (right, np.s_[:, -2], np.s_[:, -1]),
                             (top, np.s_[1], np.s_[0]), (bottom, np.s_[-2], np.s_[-1])):  # fmt: skip
        if on:
            grown[outer] = grown[inner]
    return np.ascontiguousarray(cv2.distanceTransform(grown, cv2.DIST_L2, 5)[1:-1, 1:-1], np.float32)


def parts(depth: NDArray[np.float32], neck: float, least: Floats) -> tuple[Ints, int]:
    """Parts (h, w) of a region, numbered from 0, -1 outside, and the number of parts.

    depth   (h, w) its half width at each pixel; parts are the basins of the watershed transform
    neck    largest half width of the region between two parts, as a share of the smaller one's
    least   (2,) width and height whose product is the smallest box area of a part; smaller parts join a neighbour
    """
    return _watershed(depth, neck, float(least[0] * least[1]))


@kernel
def _watershed(depth: NDArray[np.float32], neck: float, least: float) -> tuple[Ints, int]:
    h, w = depth.shape
    order = _deepest_first(depth)
    label = np.full((h, w), -1)
    parent, peak = [0 for _ in range(0)], [0.0 for _ in range(0)]
    one, other, saddle = [0 for _ in range(0)], [0 for _ in range(0)], [0.0 for _ in range(0)]
    for p in order:
        y, x = p // w, p % w
        d = depth[y, x]
        best, height = -1, -1.0
        for j in range(max(y - 1, 0), min(y + 2, h)):
            for i in range(max(x - 1, 0), min(x + 2, w)):
                if label[j, i] < 0:
                    continue
                root = _root(parent, label[j, i])
                if best >= 0 and root != best:
                    if d > neck * min(peak[root], peak[best]):  # no neck: one part
                        keep, gone = (root, best) if peak[root] > peak[best] else (best, root)
                        parent[gone] = keep
                        best = keep
                        continue
                    one.append(root)
                    other.append(best)
                    saddle.append(d)
                if depth[j, i] > height:
                    best, height = root, depth[j, i]
        if best < 0:
            best = len(parent)
            parent.append(best)
            peak.append(d)
        label[y, x] = best
    _absorb_small(label, parent, one, other, saddle, least)
    return _numbered(label, parent)


@kernel
def _deepest_first(depth: NDArray[np.float32]) -> Ints:
    """Pixels inside the region by decreasing depth; counting sort."""
    flat = depth.ravel()
    deepest = 0
    for d in flat:
        deepest = max(deepest, int(d * _LEVELS))
    count = np.zeros(deepest + 2, np.int64)
    for d in flat:
        count[deepest - int(d * _LEVELS) + 1] += 1
    for bucket in range(1, len(count)):
        count[bucket] += count[bucket - 1]
    order = np.empty(len(flat), np.int64)
    for p in range(len(flat)):
        bucket = deepest - int(flat[p] * _LEVELS)
        order[count[bucket]] = p
        count[bucket] += 1
    outside = 0
    while outside < len(order) and flat[order[len(order) - 1 - outside]] < 0.5:
        outside += 1
    return order[: len(order) - outside]


@kernel
def _absorb_small(
    label: Ints, parent: list[int], one: list[int], other: list[int], saddle: list[float], least: float
) -> None:
    """Join parts whose box is smaller than `least` to the neighbour with the widest neck, the smallest first."""
    h, w = label.shape
    low, high = np.full((len(parent), 2), 2**31), np.full((len(parent), 2), -1)
    for y in range(h):
        for x in range(w):
            if label[y, x] >= 0:
                r = _root(parent, label[y, x])
                low[r, 0], low[r, 1] = min(low[r, 0], x), min(low[r, 1], y)
                high[r, 0], high[r, 1] = max(high[r, 0], x), max(high[r, 1], y)
    while True:
        smallest, size, into = -1, least, -1
        for r in range(len(parent)):
            area = (high[r, 0] - low[r, 0] + 1) * (high[r, 1] - low[r, 1] + 1)
            if parent[r] != r or high[r, 0] < 0 or area >= size:
                continue
            neighbour, widest = -1, -1.0
            for k in range(len(saddle)):
                a, b = _root(parent, one[k]), _root(parent, other[k])
                if a != b and (a == r or b == r) and saddle[k] > widest:
                    neighbour, widest = a + b - r, saddle[k]
            if neighbour >= 0:
                smallest, size, into = r, area, neighbour
        if smallest < 0:
            return
        parent[smallest] = into
        for axis in range(2):
            low[into, axis] = min(low[into, axis], low[smallest, axis])
            high[into, axis] = max(high[into, axis], high[smallest, axis])


@kernel
def _numbered(label: Ints, parent: list[int]) -> tuple[Ints, int]:
    number = np.full(len(parent), -1)
    count = 0
    h, w = label.shape
    for y in range(h):
        for x in range(w):
            if label[y, x] >= 0:
                r = _root(parent, label[y, x])
                if number[r] < 0:
                    number[r] = count
                    count += 1
                label[y, x] = number[r]
    return label, count


@kernel
def _root(parent: list[int], k: int) -> int:
    while parent[k] != k:
        k = parent[k]
    return k
