"""Immediate decisions, in the scan itself: a row is a track."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.rows import every
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.hard import GNN, HARD, Associator, one_hot
from vidtrack.associate.problem import Problem
from vidtrack.associate.two_stage import TwoStage
from vidtrack.compiled import kernel
from vidtrack.decision import Decision, Event
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
        problem = whole.apart(shared)
        confirmed = register.status != TENTATIVE
        single = self.two_stage.single(problem.scan)
        if single and isinstance(self.rule, GNN):
            found = self._by_turns(self.rule, problem, shared, view, confirmed)
        else:
            found = self._by_weights(problem, shared, view, confirmed)
        decision, taken, shared, hides, free = found
        if not (self.births and single):
            free &= self.two_stage.sure(problem.scan) & self.births
        if not self.rule.gated_births:
            free[whole.pairs.measurement] = False
        return Association(whole, decision, taken, shared, hides, distinct(problem.scan, free))

    def _by_turns(
        self, rule: GNN, problem: Problem, unresolved: Ints, view: View | None, confirmed: Mask
    ) -> tuple[Decision, Ints, Ints, Mask, Mask]:
        """Decision, taken (T,), shared (T,), hides (M,) and free (M,), where each measurement is taken as a whole."""
        taken = rule.taken(problem, confirmed, every(problem.measurements))
        shared, hides = self.sharing.claim(view, taken, confirmed, problem.measurements)
        taken, free = _given(taken, shared, hides, unresolved)
        tentative = ~confirmed
        if np.count_nonzero(tentative):
            second = rule.taken(problem, tentative, free)
            taken, free = _given(np.maximum(taken, second), shared, free, unresolved)
        shared, free = self.sharing.catch(view, taken, np.maximum(shared, unresolved), free)
        return one_hot(taken), taken, shared, hides, free

    def _by_weights(
        self, problem: Problem, unresolved: Ints, view: View | None, confirmed: Mask
    ) -> tuple[Decision, Ints, Ints, Mask, Mask]:
        """The same, where tracks may have shares of measurements, or take them by their scores."""
        pairs = problem.pairs
        decision = self.two_stage.decide(self.rule, problem, confirmed)
        shared, hides = self.sharing.claim(view, heaviest(decision), confirmed, problem.measurements)
        decision = decision.without(shared >= 0)
        free, left = _left_over(
            hides, decision.measurement, decision.beta, unresolved, confirmed, pairs.row, pairs.measurement
        )
        if np.count_nonzero(left):
            second = self.two_stage.decide(self._starter, problem.only(left), ~confirmed)
            free = _unclaimed(free, second.measurement, second.beta, unresolved)
            decision = decision.joined(second)
        taken = heaviest(decision)
        shared, free = self.sharing.catch(view, taken, np.maximum(shared, unresolved), free)
        return decision, taken, shared, hides, free

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
def _given(taken: Ints, shared: Ints, free: Mask, unresolved: Ints) -> tuple[Ints, Mask]:
    """(T,) `taken` without the rows that share (T,); (M,) those of the free measurements that are still free."""
    kept, left = np.empty_like(taken), free.copy()
    for t in range(len(taken)):
        kept[t] = -1 if shared[t] >= 0 else taken[t]
        for j in (kept[t], unresolved[t]):
            if j >= 0:
                left[j] = False
    return kept, left


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
