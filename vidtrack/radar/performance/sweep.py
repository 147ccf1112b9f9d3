"""Plots that were not measured all at once: the prediction is moved to the time of the plots around it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.estimate.sensor import Sensor

if TYPE_CHECKING:
    from scipy.spatial import KDTree


@dataclass(frozen=True, slots=True)
class Sweep:
    """What `sensor` measures while its beam goes round: h(x) is that of the state moved by v times the offset.

    A target's offset is that of the plot nearest to it. Where the beam goes round, neighbours are seen at nearly the
    same time; elsewhere the nearest plot is the target's own, if it has one.

    sensor  the measurement model without the motion during the scan
    plots   positions of the scan's plots
    offset  (M,) their times minus the scan's [s]
    speed   standard deviation of an unknown velocity: a track that begins from a plot is where it is now only to
            within this times the offset
    """

    sensor: Sensor
    plots: KDTree
    offset: Floats
    speed: float

    @property
    def angles(self) -> tuple[int, ...]:
        """Components of z that are angles."""
        return self.sensor.angles

    def h(self, x: Floats, position: tuple[int, ...]) -> Floats:
        """(T, m) expected measurements at the times of the plots around."""
        return self.sensor.h(self._moved(x, position)[0], position)

    def H(self, x: Floats, position: tuple[int, ...]) -> Floats:  # noqa: N802
        """(T, m, n) Jacobians of h: those of the sensor, and through the position by the velocity."""
        moved, offset = self._moved(x, position)
        H = self.sensor.H(moved, position)
        H = np.broadcast_to(H, (len(x), *H.shape[1:])).copy()
        for column in position:
            H[:, :, column + 1] += H[:, :, column] * offset[:, None]
        return H

    def locate(self, z: Floats, R: Floats) -> tuple[Floats, Floats]:
        """Positions (M, d) and covariances (M, d, d), wider by the unknown motion since the plot."""
        found, cov = self.sensor.locate(z, R)
        spread = (self.speed * self._offset(found)) ** 2
        return found, cov + spread[:, None, None] * np.eye(found.shape[1])

    def _offset(self, position: Floats) -> Floats:
        """(T,) offsets of the plots nearest to positions (T, d)."""
        return np.asarray(self.offset[self.plots.query(position)[1]])

    def _moved(self, x: Floats, position: tuple[int, ...]) -> tuple[Floats, Floats]:
        """The states (T, n) moved by their offsets (T,), and these."""
        offset = self._offset(x[:, position])
        moved = x.copy()
        for column in position:
            moved[:, column] += offset * x[:, column + 1]
        return moved, offset
