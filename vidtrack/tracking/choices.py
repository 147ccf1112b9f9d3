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


def evidence(problem: Problem, decision: Decision) -> Floats:
    """(T,) log-likelihood ratio, target against none, of what each row got.

    A shared-out row: 1 - P_D P_G + sum of P_D N / clutter = (1 - P_D P_G) / beta0, the PDA's normaliser. A row
    with one measurement for certain: P_D N / clutter of that one.
    """
    with np.errstate(divide="ignore"):
        ratio = np.log(problem.missed) - np.log(decision.beta0)
    sure = np.flatnonzero(decision.beta == 1.0)
    taken = np.full(problem.rows, -1)
    taken[decision.row[sure]] = decision.measurement[sure]
    pairs = problem.pairs
    chosen = pairs.measurement == taken[pairs.row]
    ratio[pairs.row[chosen]] = problem.log_ratio[chosen]
    return np.nan_to_num(ratio, nan=0.0)


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
