"""The Kalman bank: the filters of all tracks as arrays, one row per track."""

from __future__ import annotations

from copy import copy
from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np

from vidtrack.arrays.rows import replaced
from vidtrack.arrays.types import Floats, Ints
from vidtrack.decision import Decision
from vidtrack.estimate.kernels import mixture_update, projection, propagation
from vidtrack.estimate.motion.model import Motion
from vidtrack.estimate.sensor import POSITION, Sensor
from vidtrack.estimate.smoother import linearised_cross
from vidtrack.scan import Scan


class _Ahead(NamedTuple):
    """x, P after dt seconds, from of_x and of_P."""

    dt: float
    of_x: Floats
    of_P: Floats  # noqa: N815
    x: Floats
    P: Floats


class KalmanBank:
    """Kalman filters, one per row; extended Kalman filters if motion or sensor are not linear.

    x (T, n), P (T, n, n) means and covariances; hits (T,) updates so far; scale (T,) size of each object if the model
    is `per_size`, else one.
    """

    STATE = ("x", "P", "hits", "scale")

    def __init__(self, model: Motion) -> None:
        n = model.states
        self.model = model
        self.x = np.empty((0, n))
        self.P = np.empty((0, n, n))
        self.hits = np.empty(0, np.int64)
        self.scale = np.empty(0)
        self._known: _Ahead | None = None

    def __len__(self) -> int:
        return len(self.x)

    def ahead(self, dt: float) -> tuple[Floats, Floats]:
        """x, P after dt seconds; changes nothing (paper 004, eqs. 6 and 7).

        The last answer is kept: a detector asks for the tracks of a frame before the tracker is given its scan.
        """
        known = self._known
        if known is not None and known.dt == dt and known.of_x is self.x and known.of_P is self.P:
            return known.x, known.P
        F = self.model.transition(dt, self.x)
        J = self.model.jacobian(dt, self.x, F)
        Q = self.model.process_noise(dt, self.x, self.P, self.hits, self.scale)
        x, P = propagation(self.x.shape[1])(self.x, self.P, F, J, Q)
        self._known = _Ahead(dt, self.x, self.P, x, P)
        return x, P

    def cross(self, dt: float) -> Floats:
        """(T, n, n) P J', with the derivative J of the motion at the means."""
        return linearised_cross(self.model, dt, self.x, self.P)

    def predict(self, dt: float) -> None:
        self.x, self.P = self.ahead(dt)

    def linearised(self, sensor: Sensor) -> tuple[Floats, Floats, Floats]:
        """zhat (T, m), H (T, m, n) or (1, m, n), excess (T, m, m) or (1, m, m): z = zhat + H dx + excess + noise."""
        position = self.model.position
        H = sensor.H(self.x, position)
        return sensor.h(self.x, position), H, _no_excess(H.shape[1])

    def predicted_measurement(self, sensor: Sensor) -> tuple[Floats, Floats]:
        """zhat (T, m) and its covariance H P H' plus the excess (T, m, m)."""
        zhat, H, excess = self.linearised(sensor)
        return zhat, projection(*H.shape[1:], positions=self._selects_positions(H))(self.P, H, excess)

    def _selects_positions(self, H: Floats) -> bool:
        """Whether H is the matrix that selects the positions."""
        return H is POSITION.H(self.x, self.model.position)

    def update(self, decision: Decision, scan: Scan, sensor: Sensor) -> None:
        """Successor rows from the weights of a decision (paper 004, eqs. 3 to 5; mixtures moment-matched)."""
        zhat, H, excess = self.linearised(sensor)
        rows, m = len(decision.parent), H.shape[1]
        known = decision.inflation is not None and scan.noise is not None
        inflation = decision.inflation if known else np.zeros(rows)
        update = mixture_update(*H.shape[1:], sensor.angles, positions=self._selects_positions(H))
        self.x, self.P = update(
            self.x, self.P, H, excess, zhat, scan.z, scan.R,
            decision.parent, decision.row, decision.measurement, decision.beta, decision.beta0,
            inflation, decision.spread, scan.noise if known else _no_excess(m)[0],
        )  # fmt: skip
        self.hits = self.hits.take(decision.parent) + decision.hit
        self.scale = self.scale.take(decision.parent)

    def append(self, position: Floats, cov: Floats, scale: Floats) -> None:
        self.insert(*self.model.birth(position, cov, scale), scale)

    def insert(self, x: Floats, P: Floats, scale: Floats) -> None:
        """New rows with known means x (B, n) and covariances P (B, n, n); scale (B,)."""
        self.x = np.concatenate([self.x, x])
        self.P = np.concatenate([self.P, P])
        self.hits = np.concatenate([self.hits, np.ones(len(x), np.int64)])
        self.scale = np.concatenate([self.scale, scale])

    def keep(self, rows: np.ndarray) -> None:
        rows = np.arange(len(self))[rows]
        for name in self.STATE:
            setattr(self, name, getattr(self, name).take(rows, axis=0))

    def only(self, rows: Ints) -> Self:
        """A bank of its own of these rows (K,)."""
        bank = copy(self)
        bank.keep(rows)
        return bank

    def put(self, rows: Ints, other: Self, at: Ints) -> None:
        """Set these rows (K,) to rows `at` (K,) of another bank."""
        for name in self.STATE:
            setattr(self, name, replaced(getattr(self, name), rows, getattr(other, name), at))


@lru_cache
def _no_excess(m: int) -> Floats:
    """(1, m, m) zeros; cached: do not write to it."""
    return np.zeros((1, m, m))
