"""Who gets what: from the gated pairs of a scan to a decision, and to the measurements that may start a track."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vidtrack.associate.hard import GNN, HARD, Associator
from vidtrack.associate.problem import Problem
from vidtrack.associate.trust import Trust
from vidtrack.scan import Decision, Event, Ints
from vidtrack.tracking.births import distinct
from vidtrack.tracking.choices import heaviest
from vidtrack.tracking.forest import Forest
from vidtrack.tracking.register import Register

CLAIMED = 0.1
"""A measurement that tracks claim with more weight than this in sum starts no track."""
UNSURE = 0.01
"""Share of its likelihood that a detection which is not sure has in decisions that wait: more such are false."""

Mask = np.ndarray
Claim = Callable[[Ints], tuple[Ints, Mask]]


class Association(NamedTuple):
    """What comes out of a scan.

    problem   the scan's problem as the successors of the rows see it
    decision  how K successors come from the rows
    shared    (K,) blob that each leans on by its edges; -1: none
    hides     (M,) blobs that hide more than their tracks account for
    free      (M,) measurements that may start a track
    """

    problem: Problem
    decision: Decision
    shared: Ints
    hides: Mask
    free: Mask


def at_once(problem: Problem, rule: Associator, trust: Trust, confirmed: Mask, claim: Claim | None) -> Association:
    """Confirmed tracks (T,) choose first, then those on shared blobs claim them, then tentative tracks choose,
    which share nothing whatever the rule.

    claim  given what each track took (T,), who leans on which blob (T,) and which blobs (M,) hide more; None where
           blobs are not shared
    """
    pairs, rows, count = problem.pairs, problem.rows, problem.measurements
    sure = trust.sure(problem.scan)
    decision = trust.decide(rule, problem, confirmed, sure)
    if claim is None:
        shared, hides = np.full(rows, -1), np.ones(count, bool)
    else:
        shared, hides = claim(heaviest(decision))
        decision = decision.without(shared >= 0)
    free = hides & ~_claimed(decision, count) & sure
    open_to_all = free[pairs.measurement] & ~confirmed[pairs.row]
    if np.count_nonzero(open_to_all):
        second = _starter(rule).decide(problem.only(open_to_all))
        free &= ~_claimed(second, count)
        decision = decision.joined(second)
    if not rule.gated_births:
        free[pairs.measurement] = False
    return Association(problem, decision, shared, hides, distinct(problem.scan, free))


def deferred(
    problem: Problem, forest: Forest, trust: Trust, births: bool, register: Register, events: list[Event]
) -> Association:
    """Rows become their successors in a forest, and so do the register's; no blob is shared."""
    pairs, sure = problem.pairs, trust.sure(problem.scan)
    log_l = pairs.log_l + np.where(sure, 0.0, np.log(UNSURE))[pairs.measurement]
    problem = replace(problem, pairs=replace(pairs, log_l=log_l))
    problem, decision, born = forest.grow(problem, register, distinct(problem.scan, sure & births), events)
    return Association(problem, decision, np.full(problem.rows, -1), sure, born)


def _starter(rule: Associator) -> Associator:
    """The rule of tentative tracks: whole measurements, or clutter would never let go of them."""
    return rule if isinstance(rule, HARD) else GNN()


def _claimed(decision: Decision, measurements: int) -> Mask:
    """(M,) measurements that tracks claim."""
    return np.bincount(decision.measurement, decision.beta, measurements) > CLAIMED
