"""What is left of each track when its rows have gone by: where it began and ended, and how long the vehicle is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.traffic.measures.rows import Rows

_LEAST_SIGMA_M = 0.01
"""m; to which lengths are known at best"""


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
        weight = 1 / np.maximum(rows.length_sigma, _LEAST_SIGMA_M) ** 2
        known = np.isfinite(weight * rows.length)
        for k, term in enumerate((weight * rows.length, weight)):
            sums = np.bincount(rows.track[known], term[known], len(self._length))
            self._length[:, k] += sums
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
        total, weight = self._length[:tracks].T
        return np.asarray(np.divide(total, weight, out=np.full(len(total), np.nan), where=weight > 0))


def _end(states: Floats) -> End:
    return End(states[:, 0], states[:, 1:3], states[:, 3], states[:, 4:])


def class_of(length: Floats, classes: dict[str, tuple[float, float]]) -> list[str | None]:
    """(T,) the first class of the site whose bounds hold the length [m]; None where there is none."""
    number = np.full(len(length), len(classes))
    for k, (low, high) in reversed(list(enumerate(classes.values()))):
        number[(length >= low) & (length <= high)] = k
    names = [*classes, None]
    return [names[k] for k in number.tolist()]
