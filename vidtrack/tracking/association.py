"""Association of one scan: from gated pairs to a decision, and to the measurements that may start tracks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vidtrack.associate.hard import GNN, HARD, Associator
from vidtrack.associate.problem import Problem
from vidtrack.associate.trust import Trust
from vidtrack.scan import Decision, Event, Ints, Mask
from vidtrack.tracking.births import distinct
from vidtrack.tracking.choices import heaviest
from vidtrack.tracking.forest import Forest
from vidtrack.tracking.register import Register

CLAIMED = 0.1
"""A measurement whose weights over all tracks sum to more than this starts no track."""
UNSURE = 0.01
"""Factor on the likelihood of a detection with a low score where decisions wait: more of these are false."""

Claim = Callable[[Ints], tuple[Ints, Mask]]
Catch = Callable[[Mask, Mask], Ints]


class Association(NamedTuple):
    """The outcome of a scan's association.

    problem   the scan's problem as the K successors of the rows see it
    decision  how the successors come from the rows
    shared    (K,) blob whose edges update each successor; -1: none
    hides     (M,) blobs that are larger than their tracks account for
    free      (M,) measurements that may start a track
    """

    problem: Problem
    decision: Decision
    shared: Ints
    hides: Mask
    free: Mask


def at_once(
    problem: Problem, rule: Associator, trust: Trust, confirmed: Mask, claim: Claim | None, catch: Catch | None
) -> Association:
    """Decide in this scan: confirmed tracks (T,) first, then the sharing of blobs, then tentative tracks.

    claim  maps the measurement of each track (T,) to the shared blob of each (T,) and the blobs (M,) that hide more;
           None where blobs are not shared
    catch  maps tracks (T,) that got nothing and blobs (M,) that nobody took to the blob of each track, -1 for none
    """
    pairs, rows, count = problem.pairs, problem.rows, problem.measurements
    sure = trust.sure(problem.scan)
    decision = trust.decide(rule, problem, confirmed, sure)
    if claim is None:
        shared, hides = np.full(rows, -1), np.ones(count, bool)
    else:
        shared, hides = claim(heaviest(decision))
        decision = decision.without(shared >= 0)
    free = hides & ~_claimed(decision, count)
    open_to_all = free[pairs.measurement] & ~confirmed[pairs.row]
    if np.count_nonzero(open_to_all):
        second = trust.decide(_starter(rule), problem.only(open_to_all), ~confirmed, sure)
        free &= ~_claimed(second, count)
        decision = decision.joined(second)
    if catch is not None:
        untaken = free & (np.bincount(shared[shared >= 0], minlength=count) == 0)
        caught = catch((heaviest(decision) < 0) & (shared < 0), untaken)
        shared = np.where(caught >= 0, caught, shared)
        free[caught[caught >= 0]] = False
    free &= sure
    if not rule.gated_births:
        free[pairs.measurement] = False
    return Association(problem, decision, shared, hides, distinct(problem.scan, free))


def deferred(
    problem: Problem, forest: Forest, trust: Trust, births: bool, register: Register, events: list[Event]
) -> Association:
    """Grow the forest, which decides scans later; the register's rows become their successors. No blob is shared."""
    pairs, sure = problem.pairs, trust.sure(problem.scan)
    log_l = pairs.log_l + np.where(sure, 0.0, np.log(UNSURE))[pairs.measurement]
    problem = replace(problem, pairs=replace(pairs, log_l=log_l))
    problem, decision, born = forest.grow(problem, register, distinct(problem.scan, sure & births), events)
    return Association(problem, decision, np.full(problem.rows, -1), sure, born)


def _starter(rule: Associator) -> Associator:
    """The rule for tentative tracks: whole measurements, because weights of clutter would keep them alive for ever."""
    return rule if isinstance(rule, HARD) else GNN()


def _claimed(decision: Decision, measurements: int) -> Mask:
    """(M,) measurements that tracks claim."""
    return np.bincount(decision.measurement, decision.beta, measurements) > CLAIMED
