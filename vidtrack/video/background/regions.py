"""What whole regions of a mask tell: enclosed holes belong to their blob, and a blob may be a ghost."""

from __future__ import annotations

import numba
import numpy as np

from vidtrack.video.runs import connect, find_runs

_REACH = 3  # px to either side of a border over which contrast is taken


@numba.njit(cache=True, nogil=True)
def paint(mask, row, start, stop, value):  # type: ignore[no-untyped-def]
    """Set mask (h, w) uint8 to value on the runs."""
    for k in range(len(row)):
        mask[row[k], start[k] : stop[k]] = value


@numba.njit(cache=True, nogil=True)
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


@numba.njit(cache=True, nogil=True)
def find_ghosts(mask, luma, scene, settled_s):  # type: ignore[no-untyped-def]
    """Runs (row, start, stop) of the blobs that are in the scene and no longer in the picture.

    The border of a blob has its edge where the object is. A ghost has more contrast (luminance differences over
    +-3 px, across and down) along its border in the scene than in the frame, and the border has been covered for
    settled_s on average.
    """
    h, w = mask.shape
    row, start, stop = find_runs(mask)
    label, count = connect(row, start, stop, 1)
    excess = np.zeros(count, np.float32)  # contrast of the scene above that of the frame
    lack = np.zeros(count, np.float32)  # seconds of cover below settled_s
    for k in range(len(row)):
        y, blob = row[k], label[k]
        if y < _REACH or y >= h - _REACH:
            continue
        for x in range(max(start[k], _REACH), min(stop[k], w - _REACH)):
            if start[k] < x < stop[k] - 1 and mask[y - 1, x] > 0 and mask[y + 1, x] > 0:
                continue
            excess[blob] += abs(scene.luma[y, x + _REACH] - scene.luma[y, x - _REACH])
            excess[blob] += abs(scene.luma[y + _REACH, x] - scene.luma[y - _REACH, x])
            excess[blob] -= abs(np.float32(luma[y, x + _REACH]) - np.float32(luma[y, x - _REACH]))
            excess[blob] -= abs(np.float32(luma[y + _REACH, x]) - np.float32(luma[y - _REACH, x]))
            lack[blob] += settled_s - scene.covered_s[y, x]
    ghost = (excess > 0) & (lack <= 0)
    chosen = ghost[label]
    return row[chosen], start[chosen], stop[chosen]
