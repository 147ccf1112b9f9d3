"""What a scan decided, in the tracks' own order: for the snapshot and for `--decisions`."""

from __future__ import annotations

import numpy as np
from numba import njit

from vidtrack.associate.gate import Pairs
from vidtrack.associate.problem import Problem
from vidtrack.compiled import CACHE
from vidtrack.scan import Choices, Decision, Floats, Ints


def heaviest(decision: Decision) -> Ints:
    """(K,) measurement of the largest weight in each row, -1 where a miss is likelier than not."""
    return _heaviest(decision.row, decision.measurement, decision.beta, decision.beta0)


def evidence(problem: Problem, decision: Decision, taken: Ints) -> tuple[Floats, Floats]:
    """What each row got: its log-likelihood ratio (T,), target against none, and nis (T,), NaN where that is nothing.

    A row with one measurement for certain: P_D N / clutter of that one. A shared-out row: the PDA's normaliser
    1 - P_D P_G + sum of P_D N / clutter, which is what any of its choices weighs over its share; here the miss where
    nothing was `taken` (T,), else that measurement.
    """
    pairs = problem.pairs
    ratio, share, nis = _of_taken(
        taken, pairs.row, pairs.measurement, pairs.nis, problem.log_ratio, problem.log_missed,
        decision.row, decision.measurement, decision.beta, decision.beta0,
    )  # fmt: skip
    return ratio - np.log(share), nis


@njit(cache=CACHE, nogil=True)
def _heaviest(row: Ints, measurement: Ints, beta: Floats, beta0: Floats) -> Ints:
    best, most = np.full(len(beta0), -1), np.zeros(len(beta0))
    for b in range(len(row)):
        if beta[b] >= most[row[b]] and beta0[row[b]] < 0.5:
            best[row[b]], most[row[b]] = measurement[b], beta[b]
    return best


@njit(cache=CACHE, nogil=True)
def _of_taken(
    taken: Ints, row: Ints, measurement: Ints, pair_nis: Floats, log_ratio: Floats, log_missed: Floats,
    chooser: Ints, choice: Ints, beta: Floats, beta0: Floats,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """(T,) log-likelihood ratio, share and nis of what each row took; the pairs and then the weights are in rows."""
    ratio, share, nis = log_missed.copy(), np.where(taken < 0, beta0, 1.0), np.full(len(taken), np.nan)
    for k in range(len(row)):
        if measurement[k] == taken[row[k]]:
            ratio[row[k]], nis[row[k]] = log_ratio[k], pair_nis[k]
    for b in range(len(chooser)):
        if choice[b] == taken[chooser[b]]:
            share[chooser[b]] = beta[b]
    return ratio, share, nis


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
