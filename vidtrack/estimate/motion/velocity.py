"""Nearly constant velocity, the default motion model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import kernel
from vidtrack.estimate.motion.model import Columns, at_rest, check


@dataclass(frozen=True, slots=True)
class ConstantVelocity(Columns):
    """Nearly constant velocity, state [x, vx, y, vy, ...].

    accel    standard deviation of the acceleration along the heading, per s^2
    cross    the same across the heading; None: equal to accel (isotropic)
    speed    prior standard deviation of a new track's velocity, per s
    hold_s   correlation time of the acceleration [s]: continuous white noise of intensity accel^2 hold_s, independent
             of the scan rate. None: the acceleration is constant over each step, Q = accel^2 G G', G = [dt^2/2, dt]
             (the papers' model)
    warmup   updates with isotropic noise, because the heading is not yet known; an ellipse along a wrong heading
             makes the filter overconfident (paper 004, SPEC trap)
    heading  a row's heading is known while its speed exceeds this many standard deviations of the speed
    per_size accel, cross and speed are in object sizes, not in pixels or metres
    """

    dim: int = 2
    accel: float = 1.0
    cross: float | None = None
    speed: float = 10.0
    hold_s: float | None = None
    warmup: int = 6
    heading: float = 3.0
    per_size: bool = False

    def __post_init__(self) -> None:
        check(self, (1, 2, 3), "accel", "cross", "speed", "hold_s")

    @property
    def states(self) -> int:
        return 2 * self.dim

    def transition(self, dt: float, x: Floats) -> Floats:
        """F (1, n, n) over dt seconds."""
        return _moved_on(self.dim, dt)

    def jacobian(self, dt: float, x: Floats, F: Floats) -> Floats:
        """F: the motion is linear."""
        return F

    def process_noise(self, dt: float, x: Floats, P: Floats, hits: Ints, scale: Floats) -> Floats:
        """Q (T, n, n) over dt seconds, elongated along the heading in rows whose heading is known.

        x (T, n), P (T, n, n), hits (T,) updates so far, scale (T,) multiplies the standard deviations. The
        acceleration covariance is A = cross^2 I + (accel^2 - cross^2) u u', u the unit velocity (SPEC 004).
        """
        if self.hold_s is None:
            time = dt**4 / 4, dt**3 / 2, dt**2
        else:
            time = self.hold_s * (dt**3 / 3), self.hold_s * (dt**2 / 2), self.hold_s * dt
        cross = self.accel if self.cross is None else self.cross
        return _accelerations(x, P, hits, scale, self.accel, cross, time, self.warmup, self.heading)

    def birth(self, position: Floats, cov: Floats, scale: Floats) -> tuple[Floats, Floats]:
        """State and covariance of new rows from one located measurement each.

        position (B, d), cov (B, d, d), scale (B,) -> x (B, n), P (B, n, n). The velocity is zero with the prior
        variance, so the second measurement gives the two-point estimate.
        """
        return at_rest(position, cov, np.repeat((self.speed * scale)[:, None], self.states, axis=1))


@lru_cache(maxsize=16)
def _moved_on(dim: int, dt: float) -> Floats:
    """(1, n, n) identity, plus dt from each velocity to its position; cached: do not write to it."""
    F = np.eye(2 * dim)[None]
    for a in range(0, 2 * dim, 2):
        F[0, a, a + 1] = dt
    return F


@kernel
def _accelerations(
    x: Floats, P: Floats, hits: Ints, scale: Floats, accel: float, cross: float, time: tuple[float, float, float],
    warmup: int, heading: float,
) -> Floats:  # fmt: skip
    """Q (T, n, n): A times the time integrals of position^2, position velocity and velocity^2.

    A row's heading is known after `warmup` updates, while its speed exceeds `heading` standard deviations.
    """
    rows, n = x.shape
    dim = n // 2
    Q = np.empty((rows, n, n))
    for t in range(rows):
        speed2, variance = 0.0, 0.0
        for a in range(dim):
            speed2 += x[t, 2 * a + 1] ** 2
            variance = max(variance, P[t, 2 * a + 1, 2 * a + 1])
        settled = hits[t] > warmup and speed2 > heading**2 * variance
        across = (cross if settled else accel) ** 2 * scale[t] ** 2
        stretch = (accel**2 - cross**2) * scale[t] ** 2 / speed2 if settled else 0.0
        for a in range(dim):
            for b in range(dim):
                A = stretch * x[t, 2 * a + 1] * x[t, 2 * b + 1]
                if a == b:
                    A += across
                Q[t, 2 * a, 2 * b] = A * time[0]
                Q[t, 2 * a, 2 * b + 1] = A * time[1]
                Q[t, 2 * a + 1, 2 * b] = A * time[1]
                Q[t, 2 * a + 1, 2 * b + 1] = A * time[2]
    return Q
