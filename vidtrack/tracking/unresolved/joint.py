"""The joint state of targets that share a measurement: positions and velocities of all, with their correlations.

S. S. Blackman, R. Popoli, "Design and Analysis of Modern Tracking Systems", Artech House 1999, section 6.15;
K.-C. Chang, Y. Bar-Shalom, "Joint probabilistic data association for multitarget tracking with possibly unresolved
measurements and maneuvers", IEEE Trans. Automatic Control 29(7), 1984.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, solve_triangular
from scipy.special import expit, ndtr

from vidtrack.arrays.types import Floats

LEAST_INSIDE = 1e-6
"""Probability of an interval below which its condition is left out: the moments would be of rounding errors."""
LEAST_INFORMATION = 1e-9
"""Smallest share of the prior information that an equivalent measurement has in any direction."""


class Joint(NamedTuple):
    """Mean (k s,) and covariance (k s, k s) of k targets with states [x, vx, y, vy, ...] of s = 2 dim components."""

    x: Floats
    P: Floats
    dim: int

    @property
    def targets(self) -> int:
        """k."""
        return len(self.x) // (2 * self.dim)

    @property
    def middle(self) -> Floats:
        """(dim,) mean of the positions."""
        return np.asarray(self.x.reshape(self.targets, -1)[:, ::2].mean(axis=0))

    def selection(self, weight: Floats) -> Floats:
        """(dim, k s) matrix of the weighted sum of the positions, weight (k,)."""
        axis = np.arange(self.dim)
        matrix = np.zeros((self.dim, len(weight), 2 * self.dim))
        matrix[axis, :, 2 * axis] = weight
        return matrix.reshape(self.dim, -1)

    def difference(self, i: int, j: int) -> Floats:
        """(dim, k s) matrix of the position of target i relative to target j."""
        weight = np.zeros(self.targets)
        weight[[i, j]] = 1.0, -1.0
        return self.selection(weight)

    def within(self, h: Floats, limit: float) -> Joint:
        """The moments given that |h x| < limit, h (k s,).

        It is no measurement, whose information would add up: once it is met, repeating it changes little.
        """
        mean, variance = float(h @ self.x), float(h @ self.P @ h)
        low, high = (-limit - mean) / np.sqrt(variance), (limit - mean) / np.sqrt(variance)
        inside = ndtr(high) - ndtr(low)
        if inside < LEAST_INSIDE:
            return self
        at_low, at_high = _density(low), _density(high)
        shift = (at_low - at_high) / inside
        share = 1 + (low * at_low - high * at_high) / inside - shift**2
        gain = self.P @ h / np.sqrt(variance)
        return self._replace(x=self.x + gain * shift, P=self.P - (1 - share) * np.outer(gain, gain))

    def measured(self) -> tuple[Floats, Floats]:
        """H (dim, k s) and the covariance (dim, dim) of a shared measurement of these targets without its error R.

        The measurement is at the centre of power of the echoes. Echoes of Swerling I targets of the same mean power
        have shares that are uniform over all shares with sum one: the mean is the middle of the targets, and the
        covariance is their scatter about the middle over k + 1.
        """
        k = self.targets
        H = self.selection(np.full(k, 1 / k))
        cov = H @ self.P @ H.T
        for i in range(k):
            off = self.selection(np.eye(k)[i]) - H
            cov = cov + (np.outer(off @ self.x, off @ self.x) + off @ self.P @ off.T) / (k * (k + 1))
        return H, cov

    def log_likelihood(self, z: Floats, R: Floats) -> Floats:
        """(M,) ln of the density of shared measurements z (M, dim), R (M, dim, dim)."""
        H, cov = self.measured()
        S, v = cov + R, z - H @ self.x
        d2 = np.einsum("mi,mi->m", v, np.linalg.solve(S, v[..., None])[..., 0])
        return np.asarray(-0.5 * (d2 + np.linalg.slogdet(S)[1] + self.dim * np.log(2 * np.pi)))

    def updated(self, z: Floats, R: Floats) -> Joint:
        """The moments after the shared measurement z (dim,), R (dim, dim)."""
        H, cov = self.measured()
        L = np.linalg.cholesky(cov + R)
        K = solve_triangular(L, H @ self.P, lower=True)
        v = solve_triangular(L, z - H @ self.x, lower=True)
        return self._replace(x=self.x + K.T @ v, P=self.P - K.T @ K)


def equivalent(x: Floats, P: Floats, x1: Floats, P1: Floats) -> tuple[Floats, Floats]:
    """The measurement z, R of a state itself that makes x1, P1 of x, P: R^-1 = P1^-1 - P^-1. All (s,), (s, s).

    P1 must not exceed P. Directions without information get LEAST_INFORMATION.
    """
    L = np.linalg.cholesky(P)
    left = solve_triangular(L, P1, lower=True)
    kept, axes = np.linalg.eigh(solve_triangular(L, left.T, lower=True))
    gained = np.maximum(1 - kept, LEAST_INFORMATION)
    kept = np.maximum(kept, LEAST_INFORMATION)
    root = L @ axes
    shift = axes.T @ solve_triangular(L, x1 - x, lower=True)
    return x + root @ (shift / gained), (root * (kept / gained)) @ root.T


def exchange_probability(joint: Joint, z: Floats, R: Floats) -> float:
    """Probability that z (2, dim), R (2, dim, dim), assigned to two targets in this order, are theirs in the other one.

    A measurement of NaN is none.
    """
    log_l = []
    for order in ([0, 1], [1, 0]):
        there = np.isfinite(z[:, 0])
        H = np.concatenate([joint.selection(np.eye(2)[k]) for k in np.array(order)[there]])
        v = (z[there]).ravel() - H @ joint.x
        S = H @ joint.P @ H.T + block_diag(*R[there])
        log_l.append(-0.5 * (v @ np.linalg.solve(S, v) + np.linalg.slogdet(S)[1]))
    return float(expit(log_l[1] - log_l[0]))


def _density(u: float) -> float:
    """Standard normal density."""
    return float(np.exp(-(u**2) / 2) / np.sqrt(2 * np.pi))
