"""Covariance intersection: two estimates of one state whose errors are correlated in an unknown way."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats

HALVINGS = 40
"""Halvings of the interval that the weight lies in."""


def intersection(x1: Floats, P1: Floats, x2: Floats, P2: Floats) -> tuple[Floats, Floats]:
    """Fused means (N, n) and covariances (N, n, n), which are never too small, whatever the correlation.

    P^-1 = w P1^-1 + (1 - w) P2^-1 with the w of the smallest determinant, between 0 and 1. S. Julier, J. Uhlmann,
    "A non-divergent estimation algorithm in the presence of unknown correlations", American Control Conference 1997.
    """
    A, B = np.linalg.inv(P1), np.linalg.inv(P2)
    w = _weight(np.linalg.eigvals(P2 @ A).real)[:, None, None]
    P = np.linalg.inv(w * A + (1 - w) * B)
    P = (P + P.transpose(0, 2, 1)) / 2
    x = P @ (w * (A @ x1[:, :, None]) + (1 - w) * (B @ x2[:, :, None]))
    return x[:, :, 0], P


def _weight(ratio: Floats) -> Floats:
    """(N,) w that maximises the determinant of w A + (1 - w) B, by the eigenvalues (N, n) of B^-1 A.

    ln det is concave in w; its slope is the sum of (r - 1) / (w r + 1 - w).
    """
    low, high = np.zeros(len(ratio)), np.ones(len(ratio))
    for _ in range(HALVINGS):
        w = (low + high) / 2
        rising = ((ratio - 1) / (w[:, None] * (ratio - 1) + 1)).sum(axis=1) > 0
        low, high = np.where(rising, w, low), np.where(rising, high, w)
    return (low + high) / 2
