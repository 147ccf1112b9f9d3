"""Nine vehicles that cross on an open yard (in the spirit of paper 004, figure 6)."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.random import Generator

from vidtrack.simulate.ground import ASPHALT, PAVING, Axes
from vidtrack.simulate.looks import CAR_COLOURS, car, lorry
from vidtrack.simulate.motion import drive, jerky, route
from vidtrack.simulate.scene import Actor, Part, Scene, bounds, inside, touching

SIZE = (320, 240)
FPS = 15.0
DURATION_S = 8.0
SPEED = 45.0  # px/s: 3 px a frame
FAR = 500.0

# Degrees; two of them as in the paper: one from the lower left to the upper right, one from the left to the bottom.
HEADINGS_DEG = (-38.0, 62.0, 0.0, 180.0, 90.0, -90.0, 140.0, -142.0, 22.0)


def nine(rng: Generator) -> Scene:
    """Draws motions until every vehicle is in full view for 2 s, and three to eight pairs touch.

    They touch for 1.2 s at most, and have been apart and in full view for 0.6 s before.
    """
    while True:
        vehicles = tuple(_vehicle(i, heading, rng) for i, heading in enumerate(np.radians(HEADINGS_DEG)))
        if _cross_well(vehicles):
            return Scene(SIZE, FPS, DURATION_S, _yard(), vehicles)


def _vehicle(i: int, heading: float, rng: Generator) -> Actor:
    """A vehicle that passes a random place near the middle of the picture about half-way through the clip."""
    x, y = np.array(SIZE) / 2 + rng.uniform(-1, 1, 2) * (70, 50)
    way = Axes((float(x), float(y)), heading + rng.uniform(-0.12, 0.12))
    t, s = jerky(SPEED, DURATION_S, rng, share=0.17)
    passing = DURATION_S / 2 + rng.uniform(-1.2, 1.2)
    path = drive(route(way(-FAR, 0), way(FAR, 0)), t, FAR + s - np.interp(passing, t, s))
    colour = CAR_COLOURS[i % len(CAR_COLOURS)]
    look = lorry(28, 12, colour, CAR_COLOURS[1]) if i == 4 else car(20, 10, colour)
    return Actor(f"vehicle {i + 1}", look, path, layer=i)


def _cross_well(vehicles: tuple[Actor, ...]) -> bool:
    times = np.arange(round(DURATION_S * FPS)) / FPS
    outlines = [vehicle.outline(times) for vehicle in vehicles]
    in_view = np.stack([inside(bounds(outline), SIZE) for outline in outlines])
    if in_view.sum(axis=1).min() < 2 * FPS:
        return False
    meetings = 0
    for i, j in combinations(range(len(vehicles)), 2):
        together = np.flatnonzero(touching(outlines[i], outlines[j]))
        if len(together) == 0:
            continue
        apart = slice(max(together[0] - round(0.6 * FPS), 0), together[0])
        if len(together) > 1.2 * FPS or not (in_view[i] & in_view[j])[apart].all():
            return False
        meetings += 1
    return 3 <= meetings <= 8


def _yard() -> tuple[Part, ...]:
    """Asphalt with a paved edge and the bays of a car park along it."""
    plane = Axes((0, 0), 0)
    width, height = SIZE
    bays = [
        plane.patch(((190, 192, 194), 4.0), x, x + 1.5, y, y + 16)
        for x in range(24, width - 20, 17)
        for y in (8, height - 24)
    ]
    return (
        plane.patch(PAVING, -FAR, FAR, -FAR, FAR),
        plane.patch(ASPHALT, 7, width - 7, 7, height - 7),
        *bays,
    )
