"""Inflation of the covariance by a miss: the target may have been detected outside the gate."""

from __future__ import annotations

import numpy as np
from scipy.special import gammainc, gammaincinv

from vidtrack.arrays.types import Floats
from vidtrack.associate.problem import Problem


def widening(problem: Problem, seen: Floats) -> Floats:
    """(T,) factor X (1 - c1) / (1 - X) of K S K', with X = `seen` the probability that the target is in the gate.

    c1 S is the covariance of the innovations within the gate; c1 = P(chi2 of m + 2 < g^2) / P_G (SPEC 000,
    correction 8, where X = P_D P_G; SPEC 002, kappa).
    """
    half = problem.cov.shape[1] / 2
    c1 = np.ones(problem.rows)
    gated = problem.inside > 0
    inside = problem.inside[gated]
    c1[gated] = gammainc(half + 1, gammaincinv(half, inside)) / inside
    lost = seen * (1 - c1)
    return np.divide(lost, 1 - seen, out=np.zeros(problem.rows), where=lost > 0)
