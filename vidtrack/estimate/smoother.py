"""The fixed-interval smoother of Rauch, Tung and Striebel (1965): states given all measurements."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.estimate.motion.model import Motion


def linearised_cross(model: Motion, dt: float, x: Floats, P: Floats) -> Floats:
    """(T, n, n) P J', the covariance of states x (T, n), P (T, n, n) with themselves dt seconds later.

    J is the derivative of the motion at x.
    """
    J = model.jacobian(dt, x, model.transition(dt, x))
    return P @ np.swapaxes(J, 1, 2)


def smoothing_gain(cross: Floats, prior_P: Floats) -> Floats:
    """(T, n, n) C = cross prior_P^-1: cross (T, n, n) is the covariance of a state with its prediction, which has
    prior_P (T, n, n); P F' for a linear motion.
    """
    return np.swapaxes(np.linalg.solve(prior_P, np.swapaxes(cross, 1, 2)), 1, 2)


def smoothed(
    x: Floats, P: Floats, gain: Floats, prior_x: Floats, prior_P: Floats, next_x: Floats, next_P: Floats
) -> tuple[Floats, Floats]:
    """Smoothed moments x + C (next_x - prior_x), P + C (next_P - prior_P) C'.

    x (T, n), P (T, n, n)  filtered moments; prior_x, prior_P: their prediction for the next scan, gain: C of that step
    next_x, next_P         smoothed moments of the next scan
    """
    x1 = x + (gain @ (next_x - prior_x)[:, :, None])[:, :, 0]
    P1 = P + gain @ (next_P - prior_P) @ np.swapaxes(gain, 1, 2)
    return x1, (P1 + np.swapaxes(P1, 1, 2)) / 2
