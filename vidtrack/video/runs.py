"""Connected components by run-length coding and union-find: rows of equal pixels are joined, not pixels."""

from __future__ import annotations

import numba
import numpy as np

from vidtrack.compiled import CACHE


@numba.njit(cache=CACHE, nogil=True)
def find_runs(mask, background):  # type: ignore[no-untyped-def]
    """Maximal horizontal runs of pixels that are not 0, or for `background` those that are: row, start, stop.

    mask (h, w) uint8; each (N,) int32 in raster order, stop excluded.
    """
    h, w = mask.shape
    pixels, words = mask.ravel(), eights(mask)
    room = 1024
    row, start, stop = np.empty(room, np.int32), np.empty(room, np.int32), np.empty(room, np.int32)
    n = 0
    for y in range(h):
        if n + w // 2 + 1 > room:
            room = 2 * room + w
            row, start, stop = _grown(row, n, room), _grown(start, n, room), _grown(stop, n, room)
        left, right = y * w, (y + 1) * w
        x = next_zero(pixels, left, right) if background else next_nonzero(pixels, words, left, right)
        while x < right:
            row[n], start[n] = y, x - left
            x = next_nonzero(pixels, words, x, right) if background else next_zero(pixels, x, right)
            stop[n] = x - left
            n += 1
            x = next_zero(pixels, x, right) if background else next_nonzero(pixels, words, x, right)
    return row[:n], start[:n], stop[:n]


@numba.njit(cache=CACHE, nogil=True)
def eights(mask):  # type: ignore[no-untyped-def]
    """The pixels of mask (h, w) uint8 as words of eight, without what is left over."""
    return mask.ravel()[: mask.size // 8 * 8].view(np.uint64)


@numba.njit(cache=CACHE, nogil=True, inline="always")
def next_nonzero(pixels, words, x, end):  # type: ignore[no-untyped-def]
    """First place in x..end where pixels (N,) is not 0, end if none; `words` skips 64 or eight zeros at a time."""
    while x < end and pixels[x] == 0:
        x += 1
        if x & 7 == 0:
            k = x >> 3
            while k << 3 < end and k + 8 <= len(words) and _none(words[k : k + 8]):
                k += 8
            while k << 3 < end and k < len(words) and words[k] == 0:
                k += 1
            x = k << 3
    return min(x, end)


@numba.njit(cache=CACHE, nogil=True, inline="always")
def _none(eight):  # type: ignore[no-untyped-def]
    """Whether these eight words are all 0."""
    return eight[0] | eight[1] | eight[2] | eight[3] | eight[4] | eight[5] | eight[6] | eight[7] == 0


@numba.njit(cache=CACHE, nogil=True, inline="always")
def next_zero(pixels, x, end):  # type: ignore[no-untyped-def]
    """First place in x..end where pixels (N,) is 0, end if none."""
    while x < end and pixels[x] != 0:
        x += 1
    return x


@numba.njit(cache=CACHE, nogil=True)
def _grown(values, used, room):  # type: ignore[no-untyped-def]
    bigger = np.empty(room, values.dtype)
    for i in range(used):
        bigger[i] = values[i]
    return bigger


@numba.njit(cache=CACHE, nogil=True)
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
            join(parent, k, other)
            other += 1
    return components(parent)


@numba.njit(cache=CACHE, nogil=True)
def components(parent):  # type: ignore[no-untyped-def]
    """Component of each element (N,) after `join`, numbered by their first elements, and their number."""
    label = np.empty(len(parent), np.int64)
    count = 0
    for k in range(len(parent)):  # a root is the first of its component, so it is numbered before the others ask
        if parent[k] == k:
            label[k] = count
            count += 1
        else:
            label[k] = label[_root(parent, k)]
    return label, count


@numba.njit(cache=CACHE, nogil=True)
def join(parent, a, b):  # type: ignore[no-untyped-def]
    """Make one component of those of a and b; parent (N,) int64 begins as 0, 1, 2, ..."""
    a, b = _root(parent, a), _root(parent, b)
    if a < b:
        parent[b] = a
    else:
        parent[a] = b


@numba.njit(cache=CACHE, nogil=True)
def _root(parent, k):  # type: ignore[no-untyped-def]
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k
