"""Detects changes of the whole picture (light, view) by the share of foreground and the speed of its spread."""

from __future__ import annotations

import math

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.compiled import kernel
from vidtrack.video.frame import Image

_CELLS = (12, 8)  # columns and rows of a grid over the picture
_TOUCHED = 0.03  # share of a cell that makes it one with foreground
_SUDDEN = 0.25  # share of the cells; traffic reaches at most 0.12 more in 0.2 s
_SUDDEN_S = 0.4
_SETTLED_S = 2.0  # after a start, while everything that moves appears as foreground at once
_UNSEEN_S = 2.0  # after a longer gap light or view may have changed: compare with the last steady picture


class Change:
    """Monitors the foreground's share of the picture's pixels, and its share of the cells of a grid.

    A camera shift of a pixel or two makes few pixels foreground, but in most cells: along all edges.
    """

    STATE = ("_start_s", "_steady_s", "_steady_spread", "_time_s", "_recent")

    def __init__(self, largest_share: float) -> None:
        """largest_share: a larger share of foreground is a change, however slowly it came."""
        self._largest_share = largest_share
        self._start_s = -math.inf
        self._steady_s = math.inf  # when the picture was last steady,
        self._steady_spread = 0.0  # and what it was like then
        self._time_s = math.inf
        self._recent: Floats = np.empty((0, 2))  # time and spread of the last _SUDDEN_S

    def restart(self, time_s: float) -> None:
        """The scene is new."""
        self._start_s = time_s

    def lasted_s(self, mask: Image, time_s: float, match: bool = False) -> float:
        """Seconds since the picture was last steady, 0 while it is.

        mask   (h, w)
        match  whether the picture fits the scene: foreground that spreads is then a large vehicle
        """
        share, spread = _shares(mask, *_CELLS)
        changing = self._steady_s < self._time_s
        unseen = time_s - self._time_s > _UNSEEN_S
        recent = [row for row in self._recent.tolist() if row[0] >= time_s - _SUDDEN_S] + [[time_s, spread]]
        self._recent = np.array(recent)
        least_recent = min(each for _, each in recent)
        least = self._steady_spread if changing or unseen else least_recent
        self._time_s = time_s
        sudden = spread - least > _SUDDEN and time_s - self._start_s > _SETTLED_S
        if share > self._largest_share or (sudden and not match):
            return time_s - self._steady_s
        self._steady_s, self._steady_spread = time_s, least_recent
        return 0.0

    def skip(self, time_s: float) -> None:
        """Ignore a picture that cannot be compared with the scene."""
        self._time_s = self._steady_s = time_s


@kernel
def _shares(mask: Image, columns: int, rows: int) -> tuple[float, float]:
    """Share of the pixels, and of the cells of a grid, that are foreground; mask (h, w) uint8, 0 and 255."""
    h, w = mask.shape
    columns, rows = min(columns, w), min(rows, h)
    total = touched = 0
    count = np.empty(w, np.int32)  # in each column of pixels
    for j in range(rows):
        top, bottom = j * h // rows, (j + 1) * h // rows
        count[:] = 0
        for y in range(top, bottom):
            for x in range(w):
                count[x] += np.int32(mask[y, x] >> np.uint8(7))
        for i in range(columns):
            left, right = i * w // columns, (i + 1) * w // columns
            inside = 0
            for x in range(left, right):
                inside += count[x]
            total += inside
            touched += inside > _TOUCHED * (bottom - top) * (right - left)
    return total / (h * w), touched / (columns * rows)
