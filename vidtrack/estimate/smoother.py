"""The fixed-interval smoother of Rauch, Tung and Striebel (1965): states given all measurements."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats


def smoothing_gain(P: Floats, F: Floats, prior_P: Floats) -> Floats:
    """(T, n, n) C = P F' prior_P^-1, with prior_P (T, n, n) predicted from P (T, n, n) by F (T or 1, n, n)."""
    return np.swapaxes(np.linalg.solve(prior_P, F @ P), 1, 2)


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
