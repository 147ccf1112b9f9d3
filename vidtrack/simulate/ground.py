"""What the ground is made of: surfaces, and the strips, dashes and stripes of a road."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.simulate.scene import Colour, Part

ASPHALT: tuple[Colour, float] = ((96, 97, 98), 3.5)
GRASS: tuple[Colour, float] = ((58, 112, 88), 9.0)
PAVING: tuple[Colour, float] = ((138, 142, 146), 5.0)
KERB: tuple[Colour, float] = ((172, 175, 177), 3.0)
PAINT: tuple[Colour, float] = ((218, 222, 224), 4.0)
YELLOW: tuple[Colour, float] = ((70, 176, 206), 4.0)
WALL: tuple[Colour, float] = ((120, 150, 172), 3.0)
ROOF: tuple[Colour, float] = ((74, 82, 122), 4.0)


class Axes:
    """Road coordinates: a along, b to the right of a road through `origin`, whose direction is `angle` (radians)."""

    def __init__(self, origin: tuple[float, float], angle: float) -> None:
        self.origin = np.array(origin)
        self.turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])

    def __call__(self, a: float, b: float) -> tuple[float, float]:
        """Scene coordinates of (a, b)."""
        x, y = self.origin + np.array([a, b]) @ self.turn
        return float(x), float(y)

    def area(self, a0: float, a1: float, b0: float, b1: float) -> Floats:
        """The rectangle a0..a1, b0..b1 as a polygon (4, 2)."""
        return np.array([self(a0, b0), self(a1, b0), self(a1, b1), self(a0, b1)])

    def patch(self, surface: tuple[Colour, float], a0: float, a1: float, b0: float, b1: float) -> Part:
        """The rectangle in one surface."""
        return Part(self.area(a0, a1, b0, b1), *surface)

    def dashes(self, a0: float, a1: float, b: float, on: float, off: float, width: float = 1.4) -> list[Part]:
        """A broken line along the road."""
        starts = np.arange(a0, a1, on + off)
        return [self.patch(PAINT, a, min(a + on, a1), b - width / 2, b + width / 2) for a in starts]

    def zebra(self, a0: float, a1: float, b0: float, b1: float, stripe: float = 4.0) -> list[Part]:
        """A pedestrian crossing over the road, its stripes along the road."""
        return [self.patch(PAINT, a0, a1, b, min(b + stripe, b1)) for b in np.arange(b0 + stripe / 2, b1, 2 * stripe)]
