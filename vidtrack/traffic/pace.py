"""Velocities on the road, filtered there: a vehicle that keeps its speed keeps it in metres, not in the picture.

Each track has a Kalman filter of nearly constant velocity, whose measurements are the middles of the lower edges of its
boxes. Where the track was not seen alone, it predicts.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import kernel

_JOLT = 2.0
"""m2/s3; by how much the variance of a velocity grows in a second"""
_EDGE_PX, _LASTS_S = 1.2, 0.05
"""px; standard deviation of an edge, and for how long its error stays"""
_FIRST_M_S = 30.0
"""m/s; standard deviation of a velocity before the second measurement"""
_GATE = 16.0
"""Squared distance beyond which a measurement is of something else"""
_PATIENCE_S = 0.4
"""s; after so long without one that fits the filter begins anew"""
_FORGET_S = 10.0
_T, _FITTED, _X, _P, _WIDTH = 0, 1, 2, 6, 22


class Pace:
    """Takes rows in order of time; remembers the filter of each track."""

    def __init__(self) -> None:
        self._state: dict[int, Floats] = {}

    def follow(self, track: Ints, t: Floats, place: Floats, by_px: Floats) -> tuple[Floats, Floats]:
        """(N, 2) velocities [m/s] and (N, 2, 2) their covariances; infinite before there are any.

        track (N,), t (N,) s, place (N, 2) m, NaN where it was not seen; by_px (N, 2, 2) its derivative [m/px]
        """
        ids, slot = np.unique(track, return_inverse=True)
        new = np.full(_WIDTH, np.nan)
        state = np.array([self._state.get(one, new) for one in ids.tolist()]).reshape(-1, _WIDTH)
        v, cov = np.full((len(track), 2), np.nan), np.full((len(track), 2, 2), np.inf)
        _follow(slot, t, place, by_px, state, v, cov)
        self._state |= dict(zip(ids.tolist(), state, strict=True))
        now = t.max(initial=0.0)
        self._state = {one: row for one, row in self._state.items() if now - row[_T] < _FORGET_S}
        return v, cov


@kernel
def _follow(slot: Ints, t: Floats, place: Floats, by_px: Floats, state: Floats, v: Floats, cov: Floats) -> None:
    """Step through rows; state (T, _WIDTH) of each track: time, time of the last fit, x, y, vx, vy, P."""
    for i in range(len(slot)):
        now = state[slot[i]]
        seen = not np.isnan(place[i, 0])
        if np.isnan(now[_T]) or t[i] - now[_FITTED] > _PATIENCE_S:
            if not seen:
                continue
            _begin(now, t[i], place[i], by_px[i])
            continue
        dt = t[i] - now[_T]
        x, P = now[_X:_P], now[_P:].reshape(4, 4)
        F = np.eye(4)
        F[0, 2] = F[1, 3] = dt
        moved, grown = F @ x, F @ P @ F.T
        for a in range(4):
            x[a] = moved[a]
            for b in range(4):
                P[a, b] = grown[a, b]
        for axis in range(2):
            P[axis, axis] += _JOLT * dt**3 / 3
            P[axis, axis + 2] += _JOLT * dt**2 / 2
            P[axis + 2, axis] += _JOLT * dt**2 / 2
            P[axis + 2, axis + 2] += _JOLT * dt
        now[_T] = t[i]
        if seen:
            lasting = max(1.0, 2 * _LASTS_S / dt) if dt > 0 else 1.0
            R = lasting * _EDGE_PX**2 * by_px[i] @ by_px[i].T
            S = P[:2, :2] + R
            off = place[i] - x[:2]
            inverse = np.linalg.inv(S)
            if off @ inverse @ off < _GATE:
                gain = np.ascontiguousarray(P[:, :2]) @ inverse
                x += gain @ off
                P -= gain @ P[:2, :].copy()
                now[_FITTED] = t[i]
        for a in range(2):
            v[i, a] = x[2 + a]
            for b in range(2):
                cov[i, a, b] = P[2 + a, 2 + b]


@kernel
def _begin(now: Floats, t: float, place: Floats, by_px: Floats) -> None:
    """Write the state of a track that is seen for the first time."""
    now[:] = 0.0
    now[_T] = now[_FITTED] = t
    P, R = now[_P:].reshape(4, 4), _EDGE_PX**2 * by_px @ by_px.T
    for a in range(2):
        now[_X + a] = place[a]
        for b in range(2):
            P[a, b] = R[a, b]
    P[2, 2] = P[3, 3] = _FIRST_M_S**2
