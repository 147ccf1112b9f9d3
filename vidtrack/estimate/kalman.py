"""The Kalman bank: all tracks' filters as arrays, one row a track."""

from __future__ import annotations

import numpy as np
from numba import njit

from vidtrack.estimate.motion import ConstantVelocity
from vidtrack.estimate.sensor import Sensor
from vidtrack.scan import Decision, Floats, Ints, Scan


class KalmanBank:
    """Linear (or linearised) Kalman filters in rows.

    x (T, n), P (T, n, n) means and covariances; hits (T,) updates so far; scale (T,) size of each
    object where the model works per size, one elsewhere.
    """

    def __init__(self, model: ConstantVelocity) -> None:
        n = 2 * model.dim
        self.model = model
        self.x = np.empty((0, n))
        self.P = np.empty((0, n, n))
        self.hits = np.empty(0, np.int64)
        self.scale = np.empty(0)

    def __len__(self) -> int:
        return len(self.x)

    def ahead(self, dt: float) -> tuple[Floats, Floats]:
        """x, P after dt seconds; changes nothing (paper 004, eqs. 6 and 7)."""
        settled = self.model.settled(self.x, self.P, self.hits)
        Q = self.model.process_noise(dt, self.x, self.scale, settled)
        return _propagate(self.x, self.P, self.model.transition(dt), Q)

    def predict(self, dt: float) -> None:
        """Move all rows dt seconds on."""
        self.x, self.P = self.ahead(dt)

    def predicted_measurement(self, sensor: Sensor) -> tuple[Floats, Floats]:
        """zhat (T, m) and its covariance H P H' (T, m, m); the innovation covariance is that plus R."""
        H = sensor.H(self.x, self.model.position)
        return sensor.h(self.x, self.model.position), _project(self.P, H)

    def update(self, decision: Decision, scan: Scan, sensor: Sensor) -> None:
        """Successor rows from the weights of a decision (paper 004, eqs. 3 to 5; mixtures moment-matched)."""
        zhat = sensor.h(self.x, self.model.position)
        H = sensor.H(self.x, self.model.position)
        start = np.searchsorted(decision.row, np.arange(len(decision.parent) + 1))
        self.x, self.P = _update(
            self.x, self.P, H, zhat, scan.z, scan.R,
            decision.parent, start, decision.measurement, decision.beta, decision.beta0,
        )  # fmt: skip
        self.hits = self.hits[decision.parent] + (decision.beta0 < 0.5)
        self.scale = self.scale[decision.parent]

    def append(self, position: Floats, cov: Floats, scale: Floats) -> None:
        """New rows from located measurements: position (B, d), cov (B, d, d), scale (B,)."""
        x, P = self.model.birth(position, cov, scale)
        self.x = np.concatenate([self.x, x])
        self.P = np.concatenate([self.P, P])
        self.hits = np.concatenate([self.hits, np.ones(len(x), np.int64)])
        self.scale = np.concatenate([self.scale, scale])

    def keep(self, rows: np.ndarray) -> None:
        """Drop all rows but these (indices or a mask)."""
        self.x, self.P, self.hits, self.scale = self.x[rows], self.P[rows], self.hits[rows], self.scale[rows]

    def moments(self) -> tuple[Floats, Floats]:
        """x (T, n), P (T, n, n)."""
        return self.x, self.P


@njit(cache=True, nogil=True, error_model="numpy")
def _propagate(x: Floats, P: Floats, F: Floats, Q: Floats) -> tuple[Floats, Floats]:
    """F x and F P F' + Q for all rows, symmetric by construction."""
    rows, n = x.shape
    x1, P1 = np.empty_like(x), np.empty_like(P)
    FP = np.empty((n, n))
    for t in range(rows):
        for i in range(n):
            total = 0.0
            for k in range(n):
                total += F[i, k] * x[t, k]
            x1[t, i] = total
            for j in range(n):
                total = 0.0
                for k in range(n):
                    total += F[i, k] * P[t, k, j]
                FP[i, j] = total
        for i in range(n):
            for j in range(i, n):
                total = Q[t, i, j]
                for k in range(n):
                    total += FP[i, k] * F[j, k]
                P1[t, i, j] = total
                P1[t, j, i] = total
    return x1, P1


@njit(cache=True, nogil=True, error_model="numpy")
def _project(P: Floats, H: Floats) -> Floats:
    """H P H' (T, m, m) for all rows; H (T, m, n) or (1, m, n)."""
    rows, n = P.shape[:2]
    m = H.shape[1]
    out, HP = np.empty((rows, m, m)), np.empty((m, n))
    for t in range(rows):
        h = min(t, len(H) - 1)
        for a in range(m):
            for j in range(n):
                total = 0.0
                for k in range(n):
                    total += H[h, a, k] * P[t, k, j]
                HP[a, j] = total
        for a in range(m):
            for b in range(a, m):
                total = 0.0
                for k in range(n):
                    total += HP[a, k] * H[h, b, k]
                out[t, a, b] = total
                out[t, b, a] = total
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _update(
    x: Floats, P: Floats, H: Floats, zhat: Floats, z: Floats, R: Floats,
    parent: Ints, start: Ints, measurement: Ints, beta: Floats, beta0: Floats,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Moment-matched mixture of the missed branch (weight beta0) and one Kalman update per weight."""
    rows, n = len(parent), x.shape[1]
    m = z.shape[1]
    x1, P1 = np.empty((rows, n)), np.empty((rows, n, n))
    K, L, A, AH = np.empty((n, m)), np.empty((m, m)), np.empty((n, n)), np.empty((n, m))
    alone = np.empty(0)
    shift, mean = np.empty(n), np.empty(n)
    for k in range(rows):
        t = parent[k]
        h = min(t, len(H) - 1)
        mixed = start[k + 1] - start[k] > 1 or beta0[k] > 0.0
        for i in range(n):  # moments about the prediction
            mean[i] = 0.0
            for c in range(n):
                P1[k, i, c] = beta0[k] * P[t, i, c]
        for b in range(start[k], start[k + 1]):
            j = measurement[b]
            _gain(P, t, H, h, R, j, K, L)
            for i in range(n):
                shift[i] = 0.0
                for a in range(m):
                    shift[i] += K[i, a] * (z[j, a] - zhat[t, a])
                mean[i] += beta[b] * shift[i]
            _add_branch(P, t, H, h, R, j, K, A, AH, shift if mixed else alone, beta[b], P1, k)
        for i in range(n):
            x1[k, i] = x[t, i] + mean[i]
            if mixed:
                for c in range(n):
                    P1[k, i, c] -= mean[i] * mean[c]
    return x1, P1


@njit(cache=True, nogil=True, error_model="numpy")
def _gain(P: Floats, t: int, H: Floats, h: int, R: Floats, j: int, K: Floats, L: Floats) -> None:
    """K = P H' S^-1, S = H P H' + R, by a Cholesky factor of S (paper 004, eq. 3); K (n, m) and L (m, m) are filled."""
    m, n = H.shape[1:]
    for i in range(n):
        for a in range(m):
            total = 0.0
            for k in range(n):
                total += P[t, i, k] * H[h, a, k]
            K[i, a] = total  # P H'
    for a in range(m):
        for b in range(a + 1):
            total = R[j, a, b]
            for k in range(n):
                total += H[h, a, k] * K[k, b]
            for c in range(b):
                total -= L[a, c] * L[b, c]
            L[a, b] = np.sqrt(total) if a == b else total / L[b, b]
    for i in range(n):
        for a in range(m):
            for c in range(a):
                K[i, a] -= L[a, c] * K[i, c]
            K[i, a] /= L[a, a]
        for a in range(m - 1, -1, -1):
            for c in range(a + 1, m):
                K[i, a] -= L[c, a] * K[i, c]
            K[i, a] /= L[a, a]


@njit(cache=True, nogil=True, error_model="numpy")
def _add_branch(
    P: Floats, t: int, H: Floats, h: int, R: Floats, j: int, K: Floats, A: Floats, AH: Floats,
    shift: Floats, weight: float, out: Floats, k: int,
) -> None:  # fmt: skip
    """Add weight times the updated covariance and, where it is given, the spread shift shift'.

    Joseph's form (I - K H) P (I - K H)' + K R K' is positive definite whatever the rounding; here A = P - K H P
    and then A - (A H' - K R) K'.
    """
    m, n = H.shape[1:]
    for i in range(n):
        for c in range(n):
            A[i, c] = P[t, i, c]
    for a in range(m):
        for c in range(n):
            total = 0.0
            for d in range(n):
                total += H[h, a, d] * P[t, d, c]
            for i in range(n):
                A[i, c] -= K[i, a] * total
    for i in range(n):
        for a in range(m):
            total = 0.0
            for d in range(n):
                total += A[i, d] * H[h, a, d]
            for b in range(m):
                total -= K[i, b] * R[j, b, a]
            AH[i, a] = total
    for i in range(n):
        for c in range(i, n):
            total = A[i, c]
            for a in range(m):
                total -= AH[i, a] * K[c, a]
            if len(shift):
                total += shift[i] * shift[c]
            out[k, i, c] += weight * total
            if c != i:
                out[k, c, i] += weight * total
