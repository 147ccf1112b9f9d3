"""The association of one scan, and the interface of immediate and deferred decisions."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from vidtrack.arrays.types import Ints, Mask
from vidtrack.associate.problem import Problem
from vidtrack.decision import Decision, Event
from vidtrack.tracking.choices import heaviest
from vidtrack.tracking.picture.picture import View
from vidtrack.tracking.register import Register
from vidtrack.tracks import Tracks


class Association(NamedTuple):
    """The outcome of a scan's association.

    problem   the scan's problem as the K successors of the rows see it
    decision  how the successors come from the rows
    taken     (K,) measurement of the largest weight of each successor; -1: none
    shared    (K,) measurement whose edges update each successor, and perhaps others; -1: none
    hides     (M,) measurements that may contain a further target: larger than their tracks
    free      (M,) measurements that start a track
    """

    problem: Problem
    decision: Decision
    taken: Ints
    shared: Ints
    hides: Mask
    free: Mask

    @classmethod
    def deferred(cls, problem: Problem, decision: Decision, shared: Ints, free: Mask) -> Association:
        """What a forest decided for rows that do not share a measurement (T,)."""
        on = shared[decision.parent]
        return cls(problem, decision, heaviest(decision), on, np.ones(problem.measurements, bool), free)

    def choose(self, rows: Ints, measurement: Ints, shared: bool) -> None:
        """Change what these successors (n,) took to these measurements (n,), -1: none; each alone, or all together."""
        alone = np.where(shared, -1, measurement)
        self.shared[rows] = np.where(shared, measurement, -1)
        self.taken[rows] = alone
        decision = self.decision
        changed = np.isin(decision.row, rows)
        decision.beta[changed] = decision.measurement[changed] == self.taken[decision.row[changed]]
        decision.beta0[rows] = alone < 0

    @property
    def measurement(self) -> Ints:
        """(K,) measurement of each successor, alone or shared; -1: none."""
        on = self.shared >= 0
        return np.where(on, self.shared, self.taken) if np.count_nonzero(on) else self.taken


class Timing(Protocol):
    """When a scan is decided finally: `Immediate`, in the scan itself, or `Deferred`, some scans later.

    A row of the register is a track, or one of the possible histories of a track.
    """

    def associate(
        self, problem: Problem, shared: Ints, view: View | None, register: Register, events: list[Event]
    ) -> Association:
        """Assign measurements to the rows that do not share one (T,); the register's rows become their successors."""

    def shown(self, rows: int) -> Mask:
        """(rows,) the rows, of the first `rows`, that are output as tracks."""

    def visible(self, tracks: Tracks) -> Tracks:
        """The output rows of `tracks`, one per track."""

    def settle(self, register: Register, t: float, events: list[Event]) -> None:
        """Choose the output rows, after the new tracks are in the bank."""

    def confirm(self, ready: Mask, register: Register) -> Mask:
        """Confirm tracks of rows that are `ready` (T,) by their life cycle, and certain enough; returns (T,) these."""

    def ended(self, ids: Ints, going: Mask, why: Mask) -> Ints:
        """Ids of tracks without rows (ids (T,)) outside `going` (T,), if a row is in `why` (T,)."""

    def keep(self, kept: Mask) -> None:
        """Drop all rows but these."""

    def add(self, count: int) -> None:
        """Append rows of `count` externally given tracks."""
