"""Compiled Kalman equations for all rows at once.

The numbers of state and measurement components are compile-time constants of each kernel. The compiler then unrolls
the small matrix products, which makes them about four times as fast.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from vidtrack.arrays.rows import starts
from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import specialised

Propagation = Callable[[Floats, Floats, Floats, Floats, Floats], tuple[Floats, Floats]]
Projection = Callable[[Floats, Floats, Floats], Floats]
Update = Callable[..., tuple[Floats, Floats]]

TURN = 2 * np.pi


@lru_cache
def propagation(n: int) -> Propagation:
    """F x and J P J' + Q (paper 004, eqs. 6 and 7) for states of n components, symmetric by construction.

    F and its Jacobian J (1, n, n) for all rows or (T, n, n), the same array for linear motion; Q (T, n, n).
    """

    def propagate(x: Floats, P: Floats, F: Floats, J: Floats, Q: Floats) -> tuple[Floats, Floats]:
        x1, P1, JP = np.empty_like(x), np.empty_like(P), np.empty((n, n))
        for t in range(len(x)):
            f = min(t, len(F) - 1)
            for i in range(n):
                total = 0.0
                for k in range(n):
                    total += F[f, i, k] * x[t, k]
                x1[t, i] = total
                for j in range(n):
                    total = 0.0
                    for k in range(n):
                        total += J[f, i, k] * P[t, k, j]
                    JP[i, j] = total
            for i in range(n):
                for j in range(i, n):
                    total = Q[t, i, j]
                    for k in range(n):
                        total += JP[i, k] * J[f, j, k]
                    P1[t, i, j] = total
                    P1[t, j, i] = total
        return x1, P1

    return specialised(propagate, n)


@lru_cache
def projection(m: int, n: int, *, positions: bool = False) -> Projection:
    """H P H' + excess (T, m, m) for all rows; H (T, m, n) or (1, m, n), excess (T, m, m) or (1, m, m).

    `positions`: H selects the positions of a state [x, vx, y, vy, ...]; H P H' are then the entries that it selects.
    """

    def project(P: Floats, H: Floats, excess: Floats) -> Floats:
        out, HP = np.empty((len(P), m, m)), np.empty((m, n))
        for t in range(len(P)):
            h, s = min(t, len(H) - 1), min(t, len(excess) - 1)
            for a in range(m):
                for j in range(0 if positions else n):
                    total = 0.0
                    for k in range(n):
                        total += H[h, a, k] * P[t, k, j]
                    HP[a, j] = total
            for a in range(m):
                for b in range(a, m):
                    total = P[t, 2 * a, 2 * b] if positions else 0.0
                    for k in range(0 if positions else n):
                        total += HP[a, k] * H[h, b, k]
                    out[t, a, b] = total + excess[s, a, b]
                    out[t, b, a] = total + excess[s, b, a]
        return out

    if positions:
        project.__name__ = "project_positions"
    return specialised(project, m, n)


@lru_cache
def mixture_update(m: int, n: int, angles: tuple[int, ...] = (), *, positions: bool = False) -> Update:
    """The moment-matched mixture of the missed branch (weight beta0) and one Kalman update per measurement.

    The kernel takes x (T, n), P (T, n, n), H (T, m, n) or (1, m, n), excess (T, m, m) or (1, m, m), zhat (T, m),
    z (M, m), R (M, m, m), and of the decision parent (K,), row (B,), measurement (B,), beta (B,), beta0 (K,),
    inflation (K,) and spread; it returns x (K, n) and P (K, n, n). A single weight of one is the Kalman update itself.
    Innovations of the components `angles` are wrapped to -pi..pi. `positions`: H selects the positions of a state
    [x, vx, y, vy, ...]; products with it are then the entries that it selects.

    S = H P H' + excess + R; the excess is the part of the predicted measurement's covariance that H P H' lacks.
    K = P H' S^-1 by a Cholesky factor of S (paper 004, eq. 3). The covariance has Joseph's form
    (I - K H) P (I - K H)' + K R K', which rounding keeps positive definite, computed as A = P - K H P and then
    A - (A H' - K R) K'. The missed branch is widened by inflation * K S K', with S from `noise` (m, m).
    """
    wraps = tuple(a in angles for a in range(m))

    def update(
        x: Floats, P: Floats, H: Floats, excess: Floats, zhat: Floats, z: Floats, R: Floats,
        parent: Ints, row: Ints, measurement: Ints, beta: Floats, beta0: Floats,
        inflation: Floats, spread: bool, noise: Floats,
    ) -> tuple[Floats, Floats]:  # fmt: skip
        rows = len(parent)
        start = starts(row, rows)
        x1, P1 = np.empty((rows, n)), np.empty((rows, n, n))
        K, L, A, AH = np.empty((n, m)), np.empty((m, m)), np.empty((n, n)), np.empty((n, m))
        shift, mean, v = np.empty(n), np.empty(n), np.empty(m)
        for k in range(rows):
            t = parent[k]
            h, s = min(t, len(H) - 1), min(t, len(excess) - 1)
            mixed = spread and (start[k + 1] - start[k] > 1 or beta0[k] > 0.0)
            for i in range(n):  # moments about the prediction
                mean[i] = 0.0
                for c in range(n):
                    P1[k, i, c] = beta0[k] * P[t, i, c]
            widening = beta0[k] * inflation[k]
            for b in range(start[k] - (widening > 0.0), start[k + 1]):
                missed = b < start[k]
                j, weight = (0, widening) if missed else (measurement[b], beta[b])
                for i in range(n):  # P H'
                    for a in range(m):
                        if positions:
                            K[i, a] = P[t, i, 2 * a]
                            continue
                        total = 0.0
                        for d in range(n):
                            total += P[t, i, d] * H[h, a, d]
                        K[i, a] = total
                for a in range(m):  # S = L L'
                    for c in range(a + 1):
                        total = excess[s, a, c] + (noise[a, c] if missed else R[j, a, c])
                        if positions:
                            total += K[2 * a, c]
                        else:
                            for d in range(n):
                                total += H[h, a, d] * K[d, c]
                        for e in range(c):
                            total -= L[a, e] * L[c, e]
                        L[a, c] = np.sqrt(total) if a == c else total / L[c, c]
                for i in range(n):  # K L = P H' L^-T
                    for a in range(m):
                        for c in range(a):
                            K[i, a] -= L[a, c] * K[i, c]
                        K[i, a] /= L[a, a]
                if missed:  # K S K' = (K L) (K L)'
                    for i in range(n):
                        for c in range(n):
                            for a in range(m):
                                P1[k, i, c] += weight * K[i, a] * K[c, a]
                    continue
                for i in range(n):  # K = P H' S^-1
                    for a in range(m - 1, -1, -1):
                        for c in range(a + 1, m):
                            K[i, a] -= L[c, a] * K[i, c]
                        K[i, a] /= L[a, a]
                for a in range(m):
                    v[a] = z[j, a] - zhat[t, a]
                    if wraps[a]:
                        v[a] -= TURN * np.rint(v[a] / TURN)
                for i in range(n):
                    total = 0.0
                    for a in range(m):
                        total += K[i, a] * v[a]
                    shift[i] = total
                    mean[i] += weight * total
                    for c in range(n):
                        A[i, c] = P[t, i, c]
                for a in range(m):  # A = P - K H P
                    for c in range(n):
                        total = P[t, 2 * a, c] if positions else 0.0
                        if not positions:
                            for d in range(n):
                                total += H[h, a, d] * P[t, d, c]
                        for i in range(n):
                            A[i, c] -= K[i, a] * total
                for i in range(n):  # A H' - K (excess + R)
                    for a in range(m):
                        total = A[i, 2 * a] if positions else 0.0
                        if not positions:
                            for d in range(n):
                                total += A[i, d] * H[h, a, d]
                        for c in range(m):
                            total -= K[i, c] * (excess[s, c, a] + R[j, c, a])
                        AH[i, a] = total
                for i in range(n):
                    for c in range(i, n):
                        total = A[i, c]
                        for a in range(m):
                            total -= AH[i, a] * K[c, a]
                        if mixed:
                            total += shift[i] * shift[c]
                        P1[k, i, c] += weight * total
                        if c != i:
                            P1[k, c, i] += weight * total
            for i in range(n):
                x1[k, i] = x[t, i] + mean[i]
                if mixed:
                    for c in range(n):
                        P1[k, i, c] -= mean[i] * mean[c]
        return x1, P1

    if positions:
        update.__name__ = "update_by_positions"
    return specialised(update, m, n, *angles)
