"""Motion models with an acceleration in the state: [x, vx, y, vy, ..., ax, ay, ...]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.estimate.motion.model import Columns, at_rest, check

LONG = 10.0
"""Steps longer than this many correlation times are composed of two halves."""


@dataclass(frozen=True, slots=True)
class ConstantAcceleration(Columns):
    """Nearly constant acceleration (Bar-Shalom, Li, Kirubarajan 2001, section 6.3).

    change  standard deviation of the acceleration's change, per s^2
    hold_s  the change takes place within this time [s]: continuous white jerk of intensity change^2 / hold_s. None:
            once per scan, Q = change^2 G G', G = [dt^2/2, dt, 1] (the model of the alpha-beta-gamma filter)
    speed, accel   prior standard deviations of a new track's velocity, per s, and acceleration, per s^2
    """

    dim: int = 2
    change: float = 1.0
    hold_s: float | None = None
    speed: float = 10.0
    accel: float = 5.0
    per_size: bool = False

    def __post_init__(self) -> None:
        check(self, (1, 2, 3), "change", "hold_s", "speed", "accel")

    @property
    def states(self) -> int:
        return 3 * self.dim

    def transition(self, dt: float, x: Floats) -> Floats:
        """F (1, n, n) over dt seconds."""
        return _each_axis(np.array([[1, dt, dt**2 / 2], [0, 1, dt], [0, 0, 1]]), self.dim)

    def jacobian(self, dt: float, x: Floats, F: Floats) -> Floats:
        """F: the motion is linear."""
        return F

    def process_noise(self, dt: float, x: Floats, P: Floats, hits: Ints, scale: Floats) -> Floats:
        if self.hold_s is None:
            G = np.array([dt**2 / 2, dt, 1.0])
            Q = np.outer(G, G)
        else:
            Q = np.array(
                [[dt**5 / 20, dt**4 / 8, dt**3 / 6], [dt**4 / 8, dt**3 / 3, dt**2 / 2], [dt**3 / 6, dt**2 / 2, dt]]
            ) / self.hold_s  # fmt: skip
        return _each_axis(Q, self.dim) * (self.change * scale[:, None, None]) ** 2

    def birth(self, position: Floats, cov: Floats, scale: Floats) -> tuple[Floats, Floats]:
        return at_rest(position, cov, _priors(self.dim, self.speed, self.accel) * scale[:, None])


@dataclass(frozen=True, slots=True)
class Singer(Columns):
    """Exponentially correlated acceleration (Singer 1970).

    accel   standard deviation of the acceleration, per s^2
    hold_s  its correlation time [s]
    speed   prior standard deviation of a new track's velocity, per s
    """

    dim: int = 2
    accel: float = 5.0
    hold_s: float = 10.0
    speed: float = 10.0
    per_size: bool = False

    def __post_init__(self) -> None:
        check(self, (1, 2, 3), "accel", "hold_s", "speed")

    @property
    def states(self) -> int:
        return 3 * self.dim

    def transition(self, dt: float, x: Floats) -> Floats:
        """F (1, n, n) over dt seconds."""
        return _each_axis(self._discretised(dt)[0], self.dim)

    def jacobian(self, dt: float, x: Floats, F: Floats) -> Floats:
        """F: the motion is linear."""
        return F

    def process_noise(self, dt: float, x: Floats, P: Floats, hits: Ints, scale: Floats) -> Floats:
        return _each_axis(self._discretised(dt)[1], self.dim) * scale[:, None, None] ** 2

    def birth(self, position: Floats, cov: Floats, scale: Floats) -> tuple[Floats, Floats]:
        return at_rest(position, cov, _priors(self.dim, self.speed, self.accel) * scale[:, None])

    def _discretised(self, dt: float) -> tuple[Floats, Floats]:
        """F and Q (3, 3) of one axis: da/dt = -a / hold_s + w, of intensity 2 accel^2 / hold_s (Van Loan 1978)."""
        from scipy.linalg import expm

        if dt > LONG * self.hold_s:  # the matrix below contains exp(dt / hold_s)
            F, Q = self._discretised(dt / 2)
            return F @ F, F @ Q @ F.T + Q
        A = np.array([[0, 1, 0], [0, 0, 1], [0, 0, -1 / self.hold_s]])
        W = np.diag([0, 0, 2 * self.accel**2 / self.hold_s])
        block = expm(np.block([[-A, W], [np.zeros((3, 3)), A.T]]) * dt)
        F = block[3:, 3:].T
        Q = F @ block[:3, 3:]
        return F, (Q + Q.T) / 2


def _each_axis(M: Floats, dim: int) -> Floats:
    """(1, n, n) block matrix of M (3, 3) over [position, velocity, acceleration], for each axis, in state order."""
    order = np.concatenate([np.arange(2 * dim).reshape(dim, 2), np.arange(2 * dim, 3 * dim)[:, None]], axis=1)
    out = np.zeros((1, 3 * dim, 3 * dim))
    for axis in order:
        out[0, axis[:, None], axis] = M
    return out


def _priors(dim: int, speed: float, accel: float) -> Floats:
    """(1, n) prior standard deviations of the components that one measurement does not determine."""
    return np.array([[speed] * (2 * dim) + [accel] * dim])
