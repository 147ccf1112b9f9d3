"""Compiled steps of particle filters, over rows of N particles.

The numbers of components are compile-time constants, as in `kernels`. Blocks of rows may run in threads.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import kernel, specialised
from vidtrack.estimate.kernels import TURN
from vidtrack.estimate.resampling import choose
from vidtrack.estimate.stream import normal

Kernel = Callable[..., None]

FARTHEST = 1e12
"""Upper limit of half the squared distance in standard deviations; logarithms stay exact below it."""

NOTHING = -300.0
"""Logarithm below which weights are zero: negligible against the largest, and denormal numbers are slow."""


@lru_cache
def move(n: int) -> Kernel:
    """x <- F x + L xi in place, with L L' = Q and xi standard normal.

    x (T, N, n), F (T, N, n, n), Q (T, n, n), stream (T,) counts. Q may be singular: rank(Q) numbers are drawn for each
    particle.
    """

    def move(x: Floats, F: Floats, Q: Floats, stream: Ints) -> None:
        L, moved = np.zeros((n, n)), np.empty(n)
        for t in range(len(x)):
            count = stream[t]
            rank = _root(Q[t], L)
            for i in range(x.shape[1]):
                for a in range(n):
                    total = 0.0
                    for b in range(n):
                        total += F[t, i, a, b] * x[t, i, b]
                    moved[a] = total
                for c in range(rank):
                    xi, count = normal(count)
                    for a in range(n):
                        moved[a] += L[a, c] * xi
                for a in range(n):
                    x[t, i, a] = moved[a]

    return specialised(move, n)


@lru_cache
def weigh(m: int, angles: tuple[int, ...] = ()) -> Kernel:
    """Weights of successors' particles: Bayes' rule with each measurement, mixed by the decision's weights.

    w_i = beta0 w_i + sum over j of beta_j w_i N(z_j; h(x_i), R_j) / sum over i of the same; without `spread` the
    measurements act as one, w_i ~ w_i prod over j of N(z_j; h(x_i), R_j)^beta_j. Sums are scaled by their largest
    term. Each component of the whitened innovation is, independently, `factor` times as large with probability `glint`.

    log_weight (T, N), seen (T, N, m) = h(x), z (M, m), R (M, m, m), and of the decision parent (K,), start (K + 1,),
    measurement (B,), beta (B,), beta0 (K,), spread -> weight (K, N), summing to one, and log_new (K, N).
    """
    wraps = tuple(a in angles for a in range(m))

    def weigh(
        log_weight: Floats, seen: Floats, z: Floats, R: Floats,
        parent: Ints, start: Ints, measurement: Ints, beta: Floats, beta0: Floats, spread: bool,
        glint: float, factor: float, weight: Floats, log_new: Floats,
    ) -> None:  # fmt: skip
        number = log_weight.shape[1]
        v, L, joint, posterior = np.empty(m), np.zeros((m, m)), np.empty(number), np.empty(number)
        for k in range(len(parent)):
            t = parent[k]
            pairs = start[k + 1] - start[k]
            as_one = not spread or pairs == 0 or (pairs == 1 and beta0[k] == 0.0)
            joint[:] = log_weight[t]
            if not as_one:
                normalise(joint, posterior)
                weight[k] = beta0[k] * posterior
            for b in range(start[k], start[k + 1]):
                j = measurement[b]
                _root(R[j], L)
                power = beta[b] if as_one else 1.0
                if not as_one:
                    joint[:] = log_weight[t]
                for i in range(number):
                    likelihood = 0.0
                    for a in range(m):  # v whitened: L v = z - h(x)
                        total = z[j, a] - seen[t, i, a]
                        if wraps[a]:
                            total -= TURN * np.rint(total / TURN)
                        for c in range(a):
                            total -= L[a, c] * v[c]
                        v[a] = total / L[a, a]
                        likelihood += _log_density(v[a], glint, factor)
                    joint[i] += power * likelihood
                if not as_one:
                    normalise(joint, posterior)
                    for i in range(number):
                        weight[k, i] += beta[b] * posterior[i]
            if as_one:
                normalise(joint, weight[k])
                log_new[k] = joint
            else:
                log_new[k] = np.log(weight[k])

    return specialised(weigh, m, *angles)


@lru_cache
def moments(n: int) -> Kernel:
    """Mean (K, n) and covariance (K, n, n) of particles x (T, N, n) with weight (K, N); row k uses x[parent[k]]."""

    def moments(weight: Floats, x: Floats, parent: Ints, mean: Floats, cov: Floats) -> None:
        off = np.empty(n)
        for k in range(len(weight)):
            t = parent[k]
            mean[k] = 0.0
            for i in range(weight.shape[1]):
                for a in range(n):
                    mean[k, a] += weight[k, i] * x[t, i, a]
            cov[k] = 0.0
            for i in range(weight.shape[1]):
                for a in range(n):
                    off[a] = x[t, i, a] - mean[k, a]
                    for b in range(a + 1):
                        cov[k, a, b] += weight[k, i] * off[a] * off[b]
            for a in range(n):
                for b in range(a):
                    cov[k, b, a] = cov[k, a, b]

    return specialised(moments, n)


@kernel
def resample(
    kind: int, threshold: float, weight: Floats, x: Floats, parent: Ints, stream: Ints, log_weight: Floats, new: Floats
) -> None:
    """Fill new (K, N, n): rows whose effective number 1 / sum of w^2 is below threshold N are resampled, others copied.

    weight (K, N), x (T, N, n); log_weight (K, N) of resampled rows becomes -ln N.
    """
    number = weight.shape[1]
    chosen, all_of_them = np.empty(number, np.int64), np.arange(number)
    for k in range(len(weight)):
        squares = 0.0
        for i in range(number):
            squares += weight[k, i] ** 2
        if squares * threshold * number > 1.0:
            choose(kind, weight[k], chosen, stream[k])
            for i in range(number):
                log_weight[k, i] = -np.log(number)
            copy(x[parent[k]], chosen, new[k])
        else:
            copy(x[parent[k]], all_of_them, new[k])


@kernel
def copy(x: Floats, chosen: Ints, new: Floats) -> None:
    """new (N, n) becomes x (N, n) at the indices chosen (N,)."""
    for i in range(len(chosen)):
        for a in range(x.shape[1]):
            new[i, a] = x[chosen[i], a]


@kernel
def _log_density(v: float, glint: float, factor: float) -> float:
    """ln of the density of one whitened component, up to a constant: (1 - glint) N(0, 1) + glint N(0, factor^2)."""
    half = min(0.5 * v * v, FARTHEST)
    if glint == 0.0:
        return -half
    wide = half / factor**2
    return np.log(glint / factor + (1.0 - glint) * np.exp(wide - half)) - wide


@kernel
def normalise(log_weight: Floats, weight: Floats) -> None:
    """Normalise weights (N,), given as logarithms, to sum to one; fill `weight` with them."""
    largest = -np.inf
    for i in range(len(log_weight)):
        largest = max(largest, log_weight[i])
    total = 0.0
    for i in range(len(log_weight)):
        log_weight[i] -= largest
        weight[i] = np.exp(log_weight[i]) if log_weight[i] > NOTHING else 0.0
        total += weight[i]
    log_total = np.log(total)
    for i in range(len(weight)):
        weight[i] /= total
        log_weight[i] -= log_total


@kernel
def _root(Q: Floats, L: Floats) -> int:
    """Fill columns of L with L L' = Q (n, n), positive semidefinite; returns their number, the rank."""
    n = len(Q)
    rest, rank = Q.copy(), 0
    for p in range(n):
        if rest[p, p] <= 1e-12 * Q[p, p]:
            continue
        for a in range(n):
            L[a, rank] = rest[a, p] / np.sqrt(rest[p, p])
        for a in range(n):
            for b in range(n):
                rest[a, b] -= L[a, rank] * L[b, rank]
        rank += 1
    return rank
