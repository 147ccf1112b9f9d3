"""Alpha-beta and alpha-beta-gamma filters: Kalman filters with the gain of their steady state."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.decision import Decision
from vidtrack.errors import ConfigError
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.model import Motion
from vidtrack.estimate.sensor import Sensor
from vidtrack.scan import Scan

START = 3
"""A new row runs as a Kalman filter for so many updates, because its velocity is unknown at first."""


class FixedGainBank(KalmanBank):
    """Filters with the steady-state gain of their motion model: alpha-beta for constant velocity (Kalata 1984),
    alpha-beta-gamma for constant acceleration.

    sigma  standard deviation of all position measurements, px or m; the gain depends on it and on the time step, not
           on R
    """

    def __init__(self, model: Motion, sigma: float) -> None:
        if not (np.isfinite(sigma) and sigma > 0):
            raise ConfigError(f"alpha-beta: sigma is {sigma}; it must be above zero")
        if model.per_size:
            raise ConfigError("alpha-beta: the gain cannot follow object sizes; give the model noise in px or m")
        super().__init__(model)
        self.sigma = sigma

    def ahead(self, dt: float) -> tuple[Floats, Floats]:
        """x, P after dt seconds, with the steady-state P; changes nothing."""
        x, P = super().ahead(dt)
        if dt > 0:
            P = P.copy()  # the bank keeps its own
            P[self.hits >= START] = steady_prediction(self.model, dt, self.sigma)
        return x, P

    def update(self, decision: Decision, scan: Scan, sensor: Sensor) -> None:
        """Successor rows: x + K v with the steady-state gain K of positions; what misses tell is left."""
        if not decision.shows:
            self.keep(decision.parent)
            return
        R = self.sigma**2 * np.eye(scan.z.shape[1])
        super().update(decision, replace(scan, R=R, noise=R), sensor)


@lru_cache(maxsize=64)
def steady_prediction(model: Motion, dt: float, sigma: float) -> Floats:
    """Steady-state P (n, n) before an update, for positions every dt seconds; solves the Riccati equation.

    Raises ConfigError for a model without a steady state.
    """
    from scipy.linalg import solve_discrete_are

    nobody = np.zeros((1, model.states))
    F = model.transition(dt, nobody)[0]
    Q = model.process_noise(dt, nobody, np.zeros((1, model.states, model.states)), np.zeros(1, int), np.ones(1))[0]
    H = np.eye(model.states)[list(model.position)]
    try:
        return np.asarray(solve_discrete_are(F.T, H.T, Q, sigma**2 * np.eye(len(H))))
    except np.linalg.LinAlgError:
        raise ConfigError(
            f"alpha-beta: the gain of {type(model).__name__} does not settle at a step of {dt:g} s; "
            "take another model, such as cv or ca, or another estimator"
        ) from None


def alpha_beta(index: float) -> tuple[float, float]:
    """Gains [alpha, beta / dt] of the tracking index accel dt^2 / sigma (Kalata 1984)."""
    r = (4 + index - np.sqrt(8 * index + index**2)) / 4
    alpha = 1 - r**2
    return alpha, 2 * (2 - alpha) - 4 * np.sqrt(1 - alpha)


def alpha_beta_gamma(index: float) -> tuple[float, float, float]:
    """Gains [alpha, beta / dt, gamma / dt^2] of the tracking index change dt^2 / sigma (Kalata 1984).

    With s = sqrt(1 - alpha): beta = 2 (1 - s)^2, gamma = 2 (1 - s)^3 / (1 + s), index = gamma / s.
    """
    from scipy.optimize import brentq

    s = brentq(lambda s: 2 * (1 - s) ** 3 - index * s * (1 + s), 0.0, 1.0, xtol=1e-16)
    return 1 - s**2, 2 * (1 - s) ** 2, 2 * (1 - s) ** 3 / (1 + s)
