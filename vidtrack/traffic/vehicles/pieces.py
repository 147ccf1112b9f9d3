"""Breaks tracks where their boxes jump: another vehicle shares the blob, hides a part of it, or takes over."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.vehicles.knots import Knots

_PX, _SIGMAS = 1.0, 4.0
"""px; standard deviation of the edges of knots, and how many of them are no jump"""
_PAUSE_S = 0.8
"""s; from knot to knot; longer ones are of a vehicle that stands or is hidden, or of two"""
_BRAKING = 8.0
"""m/s2; hard braking"""
_GROWTH = 0.2
"""Change of the logarithm of width or height, from knot to knot, that a vehicle shows by turning."""


def pieces(ground: Ground, knots: Knots, place: Floats) -> Ints:
    """(P + 1,) where the pieces of all tracks begin among K knots; place (K, 2) m roughly."""
    count = len(knots.t)
    begins = np.zeros(count + 1, bool)
    begins[knots.first[knots.first < count]] = True
    if count > 1:
        inside = ~begins[1:count]
        begins[1:count] |= _grows(ground, knots) | (np.diff(knots.t) > _PAUSE_S)
        begins[2:count] |= _jumps(ground, knots.t, place) & inside[1:] & inside[:-1]
    begins[count] = True
    return np.flatnonzero(begins)


def _grows(ground: Ground, knots: Knots) -> np.ndarray:
    """(K - 1,) steps in which a box changes its size on the road."""
    left, top, right, bottom = knots.edge.T
    across = ground.metres(np.column_stack([right, bottom])) - ground.metres(np.column_stack([left, bottom]))
    grows = np.zeros(len(left) - 1, bool)
    with np.errstate(invalid="ignore", divide="ignore"):  # NaN, no growth: a side that is cut, or zero
        m_per_px = np.linalg.norm(across, axis=1) / (right - left)
        for side in (right - left, bottom - top):
            change = np.abs(np.diff(np.log(side * m_per_px)))
            grows |= change > _GROWTH + _SIGMAS * _PX * np.hypot(1 / side[1:], 1 / side[:-1])
    return grows


def _jumps(ground: Ground, t: Floats, place: Floats) -> np.ndarray:
    """(K - 2,) steps, from the second on, in which a place is not where the step before leads to."""
    h = np.diff(t)
    with np.errstate(divide="ignore", invalid="ignore"):
        v = np.diff(place, axis=0) / h[:, None]
        change = np.linalg.norm(np.diff(v, axis=0), axis=1)
        change -= _BRAKING * (h[1:] + h[:-1]) / 2
        far = np.flatnonzero(change > 0)
        sigma = np.linalg.norm(ground.by_own_error(place[1 + far]), axis=(1, 2)) * np.hypot(1 / h[1 + far], 1 / h[far])
        jumps = np.zeros(len(change), bool)
        jumps[far] = change[far] > _SIGMAS * np.sqrt(2) * _PX * sigma
        return jumps
