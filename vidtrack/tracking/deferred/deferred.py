"""Deferred decisions: a row is one of the possible histories of a track."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vidtrack.arrays.types import Ints, Mask
from vidtrack.associate.problem import Problem
from vidtrack.associate.two_stage import TwoStage
from vidtrack.decision import Event
from vidtrack.tracking.association import Association
from vidtrack.tracking.births import distinct
from vidtrack.tracking.deferred.forest import Forest
from vidtrack.tracking.picture.picture import View
from vidtrack.tracking.register import Register
from vidtrack.tracks import CONFIRMED, Tracks

UNSURE = 0.01
"""Factor on the likelihood of a detection with a low score: more of these are false."""


@dataclass(frozen=True, slots=True)
class Deferred:
    """Each scan is decided some scans later.

    forest     the histories of all tracks
    two_stage  which scores may start a track
    births     whether measurements start tracks
    """

    forest: Forest
    two_stage: TwoStage
    births: bool

    STATE = ("forest",)

    def associate(
        self, problem: Problem, shared: Ints, view: View | None, register: Register, events: list[Event]
    ) -> Association:
        """Grow the forest; the register's rows become their successors."""
        problem = problem.apart(shared)
        pairs, sure = problem.pairs, self.two_stage.sure(problem.scan)
        log_l = pairs.log_l + np.where(sure, 0.0, np.log(UNSURE))[pairs.measurement]
        problem = replace(problem, pairs=replace(pairs, log_l=log_l))
        starts = sure & self.births
        starts[shared[shared >= 0]] = False
        problem, decision, born = self.forest.grow(problem, register, distinct(problem.scan, starts), events)
        return Association.deferred(problem, decision, shared, born)

    def shown(self, rows: int) -> Mask:
        """(rows,) the output row of each track."""
        shown = np.zeros(rows, bool)
        shown[self.forest.shown[self.forest.shown < rows]] = True
        return shown

    def visible(self, tracks: Tracks) -> Tracks:
        """Those that are shown, in the order of their ids."""
        shown = self.forest.shown
        return tracks.only(shown[np.argsort(tracks.id[shown])])

    def settle(self, register: Register, t: float, events: list[Event]) -> None:
        """Choose the rows that are shown."""
        self.forest.settle(register, t, events)

    def confirm(self, ready: Mask, register: Register) -> Mask:
        """Confirm all rows of the tracks whose shown row is ready (T,), if the track is probable enough."""
        ready = ready & self.forest.sure & self.shown(len(ready))
        register.status[np.isin(register.id, register.id[ready])] = CONFIRMED
        return ready

    def ended(self, ids: Ints, going: Mask, why: Mask) -> Ints:
        """Ids of the tracks of which no row stays."""
        return np.setdiff1d(ids[why], ids[~going])

    def keep(self, kept: Mask) -> None:
        """Drop all rows but these."""
        self.forest.keep(kept)

    def add(self, count: int) -> None:
        """Append tracks of one history each."""
        self.forest.add(count)
