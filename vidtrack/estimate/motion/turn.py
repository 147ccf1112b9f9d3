"""Coordinated turn: constant speed and a turn rate that is part of the state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.estimate.motion.model import Columns, at_rest, check

STRAIGHT = 1e-4
"""Turn in one step [rad] below which series replace sine and cosine."""


@dataclass(frozen=True, slots=True)
class CoordinatedTurn(Columns):
    """State [x, vx, y, vy, w], or [x, vx, y, vy, z, vz, w] with a level turn; w is the turn rate [rad/s].

    w is positive from x to y (Bar-Shalom, Li, Kirubarajan 2001, section 11.7).

    accel      standard deviation of the acceleration, per s^2
    hold_s     its correlation time [s], as in ConstantVelocity; None: it is constant over a step
    turn       standard deviation of the change of the turn rate, rad/s per sqrt(s)
    speed      prior standard deviation of a new track's velocity, per s
    turn_rate  prior standard deviation of a new track's turn rate, rad/s
    """

    dim: int = 2
    accel: float = 1.0
    turn: float = 0.02
    speed: float = 10.0
    turn_rate: float = 0.1
    hold_s: float | None = None
    per_size: bool = False

    def __post_init__(self) -> None:
        check(self, (2, 3), "accel", "turn", "speed", "turn_rate", "hold_s")

    @property
    def states(self) -> int:
        return 2 * self.dim + 1

    def transition(self, dt: float, x: Floats) -> Floats:
        """F (T, n, n) over dt seconds at each row's own turn rate."""
        s, c, _, _ = _arc(x[:, -1], dt)
        angle = x[:, -1] * dt
        F = np.repeat(np.eye(self.states)[None], len(x), axis=0)
        F[:, 0, 1] = F[:, 2, 3] = s
        F[:, 2, 1], F[:, 0, 3] = c, -c
        F[:, 1, 1] = F[:, 3, 3] = np.cos(angle)
        F[:, 3, 1], F[:, 1, 3] = np.sin(angle), -np.sin(angle)
        if self.dim == 3:
            F[:, 4, 5] = dt
        return F

    def jacobian(self, dt: float, x: Floats, F: Floats) -> Floats:
        """(T, n, n) derivative of F x: F, and in the last column the derivative by the turn rate."""
        _, _, ds, dc = _arc(x[:, -1], dt)
        vx, vy = x[:, 1], x[:, 3]
        sin, cos = dt * np.sin(x[:, -1] * dt), dt * np.cos(x[:, -1] * dt)
        J = F.copy()
        J[:, 0, -1] = ds * vx - dc * vy
        J[:, 2, -1] = dc * vx + ds * vy
        J[:, 1, -1] = -sin * vx - cos * vy
        J[:, 3, -1] = cos * vx - sin * vy
        return J

    def process_noise(self, dt: float, x: Floats, P: Floats, hits: Ints, scale: Floats) -> Floats:
        """Q (T, n, n) over dt seconds; scale (T,) multiplies the acceleration's deviation."""
        n = self.states
        Q = np.zeros((len(x), n, n))
        if self.hold_s is None:
            time = np.array([[dt**4 / 4, dt**3 / 2], [dt**3 / 2, dt**2]])
        else:
            time = self.hold_s * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        for axis in range(self.dim):
            pair = slice(2 * axis, 2 * axis + 2)
            Q[:, pair, pair] = time * (self.accel * scale[:, None, None]) ** 2
        Q[:, -1, -1] = self.turn**2 * dt
        return Q

    def birth(self, position: Floats, cov: Floats, scale: Floats) -> tuple[Floats, Floats]:
        sigma = np.full((len(position), self.states), self.speed) * scale[:, None]
        sigma[:, -1] = self.turn_rate
        return at_rest(position, cov, sigma)


def _arc(w: Floats, dt: float) -> tuple[Floats, Floats, Floats, Floats]:
    """(T,) sin(w dt) / w, (1 - cos(w dt)) / w and their derivatives by w."""
    straight = np.abs(w * dt) < STRAIGHT
    safe = np.where(straight, 1.0, w)
    sin, cos = np.sin(safe * dt), np.cos(safe * dt)
    s = np.where(straight, dt - w**2 * dt**3 / 6, sin / safe)
    c = np.where(straight, w * dt**2 / 2, (1 - cos) / safe)
    ds = np.where(straight, -w * dt**3 / 3, (dt * cos - sin / safe) / safe)
    dc = np.where(straight, dt**2 / 2, (dt * sin - (1 - cos) / safe) / safe)
    return s, c, ds, dc
