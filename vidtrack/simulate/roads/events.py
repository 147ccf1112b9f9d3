"""What happened, by geometry from the exact states: crossings of gates, movements, queues, conflicts.

Only what happens in the picture counts: a state whose footprint centre the camera does not show is left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from vidtrack.scan import Floats, Ints, Mask
from vidtrack.simulate.roads.clip import RoadClip
from vidtrack.simulate.roads.layout import GroundGate
from vidtrack.simulate.roads.stage import footprints
from vidtrack.simulate.scene import touching
from vidtrack.traffic.lines import Line

SAMPLE_S = 0.04
STANDS_KM_H = 5.0
QUEUE_PAUSE_S = 2.0  # queues of one leg with less between them are one
TTC_S, PET_S = 1.5, 5.0  # of a conflict, as SSAM counts them by default
TTC_RANGE_M = 60.0
CROSSING_ANGLE = np.radians(30)  # vehicles whose headings differ less follow each other


@dataclass(frozen=True, slots=True)
class Event:
    """A row of `road_events.csv`; None: the column does not apply. Units are in the names, times from the first frame."""

    event: str
    time_s: float
    target_id: int | None = None
    end_s: float | None = None
    other_id: int | None = None
    place: str | None = None
    direction: str | None = None
    from_leg: str | None = None
    to_leg: str | None = None
    speed_kmh: float | None = None
    vehicles: int | None = None
    length_m: float | None = None
    pet_s: float | None = None
    ttc_s: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """All vehicles at the same times (K,) [s]; arrays (K, V), NaN where a vehicle is not in the picture."""

    time: Floats
    xy: Floats
    speed: Floats
    heading: Floats
    s: Floats
    route: Ints


def motion(clip: RoadClip) -> Motion:
    """The motion of the fleet at steps of SAMPLE_S while the video lasts."""
    time = np.arange(0, clip.times[-1] + 1e-9, SAMPLE_S)
    shape = len(time), len(clip.fleet.length)
    xy, route = np.full((*shape, 2), np.nan), np.full(shape, -1)
    speed, heading, s = (np.full(shape, np.nan) for _ in range(3))
    for k, t in enumerate(time):
        now = clip.history.at(float(t))
        place, depth = clip.eye.project(np.column_stack([now.xy, np.zeros(len(now.xy))]))
        shown = (depth > 0) & (place >= 0).all(axis=1) & (place <= clip.size).all(axis=1)
        who = now.vehicle[shown]
        xy[k, who], speed[k, who], heading[k, who] = now.xy[shown], now.speed[shown], now.heading[shown]
        s[k, who], route[k, who] = now.s[shown], now.route[shown]
    return Motion(time, xy, speed, heading, s, route)


def events(clip: RoadClip) -> list[Event]:
    """All events in order of time. `target_id` is as in gt.txt."""
    moved, ids = motion(clip), clip.truth.ids(len(clip.fleet.length))
    crossed = list(_crossings(clip, moved, ids))
    found = [*crossed, *_movements(clip, crossed), *_queues(clip, moved), *_conflicts(clip, moved, ids)]
    return sorted(found, key=lambda event: event.time_s)


def shown_gates(clip: RoadClip) -> dict[str, GroundGate]:
    """The gates that lie whole in the picture."""
    return {name: gate for name, gate in clip.layout.gates.items() if in_picture(clip, gate.line).all()}


def in_picture(clip: RoadClip, ground: Floats) -> Mask:
    """Which ground points (V, 2) m the camera shows."""
    xy, depth = clip.eye.project(np.column_stack([ground, np.zeros(len(ground))]))
    return np.asarray((depth > 0) & (xy >= 0).all(axis=1) & (xy <= clip.size).all(axis=1))


def picture_line(clip: RoadClip, name: str, gate: GroundGate) -> Line:
    """The straight line in the picture between a gate's ends."""
    (x1, y1), (x2, y2) = clip.eye.project(np.column_stack([gate.line, np.zeros(2)]))[0]
    return Line(name, float(x1), float(y1), float(x2), float(y2))


def _crossings(clip: RoadClip, moved: Motion, ids: Ints) -> Iterator[Event]:
    """A footprint's centre passes a gate's line on the ground between two samples."""
    for name, gate in shown_gates(clip).items():
        start, along = gate.line[0], gate.line[1] - gate.line[0]
        left = np.array([-along[1], along[0]]) / np.hypot(*along)
        side = (moved.xy - start) @ left
        share = side[:-1] / (side[:-1] - side[1:])
        at = moved.xy[:-1] + share[..., None] * (moved.xy[1:] - moved.xy[:-1])
        where = (at - start) @ along / (along @ along)
        passed = ((side[:-1] >= 0) != (side[1:] >= 0)) & (where >= 0) & (where <= 1) & ~np.isnan(side[:-1] + side[1:])
        directions = picture_line(clip, name, gate).directions
        for k, vehicle in np.argwhere(passed):
            part = float(share[k, vehicle])
            speed = (1 - part) * moved.speed[k, vehicle] + part * moved.speed[k + 1, vehicle]
            # y points down in the picture: the left of a line on the ground is on the other side of its normal there
            direction = directions[int(side[k + 1, vehicle] < 0)]
            time = float(moved.time[k] + part * SAMPLE_S)
            yield Event("crossing", time, int(ids[vehicle]), place=name, direction=direction, speed_kmh=3.6 * float(speed))


def _movements(clip: RoadClip, crossed: list[Event]) -> Iterator[Event]:
    """From a vehicle's first entry gate to the next exit gate that it passes."""
    gates = clip.layout.gates
    for vehicle in sorted({event.target_id or 0 for event in crossed}):
        mine = sorted((e for e in crossed if e.target_id == vehicle), key=lambda e: e.time_s)
        for first, last in pairwise(mine):
            one, other = gates[first.place or ""], gates[last.place or ""]
            if one.role == "entry" and other.role == "exit":
                yield Event("movement", first.time_s, vehicle, last.time_s, from_leg=one.leg, to_leg=other.leg)


def _queues(clip: RoadClip, moved: Motion) -> Iterator[Event]:
    """Vehicles that stand before the stop line of a leg, from when the first stands until none does."""
    net = clip.layout.network
    half = clip.fleet.length / 2
    for leg in dict.fromkeys(route.start for route in net.routes):
        mine = np.array([route.start == leg for route in net.routes])
        line = np.where(mine, net.stop, np.nan)
        stop = np.where(moved.route >= 0, line[moved.route], np.nan)
        waits = (3.6 * moved.speed < STANDS_KM_H) & (moved.s + half <= stop)
        back = np.where(waits, stop - moved.s + half, 0.0).max(axis=1, initial=0.0)
        standing = np.flatnonzero(waits.any(axis=1))
        if len(standing) == 0:
            continue
        for part in np.split(standing, np.flatnonzero(np.diff(standing) * SAMPLE_S > QUEUE_PAUSE_S) + 1):
            begin, end = float(moved.time[part[0]]), float(moved.time[part[-1]])
            most = int(waits[part].sum(axis=1).max())
            yield Event("queue", begin, end_s=end, from_leg=leg, vehicles=most, length_m=float(back[part].max()))


def _conflicts(clip: RoadClip, moved: Motion, ids: Ints) -> Iterator[Event]:
    """Pairs whose time to collision or post-encroachment time falls below its limit."""
    fleet = clip.fleet
    there = np.flatnonzero(~np.isnan(moved.speed).all(axis=0))
    for i, j in combinations(there, 2):
        alone = [np.flatnonzero(~np.isnan(moved.speed[:, v])) for v in (i, j)]
        if alone[0][0] * SAMPLE_S > alone[1][-1] * SAMPLE_S + PET_S or alone[1][0] * SAMPLE_S > alone[0][-1] * SAMPLE_S + PET_S:
            continue
        base = [
            footprints(moved.xy[k, v], moved.heading[k, v], np.full(len(k), fleet.length[v]), np.full(len(k), fleet.width[v]))
            for v, k in zip((i, j), alone, strict=True)
        ]
        encroached = _post_encroachment(moved, (i, j), alone, base)
        collides = _time_to_collision(moved, (i, j), alone, base)
        if encroached is None and collides is None:
            continue
        pet, first, last = encroached or (None, None, None)
        ttc, when = collides or (None, None)
        behind = i if last is None or moved_first(last, i) else j
        other = j if behind == i else i
        time = float(moved.time[last[1]]) if last is not None else float(when if when is not None else 0.0)
        yield Event("conflict", time, int(ids[behind]), other_id=int(ids[other]), pet_s=pet, ttc_s=ttc)
