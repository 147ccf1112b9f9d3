"""Where a radar detects targets: up to a range, in a sector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.radar.coordinates import to_polar, wrap


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
        """(T,) 1 at positions (T, 2) that are covered, 0 at others."""
        polar = to_polar(xy - self.origin)
        off = np.abs(wrap(polar[:, 1] - self.middle))
        return ((polar[:, 0] <= self.farthest) & (off <= self.width / 2)).astype(float)
