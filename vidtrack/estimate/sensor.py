"""Measurement models: the expected measurement of a state."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Protocol

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.errors import ScanError


class Sensor(Protocol):
    """A measurement model z = h(x) + noise.

    angles  components of z that are angles, in -pi..pi; their differences are wrapped. At most one of the first two
            components may be an angle.
    """

    @property
    def angles(self) -> tuple[int, ...]: ...

    def h(self, x: Floats, position: tuple[int, ...]) -> Floats:
        """(T, m) expected measurements of states x (T, n) whose positions are in columns `position`."""

    def H(self, x: Floats, position: tuple[int, ...]) -> Floats:  # noqa: N802
        """(T, m, n) or (1, m, n) Jacobians of h."""

    def locate(self, z: Floats, R: Floats) -> tuple[Floats, Floats]:
        """Positions (M, d) and covariances (M, d, d) from single measurements."""


@dataclass(frozen=True, slots=True)
class Position:
    """The measurement is the position, in the state's coordinates."""

    angles: ClassVar[tuple[int, ...]] = ()

    def h(self, x: Floats, position: tuple[int, ...]) -> Floats:
        """(T, d) the positions."""
        return x.take(position, axis=1)

    def H(self, x: Floats, position: tuple[int, ...]) -> Floats:  # noqa: N802
        """(1, d, n) selection of the position columns, the same for all rows."""
        return _selection(position, x.shape[1])

    def locate(self, z: Floats, R: Floats) -> tuple[Floats, Floats]:
        """The measurements as they are."""
        return z, R


@dataclass(frozen=True, slots=True)
class PositionVelocity:
    """The measurement is position and velocity, [x, vx, y, vy, ...]."""

    angles: ClassVar[tuple[int, ...]] = ()

    def h(self, x: Floats, position: tuple[int, ...]) -> Floats:
        """(T, 2 d) positions and velocities."""
        return x[:, : 2 * len(position)]

    def H(self, x: Floats, position: tuple[int, ...]) -> Floats:  # noqa: N802
        """(1, 2 d, n) selection of their columns."""
        return _selection(tuple(range(2 * len(position))), x.shape[1])

    def locate(self, z: Floats, R: Floats) -> tuple[Floats, Floats]:
        """The positions and their covariances."""
        return z[:, ::2], R[:, ::2, ::2]


@dataclass(frozen=True, slots=True)
class Velocity:
    """The measurement is the velocity, in the state's coordinates; it follows each position in the state."""

    angles: ClassVar[tuple[int, ...]] = ()

    def h(self, x: Floats, position: tuple[int, ...]) -> Floats:
        """(T, d) the velocities."""
        return x.take([column + 1 for column in position], axis=1)

    def H(self, x: Floats, position: tuple[int, ...]) -> Floats:  # noqa: N802
        """(1, d, n) selection of their columns, the same for all rows."""
        return _selection(tuple(column + 1 for column in position), x.shape[1])

    def locate(self, z: Floats, R: Floats) -> tuple[Floats, Floats]:
        """Raises ScanError: it has no place."""
        raise ScanError("a velocity alone tells no position, so no track begins with one")


POSITION = Position()
POSITION_VELOCITY = PositionVelocity()
VELOCITY = Velocity()


def still(sensor: Sensor) -> Sensor:
    """The measurement model without the motion of targets during the scan (`radar.sweep`)."""
    inner: Sensor = getattr(sensor, "sensor", sensor)
    return inner


@lru_cache
def _selection(columns: tuple[int, ...], n: int) -> Floats:
    """(1, d, n) selection matrix of these columns of n; cached: do not write to it."""
    return np.eye(n)[None, list(columns)]


def wrapped(difference: Floats, angles: tuple[int, ...]) -> Floats:
    """The differences (N, m) of measurements, with angles wrapped to -pi..pi in place."""
    for a in angles:
        difference[:, a] -= 2 * np.pi * np.round(difference[:, a] / (2 * np.pi))
    return difference
