"""The interface of an estimator: one filter per row, all rows as arrays."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.decision import Decision
from vidtrack.estimate.motion.model import Motion
from vidtrack.estimate.sensor import Sensor
from vidtrack.scan import Scan


class Estimator(Protocol):
    """Filters in rows.

    model  the motion model, whose columns position and velocity the moments have
    x, P   (T, n), (T, n, n) moments of all rows
    hits   (T,) updates so far
    scale  (T,) size of each object where the model works per size, one elsewhere
    """

    model: Motion
    hits: Ints
    scale: Floats

    @property
    def x(self) -> Floats: ...

    @property
    def P(self) -> Floats: ...  # noqa: N802

    def __len__(self) -> int: ...

    def ahead(self, dt: float) -> tuple[Floats, Floats]:
        """x, P after dt seconds; changes nothing."""

    def jacobian(self, dt: float, x: Floats) -> Floats:
        """(1, n, n) or (T, n, n) derivative of what `ahead` makes of means x (T, n)."""

    def predict(self, dt: float) -> None:
        """Move all rows dt seconds on."""

    def predicted_measurement(self, sensor: Sensor) -> tuple[Floats, Floats]:
        """zhat (T, m) and its covariance (T, m, m); the innovation covariance is that plus R."""

    def update(self, decision: Decision, scan: Scan, sensor: Sensor) -> None:
        """Successor rows from the weights of a decision."""

    def append(self, position: Floats, cov: Floats, scale: Floats) -> None:
        """New rows from located measurements: position (B, d), cov (B, d, d), scale (B,)."""

    def insert(self, x: Floats, P: Floats, scale: Floats) -> None:
        """New rows with known moments x (B, n), P (B, n, n); scale (B,)."""

    def keep(self, rows: np.ndarray) -> None:
        """Drop all rows but these indices."""


class Modes(NamedTuple):
    """Predicted measurements as Gaussian mixtures.

    weight (r, T) probability, zhat (r, T, m) mean and cov (r, T, m, m) covariance of each mode
    """

    weight: Floats
    zhat: Floats
    cov: Floats


@runtime_checkable
class Mixture(Protocol):
    """An estimator with several modes."""

    def modes(self, sensor: Sensor) -> Modes:
        """The predicted measurement of each mode; S adds R."""
