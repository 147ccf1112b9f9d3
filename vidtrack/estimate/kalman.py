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
        return sensor.h(self.x, self.model.position), H @ self.P @ np.swapaxes(H, 1, 2)

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
def gain(P: Floats, H: Floats, R: Floats, K: Floats) -> None:
    """K = P H' S^-1, S = H P H' + R, by a Cholesky factor of S. P (n, n), H (m, n), R (m, m), K (n, m) is filled."""
    m, n = H.shape
    PH = np.empty((n, m))
    L = np.empty((m, m))
    for i in range(n):
        for a in range(m):
            total = 0.0
            for k in range(n):
                total += P[i, k] * H[a, k]
            PH[i, a] = total
    for a in range(m):
        for b in range(a + 1):
            total = R[a, b]
            for k in range(n):
                total += H[a, k] * PH[k, b]
            for c in range(b):
                total -= L[a, c] * L[b, c]
            L[a, b] = np.sqrt(total) if a == b else total / L[b, b]
    for i in range(n):
        for a in range(m):
            total = PH[i, a]
            for c in range(a):
                total -= L[a, c] * K[i, c]
            K[i, a] = total / L[a, a]
        for a in range(m - 1, -1, -1):
            total = K[i, a]
            for c in range(a + 1, m):
                total -= L[c, a] * K[i, c]
            K[i, a] = total / L[a, a]


@njit(cache=True, nogil=True, error_model="numpy")
def _joseph(P: Floats, H: Floats, R: Floats, K: Floats, out: Floats) -> None:
    """(I - K H) P (I - K H)' + K R K': positive definite whatever the rounding."""
    m, n = H.shape
    A, AP, KR = np.empty((n, n)), np.empty((n, n)), np.empty((n, m))
    for i in range(n):
        for j in range(n):
            total = 1.0 if i == j else 0.0
            for a in range(m):
                total -= K[i, a] * H[a, j]
            A[i, j] = total
        for a in range(m):
            total = 0.0
            for b in range(m):
                total += K[i, b] * R[b, a]
            KR[i, a] = total
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += A[i, k] * P[k, j]
            AP[i, j] = total
    for i in range(n):
        for j in range(i, n):
            total = 0.0
            for k in range(n):
                total += AP[i, k] * A[j, k]
            for a in range(m):
                total += KR[i, a] * K[j, a]
            out[i, j] = total
            out[j, i] = total


@njit(cache=True, nogil=True, error_model="numpy")
def _update(
    x: Floats, P: Floats, H: Floats, zhat: Floats, z: Floats, R: Floats,
    parent: Ints, start: Ints, measurement: Ints, beta: Floats, beta0: Floats,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Moment-matched mixture of the missed branch (weight beta0) and one Kalman update per weight."""
    rows, n = len(parent), x.shape[1]
    m = z.shape[1]
    x1, P1 = np.empty((rows, n)), np.empty((rows, n, n))
    K, branch = np.empty((n, m)), np.empty((n, n))
    for k in range(rows):
        t = parent[k]
        h = H[min(t, len(H) - 1)]
        if start[k + 1] - start[k] == 1 and beta0[k] == 0.0:  # one measurement for certain: the Kalman update itself
            j = measurement[start[k]]
            gain(P[t], h, R[j], K)
            _joseph(P[t], h, R[j], K, P1[k])
            for i in range(n):
                x1[k, i] = x[t, i]
                for a in range(m):
                    x1[k, i] += K[i, a] * (z[j, a] - zhat[t, a])
            continue
        mean, second = np.zeros(n), beta0[k] * P[t]  # about the prediction
        for b in range(start[k], start[k + 1]):
            j = measurement[b]
            gain(P[t], h, R[j], K)
            _joseph(P[t], h, R[j], K, branch)
            shift = np.zeros(n)
            for i in range(n):
                for a in range(m):
                    shift[i] += K[i, a] * (z[j, a] - zhat[t, a])
                mean[i] += beta[b] * shift[i]
            for i in range(n):
                for c in range(n):
                    second[i, c] += beta[b] * (branch[i, c] + shift[i] * shift[c])
        for i in range(n):
            x1[k, i] = x[t, i] + mean[i]
            for c in range(n):
                P1[k, i, c] = second[i, c] - mean[i] * mean[c]
    return x1, P1
