"""The Kalman bank: all tracks' filters as arrays, one row a track."""

from __future__ import annotations

import numpy as np

from vidtrack.estimate.kernels import mixture_update, projection, propagation
from vidtrack.estimate.motion import ConstantVelocity
from vidtrack.estimate.sensor import Sensor
from vidtrack.scan import Decision, Floats, Scan


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
        return propagation(self.x.shape[1])(self.x, self.P, self.model.transition(dt), Q)

    def predict(self, dt: float) -> None:
        """Move all rows dt seconds on."""
        self.x, self.P = self.ahead(dt)

    def predicted_measurement(self, sensor: Sensor) -> tuple[Floats, Floats]:
        """zhat (T, m) and its covariance H P H' (T, m, m); the innovation covariance is that plus R."""
        H = sensor.H(self.x, self.model.position)
        return sensor.h(self.x, self.model.position), projection(*H.shape[1:])(self.P, H)

    def update(self, decision: Decision, scan: Scan, sensor: Sensor) -> None:
        """Successor rows from the weights of a decision (paper 004, eqs. 3 to 5; mixtures moment-matched)."""
        zhat = sensor.h(self.x, self.model.position)
        H = sensor.H(self.x, self.model.position)
        start = np.searchsorted(decision.row, np.arange(len(decision.parent) + 1))
        rows, m = len(decision.parent), H.shape[1]
        update = mixture_update(*H.shape[1:], sensor.angles)
        known = decision.inflation is not None and scan.noise is not None
        inflation = decision.inflation if known else np.zeros(rows)
        self.x, self.P = update(
            self.x, self.P, H, zhat, scan.z, scan.R,
            decision.parent, start, decision.measurement, decision.beta, decision.beta0,
            inflation, decision.spread, scan.noise if known else np.eye(m),
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
        """Drop all rows but these indices."""
        self.x, self.P, self.hits, self.scale = self.x[rows], self.P[rows], self.hits[rows], self.scale[rows]

    def moments(self) -> tuple[Floats, Floats]:
        """x (T, n), P (T, n, n)."""
        return self.x, self.P
