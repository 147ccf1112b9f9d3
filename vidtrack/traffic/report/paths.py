"""Where vehicles were, from the tracks of the runs themselves: seconds in each cell, and ways over time."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.measures.gates import Gates, gates_of
from vidtrack.traffic.measures.rows import Reader, Rows
from vidtrack.traffic.measures.runs import Day, measured_run
from vidtrack.traffic.measures.staying import outlines_of
from vidtrack.traffic.report.findings import Findings
from vidtrack.traffic.report.sheet import Movement, Sheet
from vidtrack.traffic.report.turns import THROUGH

WINDOW_S = 300.0
"""Longest time of a time-space diagram."""
_CELLS = 120
"""Of the heat map, along its longer side"""
_BESIDE = 0.25
"""How far the heat map reaches beyond the gates, or the zones where there are none, as a share of their extent"""


@dataclass(frozen=True, slots=True, eq=False)
class Heat:
    """Vehicle-seconds (Y, X) in cells with these edges, metres or pixels."""

    x: Floats
    y: Floats
    seconds: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Ways:
    """Way of the vehicles of one movement over time, N rows in order of vehicle and time.

    length    from the entry gate to the exit gate in a straight line, metres or pixels
    vehicle   (N,) number of the trip in the table
    t, along  (N,) s; distance from the entry gate along this line
    """

    movement: Movement
    begin_s: float
    end_s: float
    length: float
    vehicle: Ints
    t: Floats
    along: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Paths:
    """`gates`: where the heat map has them; `ways` None: there is no whole trip."""

    gates: Gates
    heat: Heat
    ways: Ways | None


def paths_of(found: Findings, sheet: Sheet) -> Paths:
    """Read the tracks of all runs once more.

    Raises SourceError where a run is no longer in its folder, and what `measured_run` and `Reader` raise.
    """
    day = _day(found)
    sizes = sorted({recording.size for recording in day.recordings})
    drawn = {size: found.site.scaled(*size) for size in sizes}
    grounds = {size: None if one.calibration is None else calibrated(one) for size, one in drawn.items()}
    first = drawn[sizes[0]], grounds[sizes[0]]
    gates = gates_of(*first)
    corners = gates.segment.reshape(-1, 2) if len(gates) else np.concatenate(outlines_of(*first))
    reader, heat, window = Reader(day, grounds), _empty(corners), _window(found, sheet)
    kept: list[Rows] = []
    for rows in reader:
        _warm(heat, rows)
        if window is not None:
            kept.append(rows.only((rows.t >= window.begin_s) & (rows.t < window.end_s)))
    return Paths(gates, heat, None if window is None else _ways(found, window, gates, kept, reader.names))


def _day(found: Findings) -> Day:
    """The recordings as they were measured."""
    recordings = tuple(measured_run(run) for run in found.report["runs"])
    utc = found.report["utc_of_time_0"]
    return Day(recordings, None if utc is None else datetime.fromisoformat(utc))


def _empty(corners: Floats) -> Heat:
    """A heat map of the place with these corners (N, 2)."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    beside = _BESIDE * (high - low).max()
    low, high = low - beside, high + beside
    step = (high - low).max() / _CELLS
    x, y = (np.arange(low[k], high[k] + step, step) for k in (0, 1))
    return Heat(x, y, np.zeros((len(y) - 1, len(x) - 1)))


def _warm(heat: Heat, rows: Rows) -> None:
    """Add what each row stands for: the time to the next picture, in most blocks the same for all."""
    steps = np.diff(np.unique(rows.t))
    if len(steps):
        heat.seconds[:] += np.histogram2d(rows.xy[:, 1], rows.xy[:, 0], (heat.y, heat.x))[0] * np.median(steps)


@dataclass(frozen=True, slots=True)
class _Window:
    """Which trips of a movement a time-space diagram shows; `trips`: their rows in the table."""

    movement: Movement
    begin_s: float
    end_s: float
    trips: Ints


def _window(found: Findings, sheet: Sheet) -> _Window | None:
    """The time with most trips of the movement with most trips, of those straight through if there is one."""
    if not sheet.sums.any():
        return None
    through = np.array([movement.turn == THROUGH for movement in sheet.movements])
    sums = np.where(through, sheet.sums, 0) if (sheet.sums[through] > 0).any() else sheet.sums
    movement = sheet.movements[int(np.argmax(sums))]
    pairs = zip(found.words("trips", "from_leg"), found.words("trips", "to_leg"), strict=True)
    ours = np.array([pair == (movement.start, movement.end) for pair in pairs])
    trips = np.flatnonzero(ours & (found.numbers("trips", "complete") > 0))
    begin, end = (found.numbers("trips", name)[trips] for name in ("begin_s", "end_s"))
    order = np.argsort(begin)
    count = np.searchsorted(begin[order], begin[order] + WINDOW_S) - np.arange(len(order))
    start = float(begin[order][np.argmax(count)])
    inside = (begin >= start) & (begin < start + WINDOW_S)
    return _Window(movement, start, min(start + WINDOW_S, float(end[inside].max())), trips[inside])


def _ways(found: Findings, window: _Window, gates: Gates, kept: list[Rows], names: tuple[Ints, Ints]) -> Ways:
    track = np.concatenate([rows.track for rows in kept])
    t, xy = np.concatenate([rows.t for rows in kept]), np.concatenate([rows.xy for rows in kept])
    run, track_id = (found.numbers("trips", name)[window.trips].astype(int) for name in ("run", "track_id"))
    trip_of = dict(zip(zip(run.tolist(), track_id.tolist(), strict=True), window.trips.tolist(), strict=True))
    numbers = zip(names[0].tolist(), names[1].tolist(), strict=True)
    trip = np.array([trip_of.get(pair, -1) for pair in numbers])[track]
    a, b = _middle(gates, window.movement.start, "entry"), _middle(gates, window.movement.end, "exit")
    length = float(np.hypot(*(b - a)))
    along = (xy - a) @ (b - a) / length
    chosen = np.flatnonzero((trip >= 0) & np.isfinite(along))
    order = chosen[np.lexsort((t[chosen], trip[chosen]))]
    return Ways(window.movement, window.begin_s, window.end_s, length, trip[order], t[order], along[order])


def _middle(gates: Gates, leg: str, role: str) -> Floats:
    """(2,) of the gates of a leg where vehicles enter, or leave."""
    ours = np.flatnonzero(gates.role(role, "both") & (np.array(gates.legs) == leg))
    segments = np.concatenate([gates.segment[gates.first[g] : gates.first[g + 1]] for g in ours.tolist()])
    return np.asarray(segments.reshape(-1, 2).mean(axis=0))
