"""Connected components by run-length coding and union-find."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Ints
from vidtrack.compiled import inlined, kernel
from vidtrack.video.frame import Image

Runs = NDArray[np.int32]
"""(N,) row, first column or column after the last of each run."""
Words = NDArray[np.uint64]
"""Eight pixels in each."""

OBJECTS, HOLES = np.False_, np.True_
"""Runs of what is not 0, or of what is. A literal would make a kernel of its own of each, and of each that it calls."""
SIDES, CORNERS = np.int64(0), np.int64(1)
"""4-connected or 8-connected."""

_HIGHS, _NONE = np.uint64(0x8080808080808080), np.uint64(0)  # the highest bit of each of eight bytes, or of none
_BLOCK = 32  # pixels, four words
_BYTE, _LAST = np.uint64(8), np.uint64(56)  # bits up to the next byte, and up to the last one


@kernel
def find_runs(mask: Image, holes: np.bool_) -> tuple[Runs, Runs, Runs]:
    """Maximal horizontal runs of pixels that are not 0 (OBJECTS), or that are 0 (HOLES): row, start, stop.

    mask (h, w) uint8; each (N,) int32 in raster order, stop excluded.
    """
    h, w = mask.shape
    most = h * (w // 2 + 1)
    row, start, stop = np.empty(most, np.int32), np.empty(most, np.int32), np.empty(most, np.int32)
    pixels = mask.ravel()
    words = pixels[: mask.size // 8 * 8].view(np.uint64)
    outside = _HIGHS if holes else _NONE
    n = _find_runs(words, _rest(pixels, holes), outside, w, row, start, stop)
    return row[:n], start[:n], stop[:n]


@inlined
def _find_runs(words: Words, rest: np.uint64, outside: np.uint64, w: int, row: Runs, start: Runs, stop: Runs) -> int:
    """Fill row, start, stop and return the number of runs.

    words (N,) eight pixels each, rest: the remaining pixels; outside: the marks of eight pixels outside runs.
    """
    n = y = left = k = 0
    first = -1  # of the run that is open
    before = _NONE  # mark of the pixel before the word
    while k <= len(words):
        if before == outside >> _LAST:
            k = _after_zeros(words, k)
        marks = _not_zero(words[k] if k < len(words) else rest) ^ outside
        edges = marks ^ (marks << _BYTE | before)
        before = marks >> _LAST
        while edges != 0:
            x = 8 * k + _lowest_byte(edges)
            edges &= edges - np.uint64(1)
            if first < 0:
                first = x
                continue
            while first < x:  # a row's end ends a run
                while first >= left + w:
                    y, left = y + 1, left + w
                end = min(x, left + w)
                row[n], start[n], stop[n] = y, first - left, end - left
                n += 1
                first = end
            first = -1
        k += 1
    return n


@kernel
def find_stretches(mask: Image) -> tuple[Runs, Runs, Runs]:
    """Horizontal runs of blocks of 32 pixels with any that is not 0: row, start, stop.

    They are found faster than `find_runs` finds runs, and are long enough for vectorised loops over the pixels within.
    mask (h, w) uint8; each (N,) int32 in raster order, stop excluded.
    """
    w, size = mask.shape[1], mask.size
    words = mask.ravel()[: size // _BLOCK * _BLOCK].view(np.uint64)
    some = np.ones((size + _BLOCK - 1) // _BLOCK, np.uint8)
    for k in range(len(words) // 4):
        some[k] = words[4 * k] | words[4 * k + 1] | words[4 * k + 2] | words[4 * k + 3] != 0
    most = len(some) + len(mask)
    row, start, stop = np.empty(most, np.int32), np.empty(most, np.int32), np.empty(most, np.int32)
    n = k = 0
    while k < len(some):
        begin = k * _BLOCK
        while k < len(some) and some[k] != 0:
            k += 1
        end = min(k * _BLOCK, size)
        while begin < end:  # a row's end ends a run
            y = begin // w
            row[n], start[n], stop[n] = y, begin - y * w, min(end - y * w, w)
            begin, n = (y + 1) * w, n + 1
        k += 1
    return row[:n], start[:n], stop[:n]


@inlined
def _rest(pixels: Image, filler: np.bool_) -> np.uint64:
    """The last pixels, fewer than eight, as a padded word."""
    rest = np.full(8, filler, np.uint8)
    for x in range(len(pixels) // 8 * 8, len(pixels)):
        rest[x % 8] = pixels[x]
    return rest.view(np.uint64)[0]


@inlined
def _not_zero(word: np.uint64) -> np.uint64:
    """The highest bit of each byte that is not 0."""
    return ((word & ~_HIGHS) + ~_HIGHS | word) & _HIGHS


@inlined
def _lowest_byte(word: np.uint64) -> int:
    """Number of the lowest byte that is not 0, of a word that is not 0."""
    number = 0
    if word & np.uint64(0xFFFFFFFF) == 0:
        number, word = 4, word >> np.uint64(32)
    if word & np.uint64(0xFFFF) == 0:
        number, word = number + 2, word >> np.uint64(16)
    return number + 1 if word & np.uint64(0xFF) == 0 else number


@inlined
def _after_zeros(words: Words, k: int) -> int:
    """Index of the first word from k on that is not 0; len(words) if there is none."""
    while k + 8 <= len(words) and _all_zero(words, k):
        k += 8
    while k < len(words) and words[k] == 0:
        k += 1
    return k


@inlined
def _all_zero(words: Words, k: int) -> bool:
    """Whether the eight words from k on are all 0."""
    total = _NONE
    for i in range(k, k + 8):
        total |= words[i]
    return total == 0


@kernel
def connect(row: Runs, start: Runs, stop: Runs, diagonal: np.int64) -> tuple[Ints, int]:
    """Component of each run and the number of components; overlapping runs of neighbouring rows are connected.

    diagonal: CORNERS joins across corners (8-connected), SIDES does not (4-connected). Components are numbered by their
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


@kernel
def components(parent: Ints) -> tuple[Ints, int]:
    """Component of each element (N,) after `join`, numbered by first element, and the number of components."""
    label = np.empty(len(parent), np.int64)
    count = 0
    for k in range(len(parent)):  # a root is the first of its component, so it is numbered before the others
        if parent[k] == k:
            label[k] = count
            count += 1
        else:
            label[k] = label[_root(parent, k)]
    return label, count


@kernel
def join(parent: Ints, a: int, b: int) -> None:
    """Join the components of a and b; parent (N,) int64 begins as 0, 1, 2, ..."""
    a, b = _root(parent, a), _root(parent, b)
    if a < b:
        parent[b] = a
    else:
        parent[a] = b


@inlined
def _root(parent: Ints, k: int) -> int:
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k
