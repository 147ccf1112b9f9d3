"""The interface of a motion model."""

from __future__ import annotations

from functools import lru_cache
from typing import Protocol

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import kernel
from vidtrack.errors import ConfigError


class Motion(Protocol):
    """A motion model: transition and process noise of a state.

    Every state begins with [x, vx, y, vy, ...]; other components (accelerations, a turn rate) follow.

    dim        space dimensions
    states     n, components of the state
    position, velocity   columns of the state, one per axis
    per_size   the noise is in object sizes, not in pixels or metres
    """

    def __hash__(self) -> int: ...

    @property
    def dim(self) -> int: ...

    @property
    def states(self) -> int: ...

    @property
    def position(self) -> tuple[int, ...]: ...

    @property
    def velocity(self) -> tuple[int, ...]: ...

    @property
    def per_size(self) -> bool: ...

    def transition(self, dt: float, x: Floats) -> Floats:
        """F (1, n, n) or (T, n, n): F x are the states x (T, n) after dt seconds."""

    def jacobian(self, dt: float, x: Floats, F: Floats) -> Floats:
        """(1, n, n) or (T, n, n) derivative of F x by x; F itself for linear motion."""

    def process_noise(self, dt: float, x: Floats, P: Floats, hits: Ints, scale: Floats) -> Floats:
        """Q (T, n, n) over dt seconds; hits (T,) updates so far, scale (T,) multiplies standard deviations."""

    def birth(self, position: Floats, cov: Floats, scale: Floats) -> tuple[Floats, Floats]:
        """x (B, n), P (B, n, n) of new rows from one located measurement each: (B, d), (B, d, d); scale (B,)."""


class Columns:
    """The columns of positions and velocities in the state of a model with `dim`."""

    __slots__ = ()
    dim: int

    @property
    def position(self) -> tuple[int, ...]:
        """Columns of the state that are positions."""
        return _columns(0, self.dim)

    @property
    def velocity(self) -> tuple[int, ...]:
        """Columns of the state that are velocities."""
        return _columns(1, self.dim)


@lru_cache
def _columns(first: int, dim: int) -> tuple[int, ...]:
    """Every other column from `first` on, one per axis."""
    return tuple(range(first, 2 * dim, 2))


def check(model: Columns, dims: tuple[int, ...], *names: str) -> None:
    """Raise ConfigError if the model's `dim` is not among dims, or a named value is not None and not above zero."""
    kind = type(model).__name__
    if model.dim not in dims:
        allowed = ", ".join(map(str, dims[:-1]))
        raise ConfigError(f"{kind}: dim is {model.dim}; it must be {allowed} or {dims[-1]}")
    for name in names:
        value = getattr(model, name)
        if value is not None and not (np.isfinite(value) and value > 0):
            raise ConfigError(f"{kind}: {name} is {value}; it must be above zero")


@kernel
def at_rest(position: Floats, cov: Floats, sigma: Floats) -> tuple[Floats, Floats]:
    """x (B, n), P (B, n, n): position (B, d) with cov (B, d, d), all else zero with deviations sigma (B, n)."""
    (rows, n), dim = sigma.shape, position.shape[1]
    x, P = np.zeros((rows, n)), np.zeros((rows, n, n))
    for b in range(rows):
        for k in range(n):
            P[b, k, k] = sigma[b, k] ** 2
        for i in range(dim):
            x[b, 2 * i] = position[b, i]
            for j in range(dim):
                P[b, 2 * i, 2 * j] = cov[b, i, j]
    return x, P
