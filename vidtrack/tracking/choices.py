"""What a scan decided, in the tracks' own order: for the snapshot and for `--decisions`."""

from __future__ import annotations

import numpy as np

from vidtrack.associate.gate import Pairs
from vidtrack.associate.problem import Problem
from vidtrack.scan import Choices, Decision, Floats, Ints


def heaviest(decision: Decision) -> Ints:
    """(K,) measurement of the largest weight in each row, -1 where a miss is likelier than not."""
    best = np.full(len(decision.parent), -1)
    order = np.argsort(decision.beta, kind="stable")
    best[decision.row[order]] = decision.measurement[order]
    best[decision.beta0 >= 0.5] = -1
    return best


def evidence(problem: Problem, decision: Decision, taken: Ints) -> Floats:
    """(T,) log-likelihood ratio, target against none, of what each row got.

    A row with one measurement for certain: P_D N / clutter of that one. A shared-out row: the PDA's normaliser
    1 - P_D P_G + sum of P_D N / clutter, which is what any of its choices weighs over its share; here the miss where
    nothing was `taken` (T,), else that measurement.
    """
    none = taken < 0
    ratio = problem.log_missed - np.log(np.where(none, decision.beta0, 1.0))
    share = np.ones(problem.rows)
    of_taken = decision.measurement == taken[decision.row]
    share[decision.row[of_taken]] = decision.beta[of_taken]
    pairs = problem.pairs
    chosen = pairs.measurement == taken[pairs.row]
    ratio[pairs.row[chosen]] = problem.log_ratio[chosen]
    return ratio - np.log(share)


def innovations(pairs: Pairs, taken: Ints) -> Floats:
    """(T,) normalised innovation squared of the chosen pairs, NaN without one."""
    nis = np.full(len(taken), np.nan)
    chosen = pairs.measurement == taken[pairs.row]
    nis[pairs.row[chosen]] = pairs.nis[chosen]
    return nis


def choices(ids: Ints, pairs: Pairs, decision: Decision, taken: Ints) -> Choices:
    """Who was chosen, how far it was, and who came second."""
    rows = len(ids)
    weight, runner, runner_d2 = np.zeros(rows), np.full(rows, -1), np.full(rows, np.nan)
    np.maximum.at(weight, decision.row, decision.beta)
    chosen = pairs.measurement == taken[pairs.row]
    d2 = np.full(rows, np.nan)
    d2[pairs.row[chosen]] = pairs.d2[chosen]
    others = np.flatnonzero(~chosen)
    order = others[np.argsort(-pairs.d2[others], kind="stable")]
    runner[pairs.row[order]] = pairs.measurement[order]
    runner_d2[pairs.row[order]] = pairs.d2[order]
    return Choices(ids.copy(), taken.copy(), weight, d2, pairs.limit.copy(), runner, runner_d2)
