"""Map of places with motion but no traffic: leaves, water, flags, burnt-in clocks."""

from __future__ import annotations

import math

import numpy as np

from vidtrack.arrays.rows import located
from vidtrack.arrays.types import Floats, Ints, Mask
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
        return self.starts[self._cells(xy)] > _RESTLESS

    def learn(self, tracks: Tracks) -> None:
        """Count the tracks that ended since the last scan without having travelled, apart from known vehicles."""
        self.starts *= math.exp(-max(tracks.t - self._time_s, 0.0) / _FORGET_S)
        self._time_s = tracks.t
        alive = located(tracks.id, self._id)
        ended = np.ones(len(self._id), bool)
        ended[alive[alive >= 0]] = False
        if np.count_nonzero(ended):
            np.add.at(self.starts, self._cells(self._xy[ended]), 1.0)
        young = (tracks.status == TENTATIVE) & (tracks.travel < longer(tracks.box))
        if np.count_nonzero(young):
            known = tracks.box[tracks.status != TENTATIVE]
            young[young] = best_cover(tracks.box[young], known)[1] < 0.3
        rows = young.nonzero()[0]
        rows = rows[tracks.id[rows].argsort()]
        self._id, self._xy = tracks.id[rows], tracks.xy[rows]

    def _cells(self, xy: Floats) -> tuple[Ints, Ints]:
        rows, columns = self.starts.shape
        x = np.clip((xy[:, 0] / self._cell).astype(np.int64), 0, columns - 1)
        return np.clip((xy[:, 1] / self._cell).astype(np.int64), 0, rows - 1), x
