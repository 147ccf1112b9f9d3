"""Where a radar detects targets: up to a range, in a sector, and if they are fast enough for its Doppler filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.radar.coordinates import to_polar, wrap

BLIND = 0.02
"""Share of P_D that is left for a target too slow for Doppler, because its velocity is not known exactly."""


@dataclass(frozen=True, slots=True)
class Sector:
    """What a radar covers.

    origin    (x, y) of the radar [m]
    farthest  m; largest range
    middle    rad; azimuth of the sector's middle
    width     rad; 2 pi: all round
    slowest   m/s; below twice this range rate the detection probability falls, to BLIND of it
    """

    origin: tuple[float, float]
    farthest: float
    middle: float = 0.0
    width: float = 2 * np.pi
    slowest: float = 0.0

    def share(self, xy: Floats, v: Floats) -> Floats:
        """(T,) share at positions and velocities (T, 2): 0 outside, 1 inside, less for slow ones."""
        polar = to_polar(xy - self.origin)
        off = np.abs(wrap(polar[:, 1] - self.middle))
        inside = (polar[:, 0] <= self.farthest) & (off <= self.width / 2)
        if self.slowest == 0:
            return inside.astype(float)
        rate = np.abs(np.sum((xy - self.origin) * v, axis=1)) / np.maximum(polar[:, 0], 1.0)
        return inside * np.clip(rate / self.slowest - 1, BLIND, 1.0)
