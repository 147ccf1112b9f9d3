"""Radar scenarios by name: which radar looks at whom. Each is drawn anew until its guarantees hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.random import Generator

from vidtrack.amplitude.densities import Weibull
from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError
from vidtrack.simulate.flight import Flight, G, Leg, fly, sidestep, swing, weave
from vidtrack.simulate.radar import Patch, Radar, Seen, Target, observe

MOST_FALSE_PLOTS = 3e6
"""In all scans together; more would fill the memory."""

Draw = Callable[[Generator], list[Target]]
Holds = Callable[[Seen], bool]

SURVEILLANCE = Radar(
    scan_s=4.0,
    low=(2_000.0, 0.0),
    high=(60_000.0, 360.0),
    cell=(150.0, 1.5),
    sigma=(40.0, 0.3),
    snr_db=20.0,
    p_fa=1e-4,
    clutter=Weibull(1.5, np.log(2)),
)
"""Track while scan: 92,800 resolution cells, 9.3 false plots a scan in Weibull clutter, P_D = 0.86."""

FINE = replace(SURVEILLANCE, cell=(1.0, 0.01), p_fa=5e-9, clutter=Weibull())
"""Cells so small that all is resolved; Rayleigh clutter, 10.4 false plots a scan, P_D = 0.83."""

COARSE = replace(SURVEILLANCE, clutter=Weibull())
"""Track while scan in Rayleigh clutter, P_D = 0.91."""

UNEVEN = replace(COARSE, patches=(Patch((10e3, 20.0), (30e3, 70.0), 29.0), Patch((35e3, 150.0), (55e3, 240.0), 19.0)))
"""The same with two patches of land, from which come 13 and 15 false plots a scan more."""

MULTIFUNCTION = Radar(
    scan_s=1 / 7.7,
    low=(1_000.0, 0.0, -3.0),
    high=(80_000.0, 360.0, 90.0),
    cell=(30.0, 1.0, 1.0),
    sigma=(5.0, 0.04, 0.04),
)
"""The multi-function radar of paper 003: range, azimuth and elevation 7.7 times a second, each target seen."""


def tws(rng: Generator) -> list[Target]:
    """Eight aircraft; the first two turn with 2.5 g, the third appears late, the fourth disappears early."""
    targets = [Target(anywhere(rng, turning=k < 2)) for k in range(8)]
    targets[2] = replace(targets[2], start_s=rng.uniform(40, 80))
    targets[3] = replace(targets[3], end_s=rng.uniform(160, 200))
    return targets


def incoming(rng: Generator) -> list[Target]:
    """SPEC 003, S1: an aircraft comes in at constant velocity, 3 km high."""
    return [Target(fly((20e3, 40e3, 3e3), (-150, -250, 0)))]


def altitude(rng: Generator) -> list[Target]:
    """SPEC 003, S2: from 8 s on the altitude swings by 300 m in 20 s."""
    return [Target(weave(fly((8e3, 28e3, 3e3), (-100, -280, 0)), amplitude=300, period_s=20, from_s=8))]


def speed(rng: Generator) -> list[Target]:
    """SPEC 003, S3: radially in from 60 km with 200 m/s, 2.5 g from 10 s until it makes 350 m/s."""
    heading = np.array([0.6, 0.79, np.sqrt(1 - 0.6**2 - 0.79**2)])
    legs = (Leg(10.0), Leg(150 / (2.5 * G), accel=2.5 * G), Leg(np.inf))
    return [Target(fly(60e3 * heading, -200 * heading, legs))]


def crossing(rng: Generator) -> list[Target]:
    """Two aircraft whose paths cross at 12 to 30 degrees; one is there 0.3 s before the other, at half time."""
    middle = _place(rng, 20e3, 30e3)
    course, angle = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(12, 30))
    return [
        Target(_through(middle, course + side * angle / 2, rng.uniform(180, 220), 100 + 0.15 * side))
        for side in (-1, 1)
    ]


def unresolved(rng: Generator) -> list[Target]:
    """Two aircraft on one course close in from 2.4 km to 60 m, fly so for a minute and a half, and part again."""
    course = rng.uniform(0, 2 * np.pi)
    flight = _through(_place(rng, 15e3, 30e3), course, rng.uniform(180, 220), 100.0)
    across = 1200 * np.array([np.cos(course), -np.sin(course), 0.0])
    times = (20.0, 55.0, 145.0, 180.0)
    return [Target(sidestep(flight, side * across, near=1 / 40, times_s=times)) for side in (-1, 1)]


def parting(rng: Generator) -> list[Target]:
    """Two aircraft come together as in `unresolved`, stay so for 10 to 90 s, and part; half of the pairs cross."""
    course = rng.uniform(0, 2 * np.pi)
    flight = _through(_place(rng, 15e3, 30e3), course, rng.uniform(180, 220), 100.0)
    across = 1200 * np.array([np.cos(course), -np.sin(course), 0.0])
    half = rng.uniform(5.0, 45.0)
    times = (65.0 - half, 100.0 - half, 100.0 + half, 135.0 + half)
    after = float(rng.choice([1.0, -1.0]))
    return [Target(sidestep(flight, side * across, near=1 / 40, times_s=times, after=after)) for side in (-1, 1)]


def weaving(rng: Generator) -> list[Target]:
    """Four aircraft that weave from side to side all the time, with 1 to 4 g in 20 to 60 s."""
    return [Target(_from_side_to_side(rng)) for _ in range(4)]


def _all_seen(seen: Seen) -> bool:
    return bool(seen.there.all())


def _apart(seen: Seen) -> bool:
    """No two aircraft come within 1.5 km of each other, and each stays in the coverage."""
    p = seen.states[..., :2]
    distance = np.linalg.norm(p[:, None] - p[None], axis=-1)
    inside = all(seen.radar.covers(target).all() for target in seen.states[..., :3])
    return inside and bool(distance[np.triu_indices(len(p), 1)].min() > 1500)


def _crosses(seen: Seen) -> bool:
    """Within 100 m of each other at half time, more than 3 km apart in the first and last scans."""
    distance = np.linalg.norm(seen.states[0, :, :2] - seen.states[1, :, :2], axis=1)
    return _all_seen(seen) and distance.min() < 100 and distance[[0, -1]].min() > 3000


def _shares_a_cell(seen: Seen, scans: int = 20) -> bool:
    """One echo for so many scans in a row, each its own in the first and the last five."""
    merged = seen.merged[0]
    ends = merged[:5].any() or merged[-5:].any()
    run = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], merged, [0]]))))[::2].max(initial=0)
    return _all_seen(seen) and not ends and run >= scans


def _any(seen: Seen) -> bool:
    """Nothing is asked."""
    return True


def _meets(seen: Seen) -> bool:
    """The same, for 5 scans."""
    return _shares_a_cell(seen, 5)


SCENARIOS: dict[str, tuple[Radar, Draw, int, Holds]] = {
    "radar-tws": (SURVEILLANCE, tws, 60, _apart),
    "radar-uneven": (UNEVEN, tws, 60, _apart),
    "radar-incoming": (MULTIFUNCTION, incoming, 232, _all_seen),
    "radar-altitude": (MULTIFUNCTION, altitude, 232, _all_seen),
    "radar-speed": (MULTIFUNCTION, speed, 232, _all_seen),
    "radar-crossing": (FINE, crossing, 51, _crosses),
    "radar-unresolved": (COARSE, unresolved, 51, _shares_a_cell),
    "radar-parting": (COARSE, parting, 51, _meets),
    "radar-weaving": (COARSE, weaving, 60, _any),
}
"""Radar, targets, number of scans, and what is guaranteed for every seed."""


def simulate_radar(
    scenario: str,
    seed: int = 0,
    *,
    snr_db: float | None = None,
    p_fa: float | None = None,
    clutter: Weibull | None = None,
    glint: float | None = None,
) -> Seen:
    """What a radar sees of a scenario; the options replace what the scenario's radar has.

    Raises ConfigError for a P_FA that makes more false plots than could be of use.
    """
    radar, draw, scans, holds = SCENARIOS[scenario]
    given: dict[str, Any] = {"snr_db": snr_db, "p_fa": p_fa, "clutter": clutter, "glint": glint}
    radar = replace(radar, **{name: value for name, value in given.items() if value is not None})
    most = MOST_FALSE_PLOTS / radar.cells / scans
    if radar.p_fa > most:
        raise ConfigError(f"P_FA is {radar.p_fa:g}; {scenario} has {radar.cells:,.0f} cells: take {most:.1e} at most")
    rng = np.random.default_rng(seed)
    while True:
        seen = observe(radar, draw(rng), scans, rng)
        if holds(seen):
            return seen


def _place(rng: Generator, nearest: float, farthest: float) -> Floats:
    """A place (3,) on the ground in any direction, between two distances from the radar."""
    azimuth, r = rng.uniform(0, 2 * np.pi), rng.uniform(nearest, farthest)
    return np.array([r * np.sin(azimuth), r * np.cos(azimuth), 0.0])


def _through(place: Floats, course: float, speed: float, at_s: float) -> Flight:
    """A straight flight that is at a place at a time."""
    velocity = speed * np.array([np.sin(course), np.cos(course), 0.0])
    return fly(place - at_s * velocity, velocity)


def anywhere(rng: Generator, turning: bool) -> Flight:
    """A flight through the coverage, with one 2.5 g turn of 60 to 180 degrees if `turning`."""
    place, course, speed = _place(rng, 5e3, 50e3), rng.uniform(0, 2 * np.pi), rng.uniform(120, 280)
    if not turning:
        return _through(place, course, speed, 120.0)
    velocity = speed * np.array([np.sin(course), np.cos(course), 0.0])
    rate = 2.5 * G / speed
    turn = Leg(rng.uniform(np.pi / 3, np.pi) / rate, turn=rate * rng.choice([-1, 1]))
    return fly(place - 90 * velocity, velocity, (Leg(rng.uniform(60, 150)), turn, Leg(np.inf)))


def _from_side_to_side(rng: Generator) -> Flight:
    """A flight through the coverage that swings across its course."""
    place, course, speed = _place(rng, 10e3, 45e3), rng.uniform(0, 2 * np.pi), rng.uniform(150, 280)
    period_s = rng.uniform(20, 60)
    amplitude = rng.uniform(1, 4) * G * (period_s / (2 * np.pi)) ** 2
    across = amplitude * np.array([np.cos(course), -np.sin(course), 0.0])
    return swing(_through(place, course, speed, 120.0), across, period_s, rng.uniform(0, 2 * np.pi))
