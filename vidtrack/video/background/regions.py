"""What whole regions of a mask tell: enclosed holes belong to their blob, and a blob may be a ghost."""

from __future__ import annotations

import numba
import numpy as np

from vidtrack.compiled import CACHE
from vidtrack.video.runs import connect, find_runs

_REACH = 3  # px to either side of a border over which contrast is taken
_ALIKE = np.float32(6)  # grey levels within which a pixel is as it was before; wider, dark vehicles pass for it
_RETURNED = 0.6  # share of a blob's pixels that are as they were before
_MARGIN = np.float32(1.3)  # against healing what is really there: a dark vehicle on a road with marks


@numba.njit(cache=CACHE, nogil=True)
def paint(mask, row, start, stop, value):  # type: ignore[no-untyped-def]
    """Set mask (h, w) uint8 to value on the runs."""
    for k in range(len(row)):
        mask[row[k], start[k] : stop[k]] = value


@numba.njit(cache=CACHE, nogil=True)
def fill_holes(mask):  # type: ignore[no-untyped-def]
    """Set to 255 the background regions (4-connected) that do not reach the picture's edge. mask (h, w) uint8."""
    h, w = mask.shape
    row, start, stop = find_runs(mask, True)
    label, count = connect(row, start, stop, 0)
    enclosed = np.ones(count, np.bool_)
    for k in range(len(row)):
        if row[k] == 0 or row[k] == h - 1 or start[k] == 0 or stop[k] == w:
            enclosed[label[k]] = False
    hole = enclosed[label]
    paint(mask, row[hole], start[hole], stop[hole], 255)


@numba.njit(cache=CACHE, nogil=True)
def find_ghosts(mask, luma, scene, settled_s):  # type: ignore[no-untyped-def]
    """Runs (row, start, stop) of the blobs that are in the scene and no longer in the picture.

    Either the road is seen again as it was before the scene took over what stood on it. Or the edge of the object
    that made the blob is in the scene: along its border the scene has clearly more contrast (luminance differences
    over +-3 px, across and down) than the frame, and it has been covered for settled_s on average.
    """
    h, w = mask.shape
    row, start, stop = find_runs(mask, False)
    label, count = connect(row, start, stop, 1)
    area = np.zeros(count, np.int64)
    returned = np.zeros(count, np.int64)
    excess = np.zeros(count, np.float32)  # contrast of the scene above that of the frame
    lack = np.zeros(count, np.float32)  # seconds of cover below settled_s
    for k in range(len(row)):
        y, blob = row[k], label[k]
        area[blob] += stop[k] - start[k]
        alike = 0
        for x in range(start[k], stop[k]):
            alike += abs(np.float32(luma[y, x]) - scene.former[y, x]) < _ALIKE
        returned[blob] += alike
        if y < _REACH or y >= h - _REACH:
            continue
        for x in range(max(start[k], _REACH), min(stop[k], w - _REACH)):
            if start[k] < x < stop[k] - 1 and mask[y - 1, x] > 0 and mask[y + 1, x] > 0:
                continue
            excess[blob] += _contrast(scene.luma, y, x) - _MARGIN * _contrast(luma, y, x)
            lack[blob] += settled_s - scene.covered_s[y, x]
    ghost = (returned > _RETURNED * area) | ((excess > 0) & (lack <= 0))
    chosen = ghost[label]
    return row[chosen], start[chosen], stop[chosen]


@numba.njit(cache=CACHE, nogil=True, inline="always")
def _contrast(luma, y, x):  # type: ignore[no-untyped-def]
    across = abs(np.float32(luma[y, x + _REACH]) - np.float32(luma[y, x - _REACH]))
    return across + abs(np.float32(luma[y + _REACH, x]) - np.float32(luma[y - _REACH, x]))
