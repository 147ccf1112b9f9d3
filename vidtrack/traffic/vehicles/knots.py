"""Tracks thinned out to knots: the mean edges of the boxes that were seen over some tenths of a second of driving."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.rows import by_number, make_room
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import inlined, kernel

STEP_S, STEP_M = 0.2, 0.5
"""A knot ends when it has lasted so long and the vehicle has moved so far: one that stands makes no knots."""
_BEGIN, _X, _Y, _TIME, _ROWS, _EDGE, _SEEN = 0, 1, 2, 3, 4, 5, 9
COLUMNS = 13


@dataclass(frozen=True, slots=True, eq=False)
class Knots:
    """K knots in order of tracks and times.

    first  (T + 1,) where the knots of each track begin
    t      (K,) s; mean time
    edge   (K, 4) px; mean left, top, right and lower edges of the boxes, NaN where none was seen
    rows   (K,) how many boxes

    A day has millions of knots: edges in single precision are as good as a thousandth of a pixel. What `between` gives
    is in double precision.
    """

    first: Ints
    t: Floats
    edge: Floats
    rows: Floats

    def between(self, begin: int, end: int) -> Knots:
        """Those of the tracks begin, begin + 1, ..., end - 1."""
        first = self.first[begin : end + 1]
        rows = slice(first[0], first[-1])
        return Knots(first - first[0], self.t[rows], self.edge[rows].astype(float), self.rows[rows].astype(float))

    def only(self, chosen: Mask) -> Knots:
        """The knots of a mask (K,)."""
        before = np.concatenate([[0], np.cumsum(chosen)])
        return Knots(before[self.first], self.t[chosen], self.edge[chosen], self.rows[chosen])


class Knotting:
    """Takes rows in order of time, makes knots of them."""

    def __init__(self) -> None:
        self._open = np.full((0, COLUMNS), np.nan)
        self._done: list[tuple[Ints, Floats, Floats]] = []

    def add(self, track: Ints, t: Floats, xy: Floats, edge: Floats) -> None:
        """Look at rows: track (N,), t (N,) s, xy (N, 2) m roughly, edge (N, 4) px."""
        if len(track) == 0:
            return
        make_room(self._open, int(track.max()) + 1, np.nan)
        who, done = np.empty(len(track), np.int64), np.empty((len(track), 6))
        count = _gather(track, t, xy, edge, self._open, who, done)
        self._keep(who[:count], done[:count])

    def knots(self, tracks: int) -> Knots:
        """All knots of `tracks` tracks, with those that rows are still gathered for; what is kept is given away."""
        open_ = np.flatnonzero(self._open[:, _ROWS] > 0)
        rest = np.empty((len(open_), 6))
        _means(self._open[open_], rest)
        self._keep(open_, rest)
        columns = list(zip(*self._done, strict=True))
        self._done.clear()
        values, t, who = (np.concatenate(columns.pop()) for _ in range(3))  # a day of them is large: none stays twice
        order = by_number(who)  # those of each track come in order of time
        first = np.searchsorted(who[order], np.arange(tracks + 1))
        del who
        for column in values.T:
            column[:] = column[order]  # one after the other: no second copy of all
        return Knots(first, t[order], values[:, :4], values[:, 4])

    def _keep(self, who: Ints, done: Floats) -> None:
        self._done.append((who.astype(np.int32), done[:, 0].copy(), done[:, 1:].astype(np.float32)))


@inlined
def _mean(knots: Floats, k: int, done: Floats, i: int) -> None:
    """Write knot k (T, COLUMNS) into row i (K, 6): mean time, four mean edges, rows."""
    done[i, 0] = knots[k, _TIME] / knots[k, _ROWS]
    for side in range(4):
        done[i, 1 + side] = knots[k, _EDGE + side] / knots[k, _SEEN + side]  # 0 / 0: never seen
    done[i, 5] = knots[k, _ROWS]


@kernel
def _means(knots: Floats, done: Floats) -> None:
    for i in range(len(knots)):
        _mean(knots, i, done, i)


@kernel
def _gather(track: Ints, t: Floats, xy: Floats, edge: Floats, open_: Floats, who: Ints, done: Floats) -> int:
    """Add rows to the open knots (T, COLUMNS); writes the tracks and values of those that end, returns their number."""
    count = 0
    for i in range(len(track)):
        if np.isnan(edge[i, 3]) or np.isnan(xy[i, 0]):
            continue
        k = track[i]
        if (
            open_[k, _ROWS] > 0
            and t[i] - open_[k, _BEGIN] >= STEP_S
            and (xy[i, 0] - open_[k, _X]) ** 2 + (xy[i, 1] - open_[k, _Y]) ** 2 >= STEP_M**2
        ):
            _mean(open_, k, done, count)
            who[count] = k
            count += 1
            open_[k, _ROWS] = 0
        if not open_[k, _ROWS] > 0:
            open_[k] = 0
            open_[k, _BEGIN], open_[k, _X], open_[k, _Y] = t[i], xy[i, 0], xy[i, 1]
        open_[k, _TIME] += t[i]
        open_[k, _ROWS] += 1
        for side in range(4):
            if not np.isnan(edge[i, side]):
                open_[k, _EDGE + side] += edge[i, side]
                open_[k, _SEEN + side] += 1
    return count
