"""The information reduction factor q2 of a PDAF: the effect of misses and clutter on its covariance.

The covariance follows the modified Riccati equation P = P^- - q2 K S K' (paper 000, eq. 16).
"""

from __future__ import annotations

from functools import lru_cache
from math import gamma, log, pi

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammainc

from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError

POINTS_S, POINTS_R = 400, 240
"""Quadrature points; 800 and 480 change q2 by less than 1e-12."""

LEAST_P_D = 1e-150
"""Smaller P_D, down to zero, are raised to this: their powers would overflow."""

LEAST_GATE, MOST_GATE = 0.1, 10.0
"""Standard deviations; range of gates that the quadrature supports."""

KE_DIM, KE_GATE = 2, 4.0
"""Dimension and gate of Kershaw and Evans' fit."""


def ball(dim: int) -> float:
    """c_M, volume of the unit ball in `dim` dimensions: 2, pi, 4 pi / 3, ..."""
    return pi ** (dim / 2) / gamma(dim / 2 + 1)


def gate_volume(S: Floats, gate: float) -> Floats:
    """(...,) volume c_M g^M |S|^(1/2) of the gates of innovation covariances S (..., m, m)."""
    dim = S.shape[-1]
    return np.asarray(ball(dim) * gate**dim * np.sqrt(np.linalg.det(S)))


def gated(dim: int, gate: float) -> float:
    """P_G, probability that the target's measurement lies within `gate` standard deviations."""
    return float(gammainc(dim / 2, gate**2 / 2))


def gated_spread(dim: int, gate: float) -> float:
    """c_1 of E[v v' | in the gate] = c_1 S."""
    return float(gammainc(dim / 2 + 1, gate**2 / 2)) / gated(dim, gate)


def q2(p_d: ArrayLike, expected_clutter: ArrayLike, dim: int = 2, gate: float = 4.0) -> Floats:
    """Exact q2 = E[v' S^-1 v] / M of the PDAF's combined innovation v, broadcast over p_d and expected_clutter.

    p_d               probability of detection
    expected_clutter  rho V, mean number of false measurements in the gate
    dim, gate         M and g [standard deviations]

    The sums and multiple integrals of paper 000, eqs. (17) and (18), become one double integral for any rho V by
    1 / (b + sum e) = integral of exp(-s (b + sum e)) ds over s > 0.
    """
    p_d, clutter = np.broadcast_arrays(np.maximum(p_d, LEAST_P_D), np.asarray(expected_clutter, float))
    s, met, weight = _table(dim, gate)
    p_d, clutter = p_d[..., None], clutter[..., None]
    b = (2 * pi) ** (dim / 2) * clutter / (ball(dim) * gate**dim) * (1 - p_d * gated(dim, gate)) / p_d
    return np.asarray(p_d[..., 0] * (np.exp(-s * b - clutter * met) @ weight))


def q2_fit(p_d: ArrayLike, expected_clutter: ArrayLike) -> Floats:
    """Kershaw and Evans' fit for M = 2 and g = 4: 0.997 P_D / (1 + 0.37 P_D^-1.57 rho V)."""
    p_d = np.maximum(p_d, LEAST_P_D)
    return np.asarray(0.997 * p_d / (1 + 0.37 * p_d**-1.57 * np.asarray(expected_clutter)))


@lru_cache
def _table(dim: int, gate: float) -> tuple[Floats, Floats, Floats]:
    """The terms independent of P_D and rho V: s, 1 - Phi(s), and J(s) times all constants and quadrature weights.

    Trapezoid rule in ln s, where the integrand decays at both ends; Gauss-Legendre points for r in 0..g.
    """
    if dim < 1 or not LEAST_GATE <= gate <= MOST_GATE:
        raise ConfigError(
            f"q2: {dim} dimensions and a gate of {gate} standard deviations; "
            f"take at least 1 and a gate in {LEAST_GATE}..{MOST_GATE}"
        )
    s = np.exp(np.linspace(log(1e-14), log(60) + gate**2 / 2, POINTS_S))
    x, w = np.polynomial.legendre.leggauss(POINTS_R)
    r, w = gate * (x + 1) / 2, w * gate / 2
    exponent = np.multiply.outer(s, np.exp(-(r**2) / 2))
    met = dim / gate**dim * (-np.expm1(-exponent) @ (w * r ** (dim - 1)))
    J = np.exp(-exponent) @ (w * r ** (dim + 1) * np.exp(-(r**2)))
    step = np.full(POINTS_S, log(s[1] / s[0]))
    step[[0, -1]] /= 2
    return s, met, ball(dim) / (2 * pi) ** (dim / 2) * J * s * step
