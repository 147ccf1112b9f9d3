"""The unscented bank: sensor and motion by sigma points in place of derivatives."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.sensor import Sensor, wrapped


class UnscentedBank(KalmanBank):
    """Unscented Kalman filters, one per row (Julier and Uhlmann 2004).

    2 n + 1 points: the mean, and the mean plus and minus the columns of sqrt((n + k) P), weights k / (n + k) and
    1 / (2 n + 2 k), with k = max(0, 3 - n), so that no weight is negative. Statistical linearisation: H = P_zx P^-1,
    and the excess is the covariance of the points' measurements minus H P H'.
    """

    def ahead(self, dt: float) -> tuple[Floats, Floats]:
        """x, P after dt seconds, from the points, each moved by its own F; changes nothing."""
        weight, _, moved = self._moved(dt)
        x = np.einsum("s,tsi->ti", weight, moved)
        Q = self.model.process_noise(dt, self.x, self.P, self.hits, self.scale)
        return x, _spread(weight, moved - x[:, None], moved - x[:, None]) + Q

    def cross(self, dt: float) -> Floats:
        """(T, n, n) covariance of the points with the same points moved."""
        weight, points, moved = self._moved(dt)
        return _spread(weight, points - self.x[:, None], moved)

    def linearised(self, sensor: Sensor) -> tuple[Floats, Floats, Floats]:
        """zhat (T, m), H (T, m, n), excess (T, m, m) from the expected measurements of the points."""
        rows, n = self.x.shape
        points, weight = sigma_points(self.x, self.P)
        seen = sensor.h(points.reshape(-1, n), self.model.position)
        seen = seen.reshape(rows, len(weight), seen.shape[1])
        off = seen - seen[:, :1]  # relative to the middle point, so that angles near +-pi average correctly
        off = wrapped(off.reshape(-1, off.shape[2]), sensor.angles).reshape(off.shape)
        mean = np.einsum("s,tsa->ta", weight, off)
        off -= mean[:, None]
        H = np.swapaxes(np.linalg.solve(self.P, _spread(weight, points - self.x[:, None], off)), 1, 2)
        excess = _spread(weight, off, off) - H @ self.P @ np.swapaxes(H, 1, 2)
        zhat = wrapped(seen[:, 0] + mean, sensor.angles)
        return zhat, np.ascontiguousarray(H), np.ascontiguousarray((excess + np.swapaxes(excess, 1, 2)) / 2)

    def _moved(self, dt: float) -> tuple[Floats, Floats, Floats]:
        """Weights (s,), points (T, s, n), and the points dt seconds later (T, s, n), each moved by its own F."""
        points, weight = sigma_points(self.x, self.P)
        flat = points.reshape(-1, points.shape[2])
        F = self.model.transition(dt, flat)
        moved = np.einsum("kij,kj->ki", np.broadcast_to(F, (len(flat), *F.shape[1:])), flat)
        return weight, points, moved.reshape(points.shape)


def sigma_points(x: Floats, P: Floats) -> tuple[Floats, Floats]:
    """(T, 2 n + 1, n) points of each row and their weights (2 n + 1,)."""
    n = x.shape[1]
    total = max(n, 3)
    root = np.swapaxes(np.linalg.cholesky(total * P), 1, 2)
    middle = x[:, None]
    weight = np.full(2 * n + 1, 0.5 / total)
    weight[0] = 1 - n / total
    return np.concatenate([middle, middle + root, middle - root], axis=1), weight


def _spread(weight: Floats, a: Floats, b: Floats) -> Floats:
    """(T, p, q) weighted sum of the outer products of a (T, s, p) and b (T, s, q)."""
    return np.einsum("s,tsp,tsq->tpq", weight, a, b)
