"""Where a radar detects targets: up to a range, in a sector, and which are too slow for its Doppler filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.radar.coordinates import to_polar, wrap
from vidtrack.radar.sensors import RangeRate
from vidtrack.tracking.blind import BlindZone


@dataclass(frozen=True, slots=True)
class Sector:
    """What a radar covers.

    origin    (x, y) of the radar [m]
    farthest  m; largest range
    middle    rad; azimuth of the sector's middle
    width     rad; 2 pi: all round
    """

    origin: tuple[float, float]
    farthest: float
    middle: float = 0.0
    width: float = 2 * np.pi

    def share(self, xy: Floats) -> Floats:
        """(T,) 1 at positions (T, 2) inside, 0 at others."""
        polar = to_polar(xy - self.origin)
        off = np.abs(wrap(polar[:, 1] - self.middle))
        return ((polar[:, 0] <= self.farthest) & (off <= self.width / 2)).astype(float)


def too_slow(origin: tuple[float, float], slowest: float) -> BlindZone | None:
    """The range rates that the Doppler filter of a radar at (x, y) [m] does not pass; None: it passes all.

    slowest  m/s; range rate at which P_D is half; 0: all are detected
    """
    return BlindZone(RangeRate(origin), slowest / np.sqrt(2 * np.log(2))) if slowest > 0 else None
