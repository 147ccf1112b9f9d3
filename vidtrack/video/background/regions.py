"""Whole regions of a mask: enclosed holes are filled, and blobs that are ghosts are found."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vidtrack.compiled import inlined, kernel
from vidtrack.video.background.scene import Scene
from vidtrack.video.frame import Image
from vidtrack.video.runs import CORNERS, HOLES, OBJECTS, SIDES, Runs, connect, find_runs

_REACH = 3  # px to either side of a border over which contrast is taken
_ALIKE = np.float32(6)  # grey levels within which a pixel is as it was before; wider, dark vehicles pass for it
_RETURNED = 0.6  # share of a blob's pixels that are as they were before
_MARGIN = np.float32(1.3)  # against healing what is really there: a dark vehicle on a road with marks
_CLEAR = np.float32(1.7)  # the same for what may be a known vehicle that waits
_UNMOVED_S = np.float32(2)  # for which that must be the same


@kernel
def paint(mask: Image, row: Runs, start: Runs, stop: Runs, value: int) -> None:
    """Set mask (h, w) uint8 to value on the runs."""
    for k in range(len(row)):
        mask[row[k], start[k] : stop[k]] = value


@kernel
def fill_holes(mask: Image) -> None:
    """Set to 255 the background regions (4-connected) that do not reach the picture's edge. mask (h, w) uint8."""
    h, w = mask.shape
    row, start, stop = find_runs(mask, HOLES)
    label, count = connect(row, start, stop, SIDES)
    enclosed = np.ones(count, np.bool_)
    for k in range(len(row)):
        if row[k] == 0 or row[k] == h - 1 or start[k] == 0 or stop[k] == w:
            enclosed[label[k]] = False
    for k in range(len(row)):
        if enclosed[label[k]]:
            mask[row[k], start[k] : stop[k]] = 255


@kernel
def find_ghosts(mask: Image, luma: Image, scene: Scene, settled_s: np.float32) -> tuple[Runs, Runs, Runs]:
    """Runs (row, start, stop) of the ghosts: objects that are in the scene and no longer in the picture.

    A blob is a ghost if the picture matches the scene as it was before the object was absorbed. It is also a ghost if
    the object's edge is in the scene only: along the blob's border the scene has more contrast (luminance differences
    over +-3 px, horizontal and vertical) than the frame, and has been covered for settled_s on average. Under known
    vehicles no cover is counted, but a track can end on the mark of another vehicle: clearly more contrast, while the
    cover has not changed for _UNMOVED_S, makes a ghost anywhere.
    """
    h, w = mask.shape
    row, start, stop = find_runs(mask, OBJECTS)
    label, count = connect(row, start, stop, CORNERS)
    area = np.zeros(count, np.int64)
    returned = np.zeros(count, np.int64)
    border = np.zeros(count, np.int64)
    in_scene, in_frame = np.zeros(count, np.float32), np.zeros(count, np.float32)  # contrast along the border
    covered_s, steady_s = np.zeros(count, np.float32), np.zeros(count, np.float32)
    for k in range(len(row)):
        y, blob = row[k], label[k]
        area[blob] += stop[k] - start[k]
        alike = np.int32(0)
        for x in range(np.uint64(start[k]), np.uint64(stop[k])):  # without a sign it is vectorised
            alike += np.int32(abs(np.float32(luma[y, x]) - scene.former[y, x]) < _ALIKE)
        returned[blob] += alike
        if y < _REACH or y >= h - _REACH:
            continue
        for x in range(max(start[k], _REACH), min(stop[k], w - _REACH)):
            if mask[y - 1, x] & mask[y + 1, x] != 0 and start[k] < x < stop[k] - 1:
                continue
            border[blob] += 1
            in_scene[blob] += _contrast(scene.luma, y, x)
            in_frame[blob] += _contrast(luma, y, x)
            covered_s[blob] += scene.covered_s[y, x]
            steady_s[blob] += scene.steady_s[y, x]
    n = 0
    for k in range(len(row)):
        b = label[k]
        left = in_scene[b] > _MARGIN * in_frame[b] and covered_s[b] >= settled_s * border[b]
        stays = in_scene[b] > _CLEAR * in_frame[b] and steady_s[b] >= _UNMOVED_S * border[b]
        row[n], start[n], stop[n] = row[k], start[k], stop[k]
        n += left or stays or returned[b] > _RETURNED * area[b]
    return row[:n], start[:n], stop[:n]


@inlined
def _contrast(luma: NDArray, y: int, x: int) -> np.float32:
    across = abs(np.float32(luma[y, x + _REACH]) - np.float32(luma[y, x - _REACH]))
    return across + abs(np.float32(luma[y + _REACH, x]) - np.float32(luma[y - _REACH, x]))
