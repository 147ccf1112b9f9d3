"""What is left of each track when its rows have gone by: where it began and ended, and how long the vehicle is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.traffic.lengths import length_sums, mean_length
from vidtrack.traffic.measures.rows import Rows


@dataclass(frozen=True, slots=True, eq=False)
class End:
    """The first or the last row of T tracks with a position; NaN where there was none.

    t (T,) s; xy (T, 2), sigma (T,) in the unit of positions; v (T, 2) m/s
    """

    t: Floats
    xy: Floats
    sigma: Floats
    v: Floats


class Lives:
    """Takes blocks of rows in order of time."""

    def __init__(self) -> None:
        self._head = np.full((0, 6), np.nan)
        self._tail = np.full((0, 6), np.nan)
        self._length = np.zeros((0, 2))

    def add(self, rows: Rows) -> None:
        """Look at some rows. A row in which the picture does not show the track is neither its first nor its last."""
        if len(rows) == 0:
            return
        tracks = int(rows.track.max()) + 1
        if tracks > len(self._head):
            more = max(tracks, 2 * len(self._head)) - len(self._head)
            self._head, self._tail = (np.vstack([old, np.full((more, 6), np.nan)]) for old in (self._head, self._tail))
            self._length = np.vstack([self._length, np.zeros((more, 2))])
        self._length += length_sums(rows.track, rows.length, rows.length_sigma, len(self._length))
        seen = np.flatnonzero(rows.seen & np.isfinite(rows.xy[:, 0]))
        states = np.column_stack([rows.t, rows.xy, rows.sigma, rows.v])
        self._tail[rows.track[seen]] = states[seen]  # of several the last one stays
        new = seen[np.isnan(self._head[rows.track[seen], 0])][::-1]
        self._head[rows.track[new]] = states[new]

    def head(self, tracks: int) -> End:
        """Where the first `tracks` tracks began."""
        return _end(self._head[:tracks])

    def tail(self, tracks: int) -> End:
        """Where they ended."""
        return _end(self._tail[:tracks])

    def length(self, tracks: int) -> Floats:
        """(T,) m; the mean weighted by the variances, NaN where it is not known."""
        return mean_length(self._length[:tracks])


def _end(states: Floats) -> End:
    return End(states[:, 0], states[:, 1:3], states[:, 3], states[:, 4:])
