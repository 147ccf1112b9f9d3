"""What a scenario is made of: routes, surfaces, gates, and where the camera looks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.simulate.ground import ASPHALT, Axes
from vidtrack.simulate.roads.network import Network
from vidtrack.simulate.scene import Colour, Part

LANE_M = 3.5
MARK_M = 0.14
EAST = Axes((0, 0), 0)
WEST = Axes((0, 0), np.pi)
NORTH = Axes((0, 0), np.pi / 2)
SOUTH = Axes((0, 0), -np.pi / 2)
ARMS = {"east": EAST, "north": NORTH, "west": WEST, "south": SOUTH}
"""Axes of the four arms of a junction: a leads outwards, b to the left of it."""
WORN: tuple[Colour, float] = ((88, 89, 91), 3.0)


@dataclass(frozen=True, slots=True, eq=False)
class GroundGate:
    """A counting line (2, 2) m on the ground, on a leg; role: entry, exit or both."""

    line: Floats
    leg: str
    role: str


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """A scenario without its traffic.

    ground    surfaces and marks in metres, painted in this order; what none covers is grass
    gates, zones  by name; lines (2, 2) and polygons (V, 2) in metres
    sections  by name: two gates and the length between them along the road, m
    survey    (C, 2) m; points that are easily found in the picture
    aim, azimuth, tilt  where the camera's axis meets the road (m), rad from east, rad below the horizon
    flow      vehicles/h in all
    warm_s    time for the vehicles to spread over the road
    """

    network: Network
    ground: tuple[Part, ...]
    gates: dict[str, GroundGate]
    zones: dict[str, Floats]
    sections: dict[str, tuple[str, str, float]]
    survey: Floats
    aim: tuple[float, float]
    azimuth: float
    tilt: float
    flow: float
    warm_s: float = 60.0

    @property
    def movements(self) -> list[tuple[str, str]]:
        """Legs from which and to which there are routes, in order."""
        return list(dict.fromkeys((route.start, route.end) for route in self.network.routes))


def at(*points: tuple[float, float]) -> Floats:
    """A line or a polygon."""
    return np.array(points, float)


def disc(radius: float, colour: Colour, grain: float) -> Part:
    """A circle about the origin."""
    angle = np.linspace(0, 2 * np.pi, 73)[:-1]
    return Part(radius * np.column_stack([np.cos(angle), np.sin(angle)]), colour, grain)


def corner(arm: Axes, near: float, radius: float) -> Part:
    """The asphalt inside a rounded kerb, between an arm and the next one to its left."""
    angle = np.linspace(np.pi, 1.5 * np.pi, 13)
    arc = near + radius + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return Part(np.array([arm(a, b) for a, b in [(near - 0.1, near - 0.1), *arc[::-1]]]), *ASPHALT)
