"""Four places: a road with a crossing, a junction with a major road, a roundabout and a motorway."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.simulate.ground import ASPHALT, GRASS, KERB, PAINT, PAVING, Axes
from vidtrack.simulate.roads.layout import ARMS, EAST, LANE_M, MARK_M, WEST, WORN, GroundGate, Layout, at, corner, disc
from vidtrack.simulate.roads.network import Network, Route, smooth
from vidtrack.simulate.scene import Part

ORDER = ("east", "north", "west", "south")
CYCLE_S, RED_S = 45.0, 14.0
CROSSING_X = (29.0, 32.0)  # m; of the pedestrian crossing in `road`


def road() -> Layout:
    """A street with one lane each way and a pedestrian crossing with a signal."""
    far, y = 170.0, LANE_M / 2
    lanes = [
        Route(
            smooth([(-far, -y), (far, -y)], 2), "west", "east", "west", 13.9, stop_m=far + CROSSING_X[0] - 2, red=_red
        ),
        Route(smooth([(far, y), (-far, y)], 2), "east", "west", "east", 13.9, stop_m=far - CROSSING_X[1] - 2, red=_red),
    ]
    gates = {
        "west_in": GroundGate(at((0, -LANE_M), (0, 0)), "west", "entry"),
        "west_out": GroundGate(at((0, 0), (0, LANE_M)), "west", "exit"),
        "east_in": GroundGate(at((50, 0), (50, LANE_M)), "east", "entry"),
        "east_out": GroundGate(at((50, -LANE_M), (50, 0)), "east", "exit"),
    }
    first, last = CROSSING_X
    ground = (
        EAST.patch(PAVING, -far, far, -6.5, 6.5),
        EAST.patch(KERB, -far, far, -3.9, 3.9),
        EAST.patch(ASPHALT, -far, far, -3.75, 3.75),
        *_wheel_marks(EAST, -far, far, (-y, y)),
        *EAST.dashes(-far, first - 3, 0, 3, 6, MARK_M),
        *EAST.dashes(last + 3, far, 0, 3, 6, MARK_M),
        *EAST.zebra(first, last, -LANE_M, LANE_M, 0.5),
        EAST.patch(PAINT, first - 2, first - 1.6, -LANE_M, -0.1),
        EAST.patch(PAINT, last + 1.6, last + 2, 0.1, LANE_M),
    )
    return Layout(
        network=Network(lanes),
        ground=ground,
        gates=gates,
        zones={"crossing": EAST.area(first, last, -LANE_M, LANE_M)},
        sections={"eastbound": ("west_in", "east_out", 50.0), "westbound": ("east_in", "west_out", 50.0)},
        survey=np.array([*product((-6, 3, 12, 21, 30, 40, 52), (-3.75, 3.75))]),
        aim=(2.0, 0.0),
        azimuth=np.radians(40),
        tilt=np.radians(18),
        flow=900,
    )


def junction_3d() -> Layout:
    """A crossroads; who comes from the north or the south gives way."""
    far, y, box = 130.0, LANE_M / 2, 12.0
    routes: list[Route] = []
    gates: dict[str, GroundGate] = {}
    for k, leg in enumerate(ORDER):
        arm, major = ARMS[leg], leg in ("east", "west")
        for turn, rank, share, radius in (("left", 1, 0.15, 8.0), ("straight", 0, 0.65, 0.0), ("right", 0, 0.2, 6.0)):
            to = ORDER[(k + {"right": 1, "straight": 2, "left": 3}[turn]) % 4]
            part = share * (2.0 if major else 1.0)
            points = _through(arm, ARMS[to], far, y, radius)
            routes.append(
                Route(smooth(points, 1.5), leg, to, leg, 13.9 if major else 11.0, part, rank + (0 if major else 2),
                      stop_m=far - 8.2, long=turn == "straight")
            )  # fmt: skip
        gates |= _leg_gates(leg, arm, box, 0, LANE_M)
    ground: list[Part] = []
    for leg in ("north", "south", "east", "west"):
        arm = ARMS[leg]
        ground += [arm.patch(PAVING, 3, far, -6.2, 6.2)]
    for leg in ("north", "south", "east", "west"):
        arm = ARMS[leg]
        ground += [arm.patch(KERB, 3, far, -3.9, 3.9)]
    ground += [corner(arm, 3.75, 4.0) for arm in ARMS.values()]
    ground += [arm.patch(ASPHALT, 0, far, -3.75, 3.75) for arm in ARMS.values()]
    for leg, arm in ARMS.items():
        ground += _wheel_marks(arm, 9, far, (-y, y))
        ground += [arm.patch(PAINT, 9, far, -MARK_M / 2, MARK_M / 2)] if leg in ("north", "south") else []
        ground += arm.dashes(9, far, 0, 3, 3, MARK_M) if leg in ("east", "west") else []
        if leg in ("north", "south"):
            ground += [arm.patch(PAINT, 7.6, 8.0, b, b + 0.6) for b in np.arange(0.2, 3.3, 0.9)]
    survey = [arm(a, b) for arm in ARMS.values() for a, b in ((8.0, -3.75), (8.0, 3.75), (12.0, 0.0), (20.0, 0.0))]
    return Layout(
        network=Network(routes),
        ground=tuple(ground),
        gates=gates,
        zones={"box": at((-8, -8), (8, -8), (8, 8), (-8, 8))},
        sections={"major": ("west_in", "east_out", 2 * box)},
        survey=np.array(survey),
        aim=(0.0, 0.0),
        azimuth=np.radians(50),
        tilt=np.radians(17),
        flow=1000,
    )


def roundabout() -> Layout:
    """A compact roundabout with four legs: who drives in the ring has the right of way."""
    far, ring, aside, join = 130.0, 11.5, 2.6, np.radians(50)
    routes: list[Route] = []
    gates: dict[str, GroundGate] = {}
    for k, leg in enumerate(ORDER):
        angle = k * np.pi / 2
        for turns, share in ((1, 0.25), (2, 0.5), (3, 0.25)):
            to = ORDER[(k + turns) % 4]
            on = np.arange(angle + join, angle + turns * np.pi / 2 - join + 1e-6, np.radians(3))
            points = [ARMS[leg](far, aside), ARMS[leg](17.0, aside)]
            points += [(float(ring * np.cos(p)), float(ring * np.sin(p))) for p in on]
            points += [ARMS[to](17.0, -aside), ARMS[to](far, -aside)]
            routes.append(Route(smooth(points, 3.0), leg, to, leg, 11.0, share))
        gates |= _leg_gates(leg, ARMS[leg], 16.5, 0.7, 4.5)
    ground: list[Part] = [arm.patch(KERB, 8, far, -4.75, 4.75) for arm in ARMS.values()]
    ground += [disc(15.45, *KERB), disc(15.3, *ASPHALT)]
    for arm in ARMS.values():
        ground += [arm.patch(ASPHALT, 10, far, -4.6, 4.6), *_wheel_marks(arm, 19, far, (-aside, aside))]
    ground += [disc(8.6, *KERB), disc(8.4, *PAVING), disc(7.2, *GRASS)]
    for arm in ARMS.values():
        ground.append(Part(np.array([arm(16.0, -0.6), arm(16.0, 0.6), arm(30, 0.15), arm(30, -0.15)]), *KERB))
        ground.append(arm.patch(PAINT, 30, far, -MARK_M / 2, MARK_M / 2))
        ground += [arm.patch(PAINT, 15.4, 15.8, b, b + 0.5) for b in np.arange(0.9, 4.3, 0.9)]
    survey = [arm(a, b) for arm in ARMS.values() for a, b in ((8.6, 0.0), (16.0, 0.0), (17.0, 4.6), (17.0, -4.6))]
    return Layout(
        network=Network(routes, reach=9.0),
        ground=tuple(ground),
        gates=gates,
        zones={"ring": disc(15.3, *ASPHALT).polygon},
        sections={},
        survey=np.array(survey),
        aim=(0.0, 1.0),
        azimuth=np.radians(50),
        tilt=np.radians(12),
        flow=1000,
    )


def motorway() -> Layout:
    """Two carriageways of three lanes each; vehicles overtake on the left."""
    back, ahead, width = -260.0, 420.0, 3.75
    routes: list[Route] = []
    for origin, leg, to in (("west", "west", "east"), ("east", "east", "west")):
        base = len(routes)
        for lane, share in enumerate((0.42, 0.36, 0.22)):  # from the right
            y = 2.5 + (2.5 - lane) * width
            points = [(back, -y), (ahead, -y)] if origin == "west" else [(ahead, y), (back, y)]
            routes.append(
                Route(smooth(points, 2), leg, to, f"{origin} {lane}", 33.3, share, long=lane < 2,
                      left=base + lane + 1 if lane < 2 else -1, right=base + lane - 1 if lane else -1)
            )  # fmt: skip
    edge = 2.5 + 3 * width
    gates = {
        "west_in": GroundGate(at((-5, -edge - 0.5), (-5, -2)), "west", "entry"),
        "west_out": GroundGate(at((0, 2), (0, edge + 0.5)), "west", "exit"),
        "east_in": GroundGate(at((50, 2), (50, edge + 0.5)), "east", "entry"),
        "east_out": GroundGate(at((25, -edge - 0.5), (25, -2)), "east", "exit"),
    }
    ground: list[Part] = []
    for way, start, end in ((EAST, back - 60, ahead + 200), (WEST, -ahead - 200, -back + 60)):
        ground.append(way.patch(ASPHALT, start, end, -edge - 3, -1.6))
        ground += _wheel_marks(way, start, end, tuple(-2.5 - (k + 0.5) * width for k in range(3)))
        ground += [way.patch(PAINT, start, end, b - 0.1, b + 0.1) for b in (-2.5, -edge)]
        ground += [dash for k in (1, 2) for dash in way.dashes(start, end, -2.5 - k * width, 6, 12, 0.16)]
    survey = [*product((-8, 4, 16, 28, 40), (-edge, -2.5)), *product((4, 20, 36, 60), (2.5, edge))]
    return Layout(
        network=Network(routes),
        ground=tuple(ground),
        gates=gates,
        zones={"eastbound": at((-5, -edge), (25, -edge), (25, -2.5), (-5, -2.5))},
        sections={"eastbound": ("west_in", "east_out", 30.0), "westbound": ("east_in", "west_out", 50.0)},
        survey=np.array(survey, float),
        aim=(6.0, -2.0),
        azimuth=np.radians(42),
        tilt=np.radians(14),
        flow=6000,
        warm_s=40.0,
    )


ROADS: dict[str, Callable[[], Layout]] = {
    "road": road,
    "junction-3d": junction_3d,
    "roundabout": roundabout,
    "motorway": motorway,
}


def _red(time: float) -> bool:
    """Whether the signal of the pedestrian crossing is amber or red."""
    return (time - 8.0) % CYCLE_S < RED_S


def _through(start: Axes, end: Axes, far: float, y: float, radius: float) -> list[tuple[float, float]]:
    """From one arm of a junction to another, in the right lane of each, with an arc of `radius` m (0: straight on)."""
    first, last = start(far, y), end(far, -y)
    if radius == 0:
        return [first, last]
    meet = _meeting(start, end, y)
    enter, leave = (meet + radius * arm.turn[0] for arm in (start, end))
    centre = enter + leave - meet
    angles = [np.arctan2(*(p - centre)[::-1]) for p in (enter, leave)]
    swept = angles[0] + np.linspace(0, 1, 17) * np.angle(np.exp(1j * (angles[1] - angles[0])))
    arc = centre + radius * np.column_stack([np.cos(swept), np.sin(swept)])
    return [first, *((float(px), float(py)) for px, py in arc), last]


def _meeting(start: Axes, end: Axes, y: float) -> Floats:
    """Where the lane that comes along `start` meets the one that leaves along `end`."""
    return np.asarray(y * start.turn[1] - y * end.turn[1])


def _leg_gates(leg: str, arm: Axes, away: float, inner: float, outer: float) -> dict[str, GroundGate]:
    """A gate over the lane that comes in and one over the lane that goes out."""
    return {
        f"{leg}_in": GroundGate(at(arm(away, inner), arm(away, outer)), leg, "entry"),
        f"{leg}_out": GroundGate(at(arm(away, -outer), arm(away, -inner)), leg, "exit"),
    }


def _wheel_marks(way: Axes, start: float, end: float, lanes: tuple[float, ...]) -> list[Part]:
    """Tracks worn by wheels along lanes at these offsets."""
    return [way.patch(WORN, start, end, b + w - 0.3, b + w + 0.3) for b in lanes for w in (-0.8, 0.8)]
