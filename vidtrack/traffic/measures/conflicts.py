"""The table `conflicts`: which vehicles came close, by time to collision and post-encroachment time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.traffic.measures.bodies import Bodies, Encounters
from vidtrack.traffic.measures.closing import closing
from vidtrack.traffic.measures.encroachment import CHORD_S, CROSSING_RAD, PET_S, encroachments
from vidtrack.traffic.measures.rows import Rows

_ACROSS_RAD, _AGAINST_RAD = np.radians(85), np.radians(150)
"""Angles from which on vehicles cross (SSAM), and meet head-on"""
KINDS = "rear-end", "merging", "crossing", "head-on"
TTC, PET = range(2)
_LATE_S = PET_S + CHORD_S
"""s; who encroaches is judged so late: when all of the first vehicle's rows that count have their headings"""
_MEMORY_S = 2 * PET_S + CHORD_S + _LATE_S
"""s; that is judged by where the second vehicle was up to PET_S before, and the first one up to PET_S before that"""


@dataclass(frozen=True, slots=True, eq=False)
class Conflicts:
    """C pairs of vehicles in order of time.

    first, second   (C,) numbers; `second` comes to where `first` was, or closes in on it
    t       (C,) s; of the least post-encroachment time, without one of the least time to collision
    angle   (C,) rad; between their headings then
    value, sigma, when   (2, C) s; of TTC and of PET: the least one, its standard deviation, its time; NaN: none
    xy      (2, C, 2) m; where
    speed   (C, 2) m/s; of both at t
    merged  (C,) one of them shares a blob with others then
    """

    first: Ints
    second: Ints
    t: Floats
    angle: Floats
    value: Floats
    sigma: Floats
    when: Floats
    xy: Floats
    speed: Floats
    merged: np.ndarray

    def __len__(self) -> int:
        return len(self.t)

    @property
    def kind(self) -> Ints:
        """(C,) what the angle says, an index of KINDS."""
        return np.digitize(self.angle, (CROSSING_RAD, _ACROSS_RAD, _AGAINST_RAD))

    @property
    def kinds(self) -> list[str]:
        """(C,) the same in words."""
        return [KINDS[kind] for kind in self.kind.tolist()]


class Meeting:
    """Takes blocks of rows in order of time; remembers those of the last _MEMORY_S, and each block's encounters."""

    def __init__(self) -> None:
        self._recent = Bodies.nothing()
        self._done = -np.inf
        self._closed, self._encroached = [Encounters.nothing()], [Encounters.nothing()]

    def add(self, rows: Rows) -> None:
        """Look at some rows. Their last moment may go on in the next block and waits for it."""
        self._recent = self._recent.and_also(rows)
        if len(self._recent):
            self._look(until=self._recent.t[-1])

    def _look(self, until: float) -> None:
        """Take the moments before `until` that are new; for encroachments those _LATE_S earlier."""
        bodies = self._recent
        if until <= self._done:
            return
        first, last = np.searchsorted(bodies.t, [self._done, until])
        if first < last:
            self._closed.append(closing(bodies.only(slice(first, last))))
        self._encroached.append(encroachments(bodies, self._done - _LATE_S, until - _LATE_S))
        self._done = until
        self._recent = bodies.only(slice(np.searchsorted(bodies.t, until - _MEMORY_S, side="right"), None))

    def conflicts(self, vehicle: Ints, spans: Floats) -> Conflicts:
        """What was found; `vehicle` (T,) of each track, `spans` (S, 2) s what was watched without a break."""
        self._look(until=np.inf)
        closed, encroached = Encounters.together(self._closed), Encounters.together(self._encroached)
        encroached = encroached.only(encroached.least())
        encroached = encroached.only(np.isfinite(encroached.value))
        closed, encroached = (found.between(vehicle) for found in (closed, encroached))
        closed, encroached = (found.only(found.least()) for found in (closed, encroached))
        span = [np.searchsorted(spans[:, 0], t, side="right") for t in (encroached.t, encroached.t - encroached.value)]
        return _joined(closed, encroached.only(span[0] == span[1]))

    def settled(self, until: float) -> Conflicts:
        """What was found of tracks that were in no encounter for 2 PET_S before `until`, once; it is forgotten then.

        until   s; all rows before it were added, or no more will come: inf
        """
        self._look(until)
        closed, encroached = Encounters.together(self._closed), Encounters.together(self._encroached)
        both = Encounters.together([closed, encroached])
        pairs, row = np.unique(both.pair, return_inverse=True)
        newest = np.full(len(pairs), -np.inf)
        np.maximum.at(newest, row, both.t)
        over = (newest <= self._done - 2 * PET_S)[row]
        found = []
        for one, done in zip((closed, encroached), np.split(over, [len(closed)]), strict=True):
            done_ones = one.only(done & (one.first != one.second))
            found.append(done_ones.only(done_ones.least()))
        self._closed, self._encroached = [closed.only(~over[: len(closed)])], [encroached.only(~over[len(closed) :])]
        return _joined(found[0], found[1].only(np.isfinite(found[1].value)))


def _joined(closed: Encounters, encroached: Encounters) -> Conflicts:
    """One row for each two vehicles: time and place of the encroachment, else of the closing."""
    pairs, row = np.unique(np.concatenate([closed.pair, encroached.pair]), return_inverse=True)
    rows = np.split(row, [len(closed)])
    value, sigma, when = np.full((3, 2, len(pairs)), np.nan)
    xy, speed = np.full((2, len(pairs), 2), np.nan), np.empty((len(pairs), 2))
    first, second = np.empty((2, len(pairs)), np.int64)
    angle, merged = np.empty(len(pairs)), np.empty(len(pairs), bool)
    for kind, found, at in ((TTC, closed, rows[0]), (PET, encroached, rows[1])):  # the last one stays
        value[kind, at], sigma[kind, at], when[kind, at], xy[kind, at] = found.value, found.sigma, found.t, found.xy
        first[at], second[at], speed[at] = found.first, found.second, found.speed
        angle[at], merged[at] = found.angle, found.merged
    t = np.where(np.isnan(when[PET]), when[TTC], when[PET])
    order = np.lexsort((second, first, t))
    return Conflicts(
        *(first[order], second[order], t[order], angle[order], value[:, order], sigma[:, order], when[:, order]),
        *(xy[:, order], speed[order], merged[order]),
    )
