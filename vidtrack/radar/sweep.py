"""Measurement model of a scan whose plots have different times: predictions are moved to the plots' times."""

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
    """A sensor with a rotating beam: h(x) is `sensor.h` of the state moved by velocity times time offset.

    A target's offset is that of the nearest plot. Under a rotating beam neighbours are measured at nearly the same
    time; with other time patterns the nearest plot is the target's own, if it has one.

    sensor  the measurement model without the motion during the scan
    plots   positions of the scan's plots
    offset  (M,) the plots' times minus the scan's time [s]
    speed   prior standard deviation of a velocity; speed times offset widens the position of a new track
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
        """(T, m) expected measurements at the times of the nearest plots."""
        return self.sensor.h(self._moved(x, position)[0], position)

    def H(self, x: Floats, position: tuple[int, ...]) -> Floats:  # noqa: N802
        """(T, m, n) Jacobians of h, with the velocity's effect on the moved position."""
        moved, offset = self._moved(x, position)
        H = self.sensor.H(moved, position)
        H = np.broadcast_to(H, (len(x), *H.shape[1:])).copy()
        for column in position:
            H[:, :, column + 1] += H[:, :, column] * offset[:, None]
        return H

    def locate(self, z: Floats, R: Floats) -> tuple[Floats, Floats]:
        """Positions (M, d) and covariances (M, d, d), widened by the unknown motion between plot and scan time."""
        found, cov = self.sensor.locate(z, R)
        spread = (self.speed * self._offset(found)) ** 2
        return found, cov + spread[:, None, None] * np.eye(found.shape[1])

    def _offset(self, position: Floats) -> Floats:
        """(T,) offsets of the plots nearest to positions (T, d)."""
        return np.asarray(self.offset[self.plots.query(position)[1]])

    def _moved(self, x: Floats, position: tuple[int, ...]) -> tuple[Floats, Floats]:
        """The states (T, n) moved by their offsets, and the offsets (T,)."""
        offset = self._offset(x[:, position])
        moved = x.copy()
        for column in position:
            moved[:, column] += offset * x[:, column + 1]
        return moved, offset
