"""Which tracks share a measurement: the likelier of one measurement for two targets and one for each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.problem import VANISHING, Problem
from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.kernels import TURN
from vidtrack.estimate.sensor import POSITION, Sensor, still
from vidtrack.tracking.unresolved.cell import SIZES, TINY, PolarCell
from vidtrack.tracking.unresolved.correlations import Correlations
from vidtrack.tracking.unresolved.joint import Joint

LEAST = 1e-3
"""Probability of being unresolved below which two tracks are left to the association."""
SURE = 0.1
"""Probability of one measurement for two targets from which they share it: a wrong claim costs little accuracy for one
scan, but a claim that is not made may cost a track."""
REACH = 3.0
"""Standard deviations of the positions within which two tracks may be near to each other."""


class Placed(NamedTuple):
    """A scan's measurements as positions, and the rows' predictions for their times.

    z (M, d), R (M, d, d); x (T, s), P (T, s, s) of [x, vx, y, vy, ...]
    """

    z: Floats
    R: Floats
    x: Floats
    P: Floats

    @classmethod
    def of(cls, problem: Problem, bank: Estimator) -> Placed:
        """The measurements of a problem and the rows of a bank."""
        scan, s = problem.scan, 2 * bank.model.dim
        sensor: Sensor = scan.sensor or POSITION
        resting = still(sensor)
        z, R = resting.locate(scan.z, scan.R)
        x, P = bank.x[:, :s].copy(), bank.P[:, :s, :s]
        if resting is not sensor and len(scan):
            zhat, _ = bank.predicted_measurement(sensor)
            x[:, ::2] = resting.locate(zhat, np.repeat(scan.R.mean(axis=0)[None], len(x), axis=0))[0]
        return cls(z, R, x, P)


def claims(
    problem: Problem, rows: Ints, ids: Ints, run: Ints, placed: Placed, correlations: Correlations, cell: PolarCell
) -> tuple[Ints, Ints]:
    """(T,) the measurement that each of these rows shares with others; -1: none. The cell learns its size.

    Also the pairs (Q, 2) of rows that may be unresolved. ids (T,), run (T,) of all rows. Of overlapping claims the
    likeliest are taken.
    """
    shared = np.full(problem.rows, -1)
    offers, near = [], []
    for i, j in close_pairs(rows, run, placed, cell) if problem.measurements else ():
        pair = np.array([i, j])
        joint = correlations.joint(ids[pair], placed.x[pair], placed.P[pair])
        R = placed.R[np.linalg.norm(placed.z - joint.middle, axis=1).argmin()]
        p_by_size = cell.shared(joint, 0, 1, R, SIZES)
        p = min(float(cell.probability @ p_by_size), 1 - TINY)
        if p < LEAST:
            continue
        near.append((i, j))
        one = log_one(problem, i, placed, cell.confined(joint, R))
        log_odds = float(np.logaddexp.reduce(one)) - _two(problem, i, j)
        if not correlations.has(ids[pair]):  # of targets that were resolved just before, the distance is known
            cell.learn(p_by_size, log_odds)
        offers.append((np.log(p) - np.log1p(-p) + log_odds, i, j, int(one.argmax())))
    for log_odds, i, j, a in sorted(offers, reverse=True):
        if log_odds > np.log(SURE / (1 - SURE)) and shared[i] in (-1, a) and shared[j] in (-1, a):
            shared[[i, j]] = a
    return shared, np.array(near, np.int64).reshape(-1, 2)


def close_pairs(rows: Ints, run: Ints, placed: Placed, cell: PolarCell) -> Ints:
    """(C, 2) pairs of these rows, of one run, that may be nearer to each other than a cell."""
    from scipy.spatial import KDTree

    if len(rows) < 2:
        return np.empty((0, 2), np.int64)
    xy = placed.x[rows][:, ::2]
    spread = np.sqrt(np.trace(placed.P[rows][:, ::2, ::2], axis1=1, axis2=2))
    reach = REACH * spread + cell.reach(xy, placed.R) / 2
    near = KDTree(xy).query_pairs(2 * float(reach.max()), output_type="ndarray")
    apart = np.linalg.norm(xy[near[:, 0]] - xy[near[:, 1]], axis=1)
    pairs = rows[near[apart < reach[near].sum(axis=1)]]
    return np.asarray(pairs[run[pairs[:, 0]] == run[pairs[:, 1]]])


def _gated(problem: Problem, row: int) -> tuple[Ints, Floats]:
    """The measurements in a row's gate, and ln(P_D N / clutter density) of each."""
    own = slice(problem.pairs.start[row], problem.pairs.start[row + 1])
    return problem.pairs.measurement[own], problem.log_ratio[own]


def _two(problem: Problem, i: int, j: int) -> float:
    """ln of the sum over the events in which each of two targets gives its own measurement or none."""
    (a, ratio_i), (b, ratio_j) = _gated(problem, i), _gated(problem, j)
    both = np.where(a[:, None] == b, -np.inf, ratio_i[:, None] + ratio_j)
    miss_i, miss_j = problem.log_missed[[i, j]]
    return float(
        np.logaddexp.reduce(np.concatenate([[miss_i + miss_j], ratio_i + miss_j, ratio_j + miss_i, both.ravel()]))
    )


def log_one(problem: Problem, row: int, placed: Placed, joint: Joint) -> Floats:
    """(M,) ln of the same for each measurement as one of both targets; two echoes are missed if each of them is.

    The density of positions becomes that of the sensor's measurements by the ratio of the errors' volumes; other
    components, such as a range rate, count as if they were off by no more than their error.
    """
    seen, more = problem.detection[row], problem.scan.z.shape[1] - joint.dim
    volume = 0.5 * (np.linalg.slogdet(placed.R)[1] - np.linalg.slogdet(problem.scan.R)[1] - more * np.log(TURN))
    with np.errstate(divide="ignore"):
        log_ratio = np.log(seen * (2 - seen)) - np.maximum(np.log(problem.clutter[row]), -VANISHING)
    return log_ratio + volume + joint.log_likelihood(placed.z, placed.R)
