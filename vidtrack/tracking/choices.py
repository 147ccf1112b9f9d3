"""The decisions of a scan by row, for the snapshot and for `--decisions`."""

from __future__ import annotations

import math

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.gate import Pairs
from vidtrack.associate.problem import Problem, logs
from vidtrack.compiled import kernel
from vidtrack.decision import Choices, Decision

LISTED = 10
"""Largest number of candidates listed for each track and scan."""


def heaviest(decision: Decision) -> Ints:
    """(K,) measurement of the largest weight in each row, -1 where a miss is likelier than not."""
    return _heaviest(decision.row, decision.measurement, decision.beta, decision.beta0)


def evidence(problem: Problem, decision: Decision, taken: Ints) -> tuple[Floats, Floats]:
    """Log-likelihood ratio (T,) of each row, target against none, and NIS (T,), NaN for a miss.

    A row with one certain measurement has the ratio P_D N / clutter of that one. A row with weights has the PDA's
    normaliser 1 - P_D P_G + sum of P_D N / clutter, which is the ratio of any one of its choices over the weight of
    that choice; the choice used is the measurement `taken` (T,), or the miss where that is -1.
    """
    pairs = problem.pairs
    return _of_taken(
        taken, pairs.row, pairs.measurement, pairs.nis, pairs.log_l, problem.detection, problem.inside, problem.clutter,
        decision.row, decision.measurement, decision.beta, decision.beta0,
    )  # fmt: skip


@kernel
def _heaviest(row: Ints, measurement: Ints, beta: Floats, beta0: Floats) -> Ints:
    best, most = np.full(len(beta0), -1), np.zeros(len(beta0))
    for b in range(len(row)):
        if beta[b] >= most[row[b]] and beta0[row[b]] < 0.5:
            best[row[b]], most[row[b]] = measurement[b], beta[b]
    return best


@kernel
def _of_taken(
    taken: Ints, row: Ints, measurement: Ints, pair_nis: Floats, log_l: Floats,
    detection: Floats, inside: Floats, clutter: Floats,
    chooser: Ints, choice: Ints, beta: Floats, beta0: Floats,
) -> tuple[Floats, Floats]:  # fmt: skip
    """(T,) log-likelihood ratio and NIS of the measurement taken by each row; pairs and weights in row order."""
    ratio, log_ratio = logs(detection, inside, clutter, row, log_l)
    share, nis = np.ones(len(taken)), np.full(len(taken), np.nan)
    for t in range(len(taken)):
        if taken[t] < 0:
            share[t] = beta0[t]
    for k in range(len(row)):
        if measurement[k] == taken[row[k]]:
            ratio[row[k]], nis[row[k]] = log_ratio[k], pair_nis[k]
    for b in range(len(chooser)):
        if choice[b] == taken[chooser[b]]:
            share[chooser[b]] = beta[b]
    for t in range(len(taken)):
        ratio[t] -= math.log(share[t])
    return ratio, nis


def choices(ids: Ints, pairs: Pairs, decision: Decision, taken: Ints) -> Choices:
    """The measurement chosen by each track, its weight and distance, the runner-up, and the LISTED heaviest."""
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
    candidates = _candidates(pairs, _weight(pairs, decision), rows)
    return Choices(ids.copy(), taken.copy(), weight, d2, pairs.limit.copy(), runner, runner_d2, *candidates)


def _weight(pairs: Pairs, decision: Decision) -> Floats:
    """(N,) weight of each pair; zero for pairs without a weight in the decision."""
    count = 1 + int(pairs.measurement.max(initial=0))
    name = pairs.row * count + pairs.measurement  # ascending
    weight = np.zeros(len(pairs))
    weight[np.searchsorted(name, decision.row * count + decision.measurement)] = decision.beta
    return weight


def _candidates(pairs: Pairs, weight: Floats, rows: int) -> tuple[Ints, Floats, Floats]:
    """(T, LISTED) measurements, weights and d2 of each row's pairs, the heaviest first, of equals the nearest."""
    order = np.lexsort((pairs.d2, -weight, pairs.row))
    place = np.arange(len(order)) - pairs.start[pairs.row]
    listed = place < LISTED
    cell, pair = (pairs.row[listed], place[listed]), order[listed]
    measurement = np.full((rows, LISTED), -1)
    share, d2 = np.full((2, rows, LISTED), np.nan)
    measurement[cell], share[cell], d2[cell] = pairs.measurement[pair], weight[pair], pairs.d2[pair]
    return measurement, share, d2
