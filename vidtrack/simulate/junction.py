"""A T-junction with people, a motorcycle, cars and a lorry (paper 004, figures 7 to 9).

Traffic keeps to the right. The main road runs across the picture, its right end lower; the side road leaves it
upwards. In road coordinates the main road's axis is b = 0, west is towards smaller a.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.random import Generator

from vidtrack.arrays.types import Floats
from vidtrack.simulate.ground import ASPHALT, GRASS, KERB, PAINT, PAVING, ROOF, WALL, YELLOW, Axes
from vidtrack.simulate.looks import CAR_COLOURS, CLOTHES, SKIN, car, foliage, lorry, motorcycle, person
from vidtrack.simulate.motion import cruise, distance_to, route, sway
from vidtrack.simulate.scene import Actor, Colour, Look, Part, Scene, bounds, inside, touching

SIZE = (240, 180)
FPS = 15.0
DURATION_S = 17.0
ROAD = Axes((120.0, 97.0), np.radians(11))
END = 150.0  # px along the main road from its origin to well outside the picture
HALF = 24.0  # px, half the width of the main road
LANE = 12.0  # px from the axis of the main road to the middle of a lane
SIDE, SIDE_HALF = -38.0, 21.0  # px, where the side road joins, half its width
STOP_LINE = 22.0  # px along the main road
GREY: Colour = (146, 147, 149)
WHITE: Colour = (236, 238, 239)
LOADS: tuple[Colour, ...] = ((225, 225, 222), (150, 96, 52))


def junction(rng: Generator) -> Scene:
    """Draws traffic until no two vehicles come closer than 2 px and everyone can be told apart (`_can_be_followed`)."""
    while True:
        targets = (*_vehicles(rng), *_people(rng))
        if _can_be_followed(targets):
            return Scene(SIZE, FPS, DURATION_S, _ground(), targets, _tree(rng), sun=(0.28, 0.2))


def _vehicles(rng: Generator) -> list[Actor]:
    """Who drives where: name, look, route, speed [px/s], place along the main road and the time [s] it is passed.

    The grey car is on the stop line at 2 s. It leaves the line as a ghost in a running average, which is about to
    fade when the white car arrives.
    """
    paints = iter(rng.permutation(len(CAR_COLOURS)))
    west = route(ROAD(END, -LANE), ROAD(-END, -LANE))
    east = route(ROAD(-END, LANE), ROAD(END, LANE))
    north, south = SIDE + SIDE_HALF / 2, SIDE - SIDE_HALF / 2
    west_north = route(ROAD(END, -LANE), ROAD(north, -LANE), ROAD(north, -END), radius=14)
    east_north = route(ROAD(-END, LANE), ROAD(north, LANE), ROAD(north, -END), radius=20)
    south_west = route(ROAD(south, -END), ROAD(south, -LANE), ROAD(-END, -LANE), radius=14)
    south_east = route(ROAD(south, -END), ROAD(south, LANE), ROAD(END, LANE), radius=20)

    def drives(name: str, look: Look, line: Floats, speed: float, a: float, t: float) -> Actor:
        aside = np.array(ROAD(0, rng.uniform(-1.2, 1.2))) - ROAD(0, 0)
        speed, t = speed * rng.uniform(0.94, 1.06), t + rng.uniform(-0.3, 0.3)
        return Actor(name, look, cruise(line + aside, speed, distance_to(line, ROAD(a, 0)), t, DURATION_S, rng))

    def steady(name: str, look: Look, t: float) -> Actor:
        return Actor(name, look, cruise(west, pace, END - STOP_LINE, t, DURATION_S, rng, vary=0.0))

    def some_car() -> Look:
        return car(rng.uniform(27, 31), rng.uniform(13, 14.5), CAR_COLOURS[next(paints)])

    load = LOADS[rng.integers(len(LOADS))]
    pace = 45 * rng.uniform(0.97, 1.03)
    return [
        steady("grey car", car(30, 14, GREY), 2.0),
        steady("white car", car(29, 14, WHITE), 2.0 + rng.uniform(1.7, 1.9)),
        drives("car east", some_car(), east, 54, -20, 4.1),
        drives("car from the east into the side road", some_car(), west_north, 40, north, 7.0),
        drives("lorry", lorry(50, 20, CAR_COLOURS[next(paints)], load), east, 44, 0, 7.6),
        drives("car from the side road to the west", some_car(), south_west, 38, south, 8.9),
        drives("motorcycle", motorcycle(14, 8, CAR_COLOURS[next(paints)], CLOTHES[0]), west, 62, SIDE, 10.6),
        drives("car from the side road to the east", some_car(), south_east, 40, south, 12.0),
        drives("car west", some_car(), west, 50, SIDE, 14.2),
        drives("car from the west into the side road", some_car(), east_north, 40, north, 16.0),
    ]


def _people(rng: Generator) -> list[Actor]:
    """Two on the lower pavement in opposite directions, one across the main road, one across the side road."""
    lower = HALF + 7
    walks = (
        (route(ROAD(95, lower + 1), ROAD(-END, lower + 1)), 11.0, 0.0),
        (route(ROAD(-END, lower + 8), ROAD(END, lower + 8)), 15.0, 1.0),
        (route(ROAD(12, 110), ROAD(12, -HALF - 4), ROAD(END, -HALF - 4), radius=4), 19.0, 5.6),
        (route(ROAD(-100, -HALF - 4), ROAD(END, -HALF - 4)), 13.0, 0.0),
    )
    clothes = rng.permutation(len(CLOTHES))
    people = []
    for i, (line, speed, start) in enumerate(walks):
        look = person(6, rng.uniform(13.2, 14.5), CLOTHES[clothes[i]], (70, 58, 48), SKIN[rng.integers(len(SKIN))])
        pace, begin = speed * rng.uniform(0.95, 1.05), start + rng.uniform(-0.3, 0.3)
        people.append(Actor(f"person {i + 1}", look, cruise(line, pace, 0.0, begin, DURATION_S, rng)))
    return people


def _can_be_followed(targets: tuple[Actor, ...]) -> bool:
    """Nobody is run over; all are in view for 1.5 s at least; no two are one blob for over 1.5 s, but some are."""
    times = np.arange(round(DURATION_S * FPS)) / FPS
    outlines = [actor.outline(times) for actor in targets]
    bases = [actor.place(actor.look.base, times) for actor in targets]
    boxes = np.stack([bounds(outline) for outline in outlines])
    if inside(boxes, SIZE).sum(axis=1).min() < 1.5 * FPS:
        return False
    seen = np.all((boxes[..., 2:] > 0) & (boxes[..., :2] < SIZE), axis=-1)
    merges = 0
    for i, j in combinations(range(len(targets)), 2):
        both = seen[i] & seen[j]
        if touching(bases[i][both], bases[j][both], margin=2.0).any():
            return False
        together = touching(outlines[i][both], outlines[j][both]).sum()
        if together > 1.5 * FPS:
            return False
        merges += together >= 3
    return 1 <= merges <= 6


def _tree(rng: Generator) -> tuple[Actor, ...]:
    """A tree in the lower left corner: clumps of leaves, each in its own wind."""
    clumps = [(14, 150, 17), (34, 158, 16), (8, 168, 18), (26, 172, 19), (44, 174, 14), (22, 158, 17)]
    return tuple(
        Actor("leaves", foliage(radius, rng), sway((x, y), 1.3, DURATION_S, rng), layer=1) for x, y, radius in clumps
    )


def _ground() -> tuple[Part, ...]:
    left, right = SIDE - SIDE_HALF, SIDE + SIDE_HALF
    return (
        ROAD.patch(GRASS, -2 * END, 2 * END, -2 * END, 2 * END),
        ROAD.patch(PAVING, -END, END, -HALF - 12, HALF + 20),
        ROAD.patch(PAVING, left - 9, right + 9, -END, -HALF),
        ROAD.patch(PAVING, 4, 20, HALF, END),
        ROAD.patch(WALL, 30, END, -END, -HALF - 21),
        ROAD.patch(ROOF, 30, END, -END, -HALF - 29),
        ROAD.patch(KERB, -END, END, -HALF - 2, HALF + 2),
        ROAD.patch(KERB, left - 2, right + 2, -END, -HALF),
        ROAD.patch(ASPHALT, -END, END, -HALF, HALF),
        ROAD.patch(ASPHALT, left, right, -END, 0),
        *ROAD.dashes(-END, left - 8, 0, 9, 7),
        *ROAD.dashes(STOP_LINE + 12, END, 0, 9, 7),
        *ROAD.zebra(6, 17, -HALF, HALF),
        ROAD.patch(PAINT, STOP_LINE - 2.5, STOP_LINE + 2.5, -HALF + 1, -0.5),
        ROAD.patch(YELLOW, SIDE - 0.7, SIDE + 0.7, -END, -HALF - 14),
    )
