"""Immediate decisions, in the scan itself: a row is a track."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.rows import every
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.hard import GNN, HARD, Associator
from vidtrack.associate.problem import Problem
from vidtrack.associate.two_stage import TwoStage
from vidtrack.compiled import kernel
from vidtrack.decision import Event
from vidtrack.tracking.association import Association
from vidtrack.tracking.births import distinct
from vidtrack.tracking.choices import heaviest
from vidtrack.tracking.occlusion.sharing import Sharing
from vidtrack.tracking.picture.picture import View
from vidtrack.tracking.register import Register
from vidtrack.tracks import CONFIRMED, TENTATIVE, Tracks

CLAIMED = 0.1
"""A measurement whose weights over all tracks sum to more than this starts no track."""


@dataclass(frozen=True, slots=True)
class Immediate:
    """Each scan is decided finally in the scan itself.

    rule       association rule
    sharing    what happens when targets share a measurement
    two_stage  two-stage association by score
    births     whether measurements that belong to no track start one
    """

    rule: Associator
    sharing: Sharing
    two_stage: TwoStage
    births: bool

    STATE = ()

    def associate(
        self, whole: Problem, shared: Ints, view: View | None, register: Register, events: list[Event]
    ) -> Association:
        """Confirmed tracks first, then the measurements that they share, then tentative tracks."""
        problem, unresolved = whole.apart(shared), shared
        pairs, count = problem.pairs, problem.measurements
        confirmed = register.status != TENTATIVE
        decision = self.two_stage.decide(self.rule, problem, confirmed)
        shared, hides = self.sharing.claim(view, decision, confirmed, count)
        decision = decision.without(shared >= 0)
        free, left = _left_over(
            hides, decision.measurement, decision.beta, unresolved, confirmed, pairs.row, pairs.measurement
        )
        if np.count_nonzero(left):
            second = self.two_stage.decide(self._starter, problem.only(left), ~confirmed)
            free = _unclaimed(free, second.measurement, second.beta, unresolved)
            decision = decision.joined(second)
        shared, free = self.sharing.catch(view, decision, np.maximum(shared, unresolved), free)
        if not (self.births and self.two_stage.single(problem.scan)):
            free &= self.two_stage.sure(problem.scan) & self.births
        if not self.rule.gated_births:
            free[whole.pairs.measurement] = False
        return Association(whole, decision, heaviest(decision), shared, hides, distinct(problem.scan, free))

    @property
    def _starter(self) -> Associator:
        """The rule for tentative tracks, always hard: with weights, clutter would keep them alive indefinitely."""
        return self.rule if isinstance(self.rule, HARD) else GNN()

    def shown(self, rows: int) -> Mask:
        """(rows,) all."""
        return every(rows)

    def visible(self, tracks: Tracks) -> Tracks:
        """All."""
        return tracks

    def settle(self, register: Register, t: float, events: list[Event]) -> None:
        """Every row is shown."""

    def confirm(self, ready: Mask, register: Register) -> Mask:
        """Confirm all that are ready."""
        register.status[ready] = CONFIRMED
        return ready

    def ended(self, ids: Ints, going: Mask, why: Mask) -> Ints:
        """Ids of the rows that go because of `why`."""
        return ids[why]

    def keep(self, kept: Mask) -> None:
        """Nothing is remembered of a row."""

    def add(self, count: int) -> None:
        """Nothing is remembered of a row."""


@kernel
def _left_over(
    free: Mask, measurement: Ints, beta: Floats, unresolved: Ints, confirmed: Mask, row: Ints, of_pair: Ints
) -> tuple[Mask, Mask]:
    """(M,) the unclaimed measurements, and (N,) the pairs that they leave to tracks which are not confirmed (T,)."""
    left = _unclaimed(free, measurement, beta, unresolved)
    open_ = np.empty(len(row), np.bool_)
    for k in range(len(row)):
        open_[k] = left[of_pair[k]] and not confirmed[row[k]]
    return left, open_


@kernel
def _unclaimed(free: Mask, measurement: Ints, beta: Floats, unresolved: Ints) -> Mask:
    """(M,) those of the free measurements (M,) that the weights (B,) leave, and that no row (T,) shares."""
    claim = np.zeros(len(free))
    for b in range(len(measurement)):
        claim[measurement[b]] += beta[b]
    for t in range(len(unresolved)):
        if unresolved[t] >= 0:
            claim[unresolved[t]] = np.inf
    left = np.empty(len(free), np.bool_)
    for j in range(len(free)):
        left[j] = free[j] and claim[j] <= CLAIMED
    return left
