"""Map of places with motion but no traffic: leaves, water, flags, burnt-in clocks."""

from __future__ import annotations

import math

import numpy as np

from vidtrack.arrays.rows import located
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import inlined, kernel
from vidtrack.tracking.boxes import best_cover, longer
from vidtrack.tracks import TENTATIVE, Tracks

_CELLS = 20  # across the longer side of the picture
_FORGET_S = 30.0
_RESTLESS = 2.0  # false starts, remembered


class RestlessMap:
    """False starts per cell of the picture: tracks that ended before they had travelled their own size.

    starts  (rows, columns) remembered false starts, forgotten within half a minute
    """

    STATE = ("starts", "_cell", "_time_s", "_id", "_xy")

    def __init__(self, width: float, height: float) -> None:
        """width, height of the picture [px]."""
        self._cell = max(width, height) / _CELLS
        self.starts: Floats = np.zeros((math.ceil(height / self._cell), math.ceil(width / self._cell)))
        self._time_s = 0.0
        self._id: Ints = np.empty(0, np.int64)  # tracks of the last scan that have not travelled yet, ascending
        self._xy: Floats = np.empty((0, 2))

    def now(self) -> Mask:
        """(rows, columns) cells that are restless."""
        return np.asarray(self.starts > _RESTLESS)

    def restless(self, xy: Floats) -> np.ndarray:
        """(N,) whether places (N, 2) saw false starts lately."""
        return _at(self.starts, self._cell, xy) > _RESTLESS

    def learn(self, tracks: Tracks) -> None:
        """Count the tracks that ended since the last scan without having travelled, apart from known vehicles."""
        self.starts *= math.exp(-max(tracks.t - self._time_s, 0.0) / _FORGET_S)
        self._time_s = tracks.t
        if len(self._id):
            _count_ended(self.starts, self._cell, located(tracks.id, self._id), self._xy)
        rows = (tracks.status == TENTATIVE).nonzero()[0]
        if len(rows):
            rows = rows[tracks.travel[rows] < longer(tracks.box[rows])]
            rows = rows[best_cover(tracks.box[rows], tracks.box[tracks.status != TENTATIVE])[1] < 0.3]
            rows = rows[tracks.id[rows].argsort()]
        self._id, self._xy = tracks.id[rows], tracks.xy[rows]


@kernel
def _at(starts: Floats, cell: float, xy: Floats) -> Floats:
    """(N,) starts at places (N, 2); those outside the picture are in the nearest cell."""
    found = np.empty(len(xy))
    for i in range(len(xy)):
        found[i] = starts[_cell(xy[i, 1], cell, starts.shape[0]), _cell(xy[i, 0], cell, starts.shape[1])]
    return found


@kernel
def _count_ended(starts: Floats, cell: float, alive: Ints, xy: Floats) -> None:
    """Add one where each track at xy (N, 2) was that is not among those `alive` (T,), indices or -1."""
    ended = np.ones(len(xy), np.bool_)
    for t in range(len(alive)):
        if alive[t] >= 0:
            ended[alive[t]] = False
    for i in range(len(xy)):
        if ended[i]:
            starts[_cell(xy[i, 1], cell, starts.shape[0]), _cell(xy[i, 0], cell, starts.shape[1])] += 1.0


@inlined
def _cell(place: float, cell: float, count: int) -> int:
    return min(max(int(place / cell), 0), count - 1)
