"""What happened, by geometry from the exact states: crossings of gates, movements, queues, conflicts.

Only what happens in the picture counts: a state whose footprint centre the camera does not show is left out. Those that
stand in a queue count as long as the picture shows a part of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.simulate.roads.clip import RoadClip
from vidtrack.simulate.roads.conflicts import conflicts
from vidtrack.simulate.roads.layout import GroundGate
from vidtrack.traffic.lines import Line

SAMPLE_S = 0.04
STANDS_KM_H = 5.0
QUEUE_PAUSE_S = 2.0  # queues of one leg with less between them are one


@dataclass(frozen=True, slots=True)
class Event:
    """A row of `road_events.csv`; times are from the first frame; None: the column does not apply."""

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


def motion(clip: RoadClip, *, parts: bool = False) -> Motion:
    """The motion of the fleet at steps of SAMPLE_S while the video lasts; parts: also of those at the border."""
    time = np.arange(0, clip.times[-1] + 1e-9, SAMPLE_S)
    shape = len(time), len(clip.fleet.length)
    seen = np.zeros((len(clip.times), shape[1]), bool)
    seen[clip.truth.boxes.frame, clip.truth.vehicle] = True
    frame = np.rint(time * clip.fps).astype(int).clip(max=len(seen) - 1)
    xy, route = np.full((*shape, 2), np.nan), np.full(shape, -1)
    speed, heading, s = (np.full(shape, np.nan) for _ in range(3))
    for k, t in enumerate(time):
        now = clip.history.at(float(t))
        shown = seen[frame[k], now.vehicle] if parts else clip.eye.shows(now.xy, clip.size)
        who = now.vehicle[shown]
        xy[k, who], speed[k, who], heading[k, who] = now.xy[shown], now.speed[shown], now.heading[shown]
        s[k, who], route[k, who] = now.s[shown], now.route[shown]
    return Motion(time, xy, speed, heading, s, route)


def events(clip: RoadClip) -> list[Event]:
    """All events in order of time. `target_id` is as in gt.txt."""
    moved, ids = motion(clip), clip.truth.ids(len(clip.fleet.length))
    crossed = list(_crossings(clip, moved, ids))
    found = [
        *crossed,
        *_movements(clip, crossed),
        *_queues(clip, motion(clip, parts=True)),
        *_conflicts(clip, moved, ids),
    ]
    return sorted(found, key=lambda event: event.time_s)


def shown_gates(clip: RoadClip) -> dict[str, GroundGate]:
    """The gates that lie whole in the picture."""
    return {name: gate for name, gate in clip.layout.gates.items() if clip.eye.shows(gate.line, clip.size).all()}


def picture_line(clip: RoadClip, name: str, gate: GroundGate) -> Line:
    """The straight line in the picture between a gate's ends."""
    (x1, y1), (x2, y2) = clip.eye.project(np.column_stack([gate.line, np.zeros(2)]))[0]
    return Line(name, float(x1), float(y1), float(x2), float(y2))


def _crossings(clip: RoadClip, moved: Motion, ids: Ints) -> Iterator[Event]:
    """A footprint's centre passes a gate's line on the ground between two samples."""
    for name, gate in shown_gates(clip).items():
        directions = picture_line(clip, name, gate).directions
        start, along = gate.line[0], gate.line[1] - gate.line[0]
        side = (moved.xy - start) @ np.array([-along[1], along[0]])
        before, after = side[:-1], side[1:]
        for k, v in np.argwhere(((before >= 0) & (after < 0)) | ((before < 0) & (after >= 0))):
            share = before[k, v] / (before[k, v] - after[k, v])
            point = moved.xy[k, v] + share * (moved.xy[k + 1, v] - moved.xy[k, v])
            if not 0 <= (point - start) @ along <= along @ along:
                continue
            # y points down in the picture: the left of a line on the ground is against its normal there
            direction = directions[int(after[k, v] < 0)]
            speed = moved.speed[k, v] + share * (moved.speed[k + 1, v] - moved.speed[k, v])
            time = float(moved.time[k] + share * SAMPLE_S)
            yield Event("crossing", time, int(ids[v]), place=name, direction=direction, speed_kmh=3.6 * float(speed))


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
    for found in conflicts(moved.time, moved.xy, moved.speed, moved.heading, clip.fleet.length, clip.fleet.width):
        target, other = int(ids[found.second]), int(ids[found.first])
        yield Event("conflict", found.time_s, target, other_id=other, pet_s=found.pet_s, ttc_s=found.ttc_s)
