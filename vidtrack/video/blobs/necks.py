"""Cuts a region at its necks: the narrow places between touching vehicles."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import inlined, kernel
from vidtrack.video.frame import Image

_LEVELS = np.float32(8)  # per pixel of distance, for sorting
_ONE = np.uint64(1)
_INSIDE = np.float32(0.5)  # px; pixels of the region are at least so far from the nearest one outside


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


def parts(depth: NDArray[np.float32], neck: float, least: Floats, wider: float = 1.0) -> tuple[Ints, int, bool]:
    """Parts (h, w) of a region, numbered from 0, -1 outside, their number, and whether a wider neck gives the same.

    depth   (h, w) its half width at each pixel; parts are the basins of the watershed transform
    neck    largest half width of the region between two parts, as a share of the smaller one's
    least   (2,) width and height whose product is the smallest box area of a part; smaller parts join a neighbour
    wider   the wider neck: they are the same parts if no two basins met where it would have kept them apart
    """
    return _watershed(depth, neck, wider, float(least[0] * least[1]))


@kernel
def _watershed(depth: NDArray[np.float32], neck: float, wider: float, least: float) -> tuple[Ints, int, bool]:
    h, w = depth.shape
    wide = w + 2  # with a rim on each side no pixel needs a look whether it has neighbours
    deep, label = np.zeros((h + 2) * wide, np.float32), np.full((h + 2) * wide, np.int32(-1))
    for y in range(h):
        for x in range(w):
            deep[(y + 1) * wide + x + 1] = depth[y, x]
    order, across = _deepest_first(deep), np.uint64(wide)
    parent, peak = np.empty(len(order), np.int64), np.empty(len(order))
    one, other, saddle = [0 for _ in range(0)], [0 for _ in range(0)], [0.0 for _ in range(0)]
    basins, same = 0, True
    for p in order:
        d = np.float64(deep[p])
        # Least and greatest of the neighbours' labels; most pixels have one, or none.
        lowest, highest = np.uint32(0xFFFFFFFF), np.int32(-1)
        for row in (p - across, p, p + across):
            for q in (row - _ONE, row, row + _ONE):
                lowest, highest = min(lowest, np.uint32(label[q])), max(highest, label[q])  # -1 is the largest unsigned
        if np.int64(lowest) == highest:
            label[p] = _root(parent, highest)
            continue
        best, height = -1, -1.0
        for row in (p - across, p, p + across):
            for q in (row - _ONE, row, row + _ONE):
                if label[q] < 0:
                    continue
                root = _root(parent, np.int64(label[q]))
                if best >= 0 and root != best:
                    if d > neck * min(peak[root], peak[best]):  # no neck: one part
                        same &= d > wider * min(peak[root], peak[best])
                        keep, gone = (root, best) if peak[root] > peak[best] else (best, root)
                        parent[gone] = keep
                        best = keep
                        continue
                    one.append(root)
                    other.append(best)
                    saddle.append(d)
                if deep[q] > height:
                    best, height = root, deep[q]
        if best < 0:
            best, basins = basins, basins + 1
            parent[best], peak[best] = best, d
        label[p] = best
    basin, parent = label.reshape(h + 2, wide)[1:-1, 1:-1], parent[:basins]
    _absorb_small(_extents(basin, len(parent)), parent, one, other, saddle, least)
    label, count = _numbered(basin, parent)
    return label, count, same


@inlined
def _deepest_first(depth: NDArray[np.float32]) -> NDArray[np.uint64]:
    """The pixels of (N,) inside the region by decreasing depth; counting sort."""
    deepest = np.float32(0)
    for p in range(len(depth)):
        deepest = max(deepest, depth[p])
    most = int(deepest * _LEVELS)
    count = np.zeros(most + 2, np.int64)
    for p in range(len(depth)):
        if depth[p] >= _INSIDE:
            count[most - int(depth[p] * _LEVELS) + 1] += 1
    for bucket in range(1, len(count)):
        count[bucket] += count[bucket - 1]
    order = np.empty(count[-1], np.uint64)  # without a sign there is no question whether to count from the end
    for p in range(len(depth)):
        if depth[p] >= _INSIDE:
            bucket = most - int(depth[p] * _LEVELS)
            order[count[bucket]] = p
            count[bucket] += 1
    return order


@inlined
def _extents(basin: Ints, count: int) -> Ints:
    """(count, 4) left, top, right, bottom of each basin (h, w), last pixels included."""
    h, w = basin.shape
    extent = np.empty((count, 4), np.int64)
    for b in range(count):
        extent[b, 0], extent[b, 1], extent[b, 2], extent[b, 3] = w, h, -1, -1
    for y in range(h):
        x = 0
        while x < w:
            b, start = basin[y, x], x
            while x < w and basin[y, x] == b:
                x += 1
            if b >= 0:
                extent[b, 0], extent[b, 1] = min(extent[b, 0], start), min(extent[b, 1], y)
                extent[b, 2], extent[b, 3] = max(extent[b, 2], x - 1), y
    return extent


@inlined
def _absorb_small(
    extent: Ints, parent: Ints, one: list[int], other: list[int], saddle: list[float], least: float
) -> None:
    """Join parts whose box is smaller than `least` to the neighbour with the widest neck, the smallest first.

    extent (N, 4) left, top, right, bottom of each basin, last pixels included.
    """
    for basin in range(len(parent)):
        _widen(extent, _root(parent, basin), basin)
    while True:
        smallest, size, into = -1, least, -1
        for r in range(len(parent)):
            area = (extent[r, 2] - extent[r, 0] + 1) * (extent[r, 3] - extent[r, 1] + 1)
            if parent[r] != r or area >= size:
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
        _widen(extent, into, smallest)


@inlined
def _widen(extent: Ints, basin: int, by: int) -> None:
    """Let the extent of a basin include that of another one."""
    for axis in range(2):
        extent[basin, axis] = min(extent[basin, axis], extent[by, axis])
        extent[basin, 2 + axis] = max(extent[basin, 2 + axis], extent[by, 2 + axis])


@inlined
def _numbered(basin: Ints, parent: Ints) -> tuple[Ints, int]:
    """(h, w) part of each pixel, numbered by their first pixels in raster order, and the number of parts."""
    number, part = np.full(len(parent), -1), np.full(len(parent), -1)  # of a root, of a basin
    label = np.full(basin.shape, -1)
    count = 0
    h, w = basin.shape
    for y in range(h):
        for x in range(w):
            b = np.int64(basin[y, x])
            if b >= 0 and part[b] < 0:
                root = _root(parent, b)
                if number[root] < 0:
                    number[root] = count
                    count += 1
                part[b] = number[root]
            label[y, x] = part[b] if b >= 0 else -1
    return label, count


@inlined
def _root(parent: Ints, k: int) -> int:
    while parent[k] != k:
        k = parent[k]
    return k
