"""Connected components by run-length coding and union-find: rows of equal pixels are joined, not pixels."""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True, nogil=True)
def find_runs(mask, value):  # type: ignore[no-untyped-def]
    """Maximal horizontal runs of `value` in mask (h, w): row, start, stop (stop excluded), each (N,) int32, in order."""
    h, w = mask.shape
    room = 1024
    row, start, stop = np.empty(room, np.int32), np.empty(room, np.int32), np.empty(room, np.int32)
    n = 0
    for y in range(h):
        if n + w // 2 + 1 > room:
            room = 2 * room + w
            row, start, stop = _grown(row, n, room), _grown(start, n, room), _grown(stop, n, room)
        line = mask[y]
        x = 0
        while x < w:
            while x < w and line[x] != value:
                x += 1
            if x == w:
                break
            row[n], start[n] = y, x
            while x < w and line[x] == value:
                x += 1
            stop[n] = x
            n += 1
    return row[:n], start[:n], stop[:n]


@numba.njit(cache=True, nogil=True)
def _grown(values, used, room):  # type: ignore[no-untyped-def]
    bigger = np.empty(room, values.dtype)
    bigger[:used] = values[:used]
    return bigger


@numba.njit(cache=True, nogil=True)
def connect(row, start, stop, diagonal):  # type: ignore[no-untyped-def]
    """Component of each run and their number; runs of neighbouring rows touch if they overlap.

    diagonal: 1 joins across corners (8-connected), 0 does not (4-connected). Components are numbered by their
    first run in raster order.
    """
    n = len(row)
    parent = np.arange(n)
    above = 0  # first run of the row above that can still touch
    for k in range(n):
        while above < k and (
            row[above] < row[k] - 1 or (row[above] == row[k] - 1 and stop[above] + diagonal <= start[k])
        ):
            above += 1
        other = above
        while other < k and row[other] == row[k] - 1 and start[other] < stop[k] + diagonal:
            _join(parent, k, other)
            other += 1
    label = np.empty(n, np.int64)
    count = 0
    for k in range(n):  # a root is the first run of its component, so it is numbered before the others ask
        if parent[k] == k:
            label[k] = count
            count += 1
        else:
            label[k] = label[_root(parent, k)]
    return label, count


@numba.njit(cache=True, nogil=True)
def _root(parent, k):  # type: ignore[no-untyped-def]
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@numba.njit(cache=True, nogil=True)
def _join(parent, a, b):  # type: ignore[no-untyped-def]
    a, b = _root(parent, a), _root(parent, b)
    if a < b:
        parent[b] = a
    else:
        parent[a] = b
