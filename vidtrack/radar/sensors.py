"""Measurement models of a radar, for states in metres.

Each velocity of a state follows its position: [x, vx, y, vy, ...]. The range rate of a receding target is positive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.errors import ScanError
from vidtrack.radar.coordinates import to_polar, unbiased

NEAREST_M = 1e-6
"""m; smallest distance used: the line of sight is undefined at the sensor."""


class _Polar:
    """Range, azimuth[, elevation][, range rate] from `origin`; d is the number of space dimensions."""

    __slots__ = ()
    angles: ClassVar[tuple[int, ...]] = (1,)
    origin: tuple[float, ...]
    doppler: bool

    def h(self, x: Floats, position: tuple[int, ...]) -> Floats:
        """(T, d) or (T, d + 1) expected measurements, azimuth in -pi..pi."""
        return _expected(x, position, self.origin, self.doppler)

    def H(self, x: Floats, position: tuple[int, ...]) -> Floats:  # noqa: N802
        """(T, d, n) or (T, d + 1, n) Jacobians of h."""
        return _jacobian(x, position, self.origin, self.doppler)

    def locate(self, z: Floats, R: Floats) -> tuple[Floats, Floats]:
        """Positions (M, d) and covariances (M, d, d): the unbiased conversion."""
        return _located(z, R, self.origin)


@dataclass(frozen=True, slots=True)
class RangeAzimuth(_Polar):
    """z = range [m], azimuth [rad][, range rate [m/s]] of a target in the plane.

    origin   (x, y) of the radar [m]
    doppler  with range rate
    """

    origin: tuple[float, float] = (0.0, 0.0)
    doppler: bool = False


@dataclass(frozen=True, slots=True)
class RangeAzimuthElevation(_Polar):
    """z = range [m], azimuth [rad], elevation [rad][, range rate [m/s]].

    origin   (x, y, z) of the radar [m]
    doppler  whether the range rate is measured
    """

    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    doppler: bool = False


@dataclass(frozen=True, slots=True)
class PositionRangeRate:
    """z = position [m] in two or three dimensions and range rate [m/s] from `origin`."""

    angles: ClassVar[tuple[int, ...]] = ()
    origin: tuple[float, ...] = (0.0, 0.0)

    def h(self, x: Floats, position: tuple[int, ...]) -> Floats:
        """(T, d + 1) positions and expected range rates."""
        p, v = _relative(x, position, self.origin)
        return np.column_stack([x[:, position], _range_rate(p, v)])

    def H(self, x: Floats, position: tuple[int, ...]) -> Floats:  # noqa: N802
        """(T, d + 1, n) Jacobians of h."""
        p, v = _relative(x, position, self.origin)
        dim = len(position)
        H = np.zeros((len(x), dim + 1, x.shape[1]))
        H[:, range(dim), position] = 1.0
        _range_rate_jacobian(H[:, dim], p, v, position)
        return H

    def locate(self, z: Floats, R: Floats) -> tuple[Floats, Floats]:
        """The measured positions (M, d) and their covariances (M, d, d)."""
        dim = z.shape[1] - 1
        return z[:, :dim], R[:, :dim, :dim]


@dataclass(frozen=True, slots=True)
class RangeRate:
    """z = range rate [m/s] from `origin` alone, as what a Doppler filter does not pass tells it."""

    angles: ClassVar[tuple[int, ...]] = ()
    origin: tuple[float, ...] = (0.0, 0.0)

    def h(self, x: Floats, position: tuple[int, ...]) -> Floats:
        """(T, 1) expected range rates."""
        return _range_rate(*_relative(x, position, self.origin))[:, None]

    def H(self, x: Floats, position: tuple[int, ...]) -> Floats:  # noqa: N802
        """(T, 1, n) Jacobians of h."""
        H = np.zeros((len(x), 1, x.shape[1]))
        _range_rate_jacobian(H[:, 0], *_relative(x, position, self.origin), position)
        return H

    def locate(self, z: Floats, R: Floats) -> tuple[Floats, Floats]:
        """Raises ScanError: it has no place."""
        raise ScanError("a range rate alone tells no position, so no track begins with one")


def _relative(x: Floats, position: tuple[int, ...], origin: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Positions (T, d) relative to the sensor, and velocities (T, d)."""
    return x[:, position] - origin, x[:, [column + 1 for column in position]]


def _distance(p: Floats) -> Floats:
    return np.maximum(np.linalg.norm(p, axis=1), NEAREST_M)


def _range_rate(p: Floats, v: Floats) -> Floats:
    """(T,) p' v / |p|."""
    return np.asarray((p * v).sum(axis=1) / _distance(p))


def _expected(x: Floats, position: tuple[int, ...], origin: tuple[float, ...], doppler: bool) -> Floats:
    if not doppler:
        return to_polar(x[:, position] - origin)
    p, v = _relative(x, position, origin)
    return np.column_stack([to_polar(p), _range_rate(p, v)])


def _jacobian(x: Floats, position: tuple[int, ...], origin: tuple[float, ...], doppler: bool) -> Floats:
    p = x[:, position] - origin
    dim = len(position)
    r, ground = _distance(p), _distance(p[:, :2])
    H = np.zeros((len(x), dim + doppler, x.shape[1]))
    H[:, 0, position] = p / r[:, None]
    H[:, 1, position[0]] = p[:, 1] / ground**2
    H[:, 1, position[1]] = -p[:, 0] / ground**2
    if dim == 3:
        H[:, 2, position[:2]] = -p[:, :2] * (p[:, 2] / (r**2 * ground))[:, None]
        H[:, 2, position[2]] = ground / r**2
    if doppler:
        _range_rate_jacobian(H[:, dim], *_relative(x, position, origin), position)
    return H


def _range_rate_jacobian(row: Floats, p: Floats, v: Floats, position: tuple[int, ...]) -> None:
    """Fill row (T, n): d/dp = v / |p| - p (p' v) / |p|^3, d/dv = p / |p|."""
    r = _distance(p)[:, None]
    row[:, position] = v / r - p * _range_rate(p, v)[:, None] / r**2
    row[:, [column + 1 for column in position]] = p / r


def _located(z: Floats, R: Floats, origin: tuple[float, ...]) -> tuple[Floats, Floats]:
    dim = len(origin)
    position, cov = unbiased(z[:, :dim], R[:, :dim, :dim])
    return position + origin, cov
