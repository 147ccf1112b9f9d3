"""Association problems for tests, and joint events listed one by one."""

from __future__ import annotations

import numpy as np

from vidtrack.associate.gate import Gate
from vidtrack.associate.problem import Problem
from vidtrack.scan import Scan


def random_problem(rng, rows, count, *, gate=0.99, spread=2.0, detection=None, clutter=None, amplitude=False):
    """A problem with `rows` tracks and `count` measurements about one point; P_D and clutter drawn row by row."""
    axes = rng.normal(size=(rows, 2, 2))
    cov = 0.2 * np.eye(2) + axes @ np.swapaxes(axes, 1, 2) / 2
    scan = Scan(
        0.0,
        spread * rng.normal(size=(count, 2)),
        0.3 * np.eye(2),
        amplitude=1 + rng.exponential(4.0, count) if amplitude else None,
    )
    return Problem.gated(
        Gate(gate),
        spread * rng.normal(size=(rows, 2)),
        cov,
        scan,
        rng.uniform(0.2, 0.99, rows) if detection is None else detection,
        10 ** rng.uniform(-3, 0, rows) if clutter is None else clutter,
    )


def table(problem, decision):
    """(T, 1 + M) weights, those of a miss in front."""
    weights = np.zeros((problem.rows, 1 + problem.measurements))
    weights[:, 0] = decision.beta0
    np.add.at(weights, (decision.row, 1 + decision.measurement), decision.beta)
    return weights


def factors(problem):
    """(T, M) P_D N / clutter density, zero outside the gate."""
    pairs = problem.pairs
    dense = np.zeros((problem.rows, problem.measurements))
    dense[pairs.row, pairs.measurement] = np.exp(
        np.log(problem.detection[pairs.row]) + pairs.log_l - np.log(problem.clutter[pairs.row])
    )
    return dense


def joint_events(factor, miss):
    """All (weight, event) with event[t] the measurement of track t, -1 for none."""
    events = [(1.0, ())]
    for t in range(len(factor)):
        longer = [(weight * miss[t], (*event, -1)) for weight, event in events]
        for weight, event in events:
            longer += [(weight * factor[t, j], (*event, j)) for j in np.flatnonzero(factor[t]) if j not in event]
        events = longer
    return events


def likeliest_only(events):
    """Of the events that detect the same tracks by the same measurements, the one of most weight."""
    best = {}
    for weight, event in events:
        key = tuple(j < 0 for j in event), frozenset(event)
        if key not in best or weight > best[key][0]:
            best[key] = weight, event
    return list(best.values())


def marginals(events, rows, count):
    """(T, 1 + M) sums of the events' weights over what they say of each track, normalised."""
    weights = np.zeros((rows, 1 + count))
    for weight, event in events:
        weights[np.arange(rows), np.asarray(event, int) + 1] += weight
    return weights / sum(weight for weight, _ in events)
