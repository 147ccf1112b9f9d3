"""Measurement models: what a sensor would see of a state."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Protocol

import numpy as np

from vidtrack.arrays.types import Floats


class Sensor(Protocol):
    """A measurement model z = h(x) + noise.

    angles  components of z that are angles: their differences are taken the short way round. At most one of
            the first two may be one; its values lie in -pi..pi.
    """

    @property
    def angles(self) -> tuple[int, ...]: ...

    def h(self, x: Floats, position: tuple[int, ...]) -> Floats:
        """(T, m) expected measurements of states x (T, n) whose positions are in columns `position`."""

    def H(self, x: Floats, position: tuple[int, ...]) -> Floats:  # noqa: N802
        """(T, m, n) or (1, m, n) Jacobians of h."""

    def locate(self, z: Floats, R: Floats) -> tuple[Floats, Floats]:
        """Positions (M, d) and covariances (M, d, d) that single measurements give."""


@dataclass(frozen=True, slots=True)
class Position:
    """The measurement is the position itself, in the state's own coordinates."""

    angles: ClassVar[tuple[int, ...]] = ()

    def h(self, x: Floats, position: tuple[int, ...]) -> Floats:
        """(T, d) the positions."""
        return x.take(position, axis=1)

    def H(self, x: Floats, position: tuple[int, ...]) -> Floats:  # noqa: N802
        """(1, d, n): picks the position columns, the same for all rows."""
        return _selection(position, x.shape[1])

    def locate(self, z: Floats, R: Floats) -> tuple[Floats, Floats]:
        """The measurements as they are."""
        return z, R


POSITION = Position()


@lru_cache
def _selection(columns: tuple[int, ...], n: int) -> Floats:
    """(1, d, n) the matrix that picks these columns of n; it is cached, so do not write into it."""
    return np.eye(n)[None, list(columns)]


def wrapped(difference: Floats, angles: tuple[int, ...]) -> Floats:
    """The differences (N, m) of measurements, changed in place so that their angles lie in -pi..pi."""
    for a in angles:
        difference[:, a] -= 2 * np.pi * np.round(difference[:, a] / (2 * np.pi))
    return difference
