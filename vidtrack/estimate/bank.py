"""The interface of an estimator: a bank of filters, one row per track."""

from __future__ import annotations

from typing import NamedTuple, Protocol, Self, runtime_checkable

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.decision import Decision
from vidtrack.estimate.motion.model import Motion
from vidtrack.estimate.sensor import Sensor
from vidtrack.scan import Scan


class Estimator(Protocol):
    """A bank of filters, one per row.

    model  the motion model; x has its columns `position` and `velocity`
    x, P   (T, n), (T, n, n) moments of all rows
    hits   (T,) updates so far
    scale  (T,) size of each object if the model is `per_size`, else one
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

    def cross(self, dt: float) -> Floats:
        """(T, n, n) covariance of each state with itself dt seconds later, which a smoother needs."""

    def predict(self, dt: float) -> None:
        """Predict all rows by dt seconds."""

    def predicted_measurement(self, sensor: Sensor) -> tuple[Floats, Floats]:
        """zhat (T, m) and its covariance (T, m, m) without R."""

    def update(self, decision: Decision, scan: Scan, sensor: Sensor) -> None:
        """Replace the rows by their successors, updated with the weights of a decision."""

    def append(self, position: Floats, cov: Floats, scale: Floats) -> None:
        """New rows from located measurements: position (B, d), cov (B, d, d), scale (B,)."""

    def insert(self, x: Floats, P: Floats, scale: Floats) -> None:
        """New rows with known moments x (B, n), P (B, n, n); scale (B,)."""

    def keep(self, rows: np.ndarray) -> None:
        """Drop all rows but these indices."""

    def only(self, rows: Ints) -> Self:
        """A bank of its own of these rows (K,)."""

    def put(self, rows: Ints, other: Self, at: Ints) -> None:
        """Set these rows (K,) to rows `at` (K,) of another bank of this kind."""


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

    def forget(self, rows: Ints) -> None:
        """Make the modes that a target of these rows may switch to as probable as if nothing showed them."""
