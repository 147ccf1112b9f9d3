"""Filters of one 8-bit plane: the area average that reduces it, and the 1-2-1 weights against sensor noise."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from vidtrack.compiled import kernel, specialised
from vidtrack.video.frame import Image

LARGEST_STEP = 256  # a column of so many pixels still adds up in 16 bits


def area_average(plane: Image, shape: tuple[int, int], step: int) -> Image:
    """(h, w) means of step x step pixels from the upper left corner on, halves rounded up; step <= LARGEST_STEP."""
    reduced = np.empty(shape, np.uint8)
    _averaging(step)(plane, reduced)
    return reduced


def smoothed(plane: Image) -> Image:
    """(h, w) the plane weighted 1-2-1 in both directions; it is mirrored at its edges, and halves are rounded up."""
    smooth = np.empty(plane.shape, np.uint8)
    _weigh(plane, smooth)
    return smooth


@cache
def _averaging(step: int) -> Callable[..., Any]:
    """The kernel for one step: only with a constant stride is it vectorised.

    It reads the picture in the order of memory, which is faster than cv2.resize where the picture is in no cache.
    """

    def average(plane: Image, reduced: Image) -> None:
        h, w = reduced.shape
        column = np.empty(step * w, np.uint16)
        for y in range(h):
            for x in range(step * w):
                total = np.uint16(0)
                for j in range(step):
                    total += np.uint16(plane[step * y + j, x])
                column[x] = total
            for x in range(w):
                area = np.uint32(step * step // 2)
                for i in range(step):
                    area += column[step * x + i]
                reduced[y, x] = area // np.uint32(step * step)

    return specialised(average, step)


@kernel
def _weigh(plane: Image, smooth: Image) -> None:
    """Fill smooth (h, w) from plane (h, w)."""
    h, w = plane.shape
    column = np.empty(w + 2, np.uint16)
    inside = column[1:-1]
    for y in range(h):
        above = plane[y - 1 if y > 0 else min(1, h - 1)]
        below = plane[y + 1 if y < h - 1 else max(h - 2, 0)]
        for x in range(w):
            inside[x] = above[x] + 2 * np.uint16(plane[y, x]) + below[x]
        column[0], column[-1] = inside[min(1, w - 1)], inside[max(w - 2, 0)]
        for x in range(w):
            smooth[y, x] = (column[x] + 2 * column[x + 1] + column[x + 2] + 8) >> 4
