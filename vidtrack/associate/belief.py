"""Loopy belief propagation, for clusters with too many joint events to sum (Williams and Lau 2014)."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.events import Side
from vidtrack.compiled import kernel

CONVERGED = 1e-9
"""The iteration stops when no message changes by more than this, relative to its value."""
ITERATIONS, MESSAGES = 1000, 10**7
"""Limits for a cluster: iterations, and messages in all; hundreds of tracks that share gates converge slowly."""
LEAST = 1e-100
"""Lower limit of all factors, so that messages stay finite."""


@kernel
def propagate(
    tracks: Ints, measurements: Ints, rows: Side, columns: Side, factor: Floats, share: Floats, row_share: Floats
) -> None:
    """Write approximate probabilities of a cluster's pairs to `share`, and of its misses to `row_share`.

    Iterates mu = w / (miss + sum of w nu over the track's other measurements) and nu = 1 / (unused + sum of mu over
    the measurement's other tracks). The fixed point is unique.
    """
    degree = 0
    for t in tracks:
        degree = max(degree, rows.start[t + 1] - rows.start[t])
    for j in measurements:
        degree = max(degree, columns.start[j + 1] - columns.start[j])
    value, rest = np.empty(degree), np.empty(degree)
    to_track, to_measurement = share, np.empty_like(share)
    for t in tracks:
        to_track[rows.start[t] : rows.start[t + 1]] = 1.0
    pairs = 0
    for t in tracks:
        pairs += rows.start[t + 1] - rows.start[t]
    for _ in range(min(ITERATIONS, 1 + MESSAGES // pairs)):
        change = 0.0
        for t in tracks:
            first, n = rows.start[t], rows.start[t + 1] - rows.start[t]
            for e in range(n):
                value[e] = max(factor[first + e], LEAST) * to_track[first + e]
            _others(value, n, max(rows.alone[t], LEAST), rest)
            for e in range(n):
                to_measurement[first + e] = max(factor[first + e], LEAST) / rest[e]
        for j in measurements:
            first, n = columns.start[j], columns.start[j + 1] - columns.start[j]
            for e in range(n):
                value[e] = to_measurement[columns.pair[first + e]]
            _others(value, n, max(columns.alone[j], LEAST), rest)
            for e in range(n):
                k = columns.pair[first + e]
                change = max(change, abs(to_track[k] * rest[e] - 1.0))
                to_track[k] = 1.0 / rest[e]
        if change < CONVERGED:
            break
    for t in tracks:
        mine = slice(rows.start[t], rows.start[t + 1])
        total = row_share[t] = max(rows.alone[t], LEAST)
        for k in range(rows.start[t], rows.start[t + 1]):
            share[k] *= max(factor[k], LEAST)
            total += share[k]
        share[mine] /= total
        row_share[t] /= total
    for j in measurements:  # before convergence the weights of a measurement can sum to more than one
        of_one = columns.pair[columns.start[j] : columns.start[j + 1]]
        total = share[of_one].sum()
        if total > 1.0:
            for e in range(columns.start[j], columns.start[j + 1]):
                k = columns.pair[e]
                row_share[columns.other[e]] += share[k] * (1.0 - 1.0 / total)
                share[k] /= total


@kernel
def _others(value: Floats, n: int, base: float, rest: Floats) -> None:
    """rest[e] = base + the sum of the first n values except the e-th, without a subtraction (no cancellation)."""
    total = base
    for e in range(n):
        rest[e] = total
        total += value[e]
    total = 0.0
    for e in range(n - 1, -1, -1):
        rest[e] += total
        total += value[e]
