"""Two vehicles that cross in mid-picture and are one blob for a while (paper 004, figure 5)."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from vidtrack.simulate.ground import ASPHALT, GRASS, KERB, Axes
from vidtrack.simulate.looks import CAR_COLOURS, car
from vidtrack.simulate.motion import drive, jerky, route
from vidtrack.simulate.scene import Actor, Part, Scene, bounds, inside, touching

SIZE = (320, 240)
FPS = 15.0
DURATION_S = 10.0
MEET_S = 5.0
SPEED = 30.0  # px/s: the 2 px a frame of the paper's experiment
LENGTH, WIDTH = 20.0, 10.0
FAR = 400.0  # px; longer than any way through the picture


def crossing(rng: Generator) -> Scene:
    """One vehicle goes from the bottom to the top, one from left to right."""
    return _crossing(rng, turn=0.0)


def crossing_45(rng: Generator) -> Scene:
    """The same, turned by 45 degrees about the middle of the picture."""
    return _crossing(rng, turn=np.radians(45))


def _crossing(rng: Generator, turn: float) -> Scene:
    """Draws motions until the vehicles overlap for 0.6 to 2 s, with a second apart in full view on either side."""
    middle = SIZE[0] / 2, SIZE[1] / 2
    roads = Axes(middle, turn - np.pi / 2), Axes(middle, turn)
    colours = rng.choice(len(CAR_COLOURS), 2, replace=False)
    while True:
        cars = tuple(_vehicle(f"car {i + 1}", roads[i], int(colours[i]), layer=i, rng=rng) for i in (0, 1))
        if _meet_well(cars[0], cars[1]):
            return Scene(SIZE, FPS, DURATION_S, _ground(roads), cars)


def _vehicle(name: str, road: Axes, colour: int, layer: int, rng: Generator) -> Actor:
    t, s = jerky(SPEED, DURATION_S, rng)
    late, aside = rng.uniform(-6, 6), rng.uniform(-2, 2)
    path = drive(route(road(-FAR, aside), road(FAR, aside)), t, FAR + late + s - np.interp(MEET_S, t, s))
    return Actor(name, car(LENGTH, WIDTH, CAR_COLOURS[colour]), path, layer)


def _meet_well(a: Actor, b: Actor) -> bool:
    times = np.arange(round(DURATION_S * FPS)) / FPS
    one, other = a.outline(times), b.outline(times)
    together = np.flatnonzero(touching(one, other))
    if not 0.6 * FPS <= len(together) <= 2 * FPS or np.ptp(together) + 1 != len(together):
        return False
    clear = inside(bounds(one), SIZE) & inside(bounds(other), SIZE)
    second = int(FPS)
    return bool(clear[together[0] - second : together[-1] + second + 1].all() and together[-1] + second < len(times))


def _ground(roads: tuple[Axes, Axes]) -> tuple[Part, ...]:
    half = 15.0
    strips = [road.patch(KERB, -FAR, FAR, -half - 2, half + 2) for road in roads]
    strips += [road.patch(ASPHALT, -FAR, FAR, -half, half) for road in roads]
    lines = [dash for road in roads for end in (-FAR, half + 6) for dash in _centre_line(road, end, half)]
    return (Axes((0, 0), 0).patch(GRASS, -FAR, FAR, -FAR, FAR), *strips, *lines)


def _centre_line(road: Axes, start: float, half: float) -> list[Part]:
    """Dashes from `start` to the junction or away from it; off the axis the vehicles follow by half the road."""
    end = -half - 6 if start < 0 else FAR
    return [*road.dashes(start, end, half - 3, 10, 8), *road.dashes(start, end, 3 - half, 10, 8)]
