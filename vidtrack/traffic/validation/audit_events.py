"""The counted crossings of a measurement or a run, as somebody looks at them one by one."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from vidtrack.arrays.types import Ints
from vidtrack.errors import FormatError, SourceError
from vidtrack.traffic.clock import Clock
from vidtrack.traffic.lines import Line, parse_lines
from vidtrack.traffic.measures.runs import Recording, measured_run, open_day
from vidtrack.traffic.metres import SITE_COPY
from vidtrack.traffic.shapes import Point
from vidtrack.traffic.site import Site, read_site

_DOUBLE = 0.2
"""Least doubt of a crossing close behind another"""
_DOUBLE_S = 0.5
"""s; a vehicle that follows another one faster than this is more often the same one, counted twice"""
_NEEDED = ("time_s", "gate", "direction", "run", "track_id", "confidence", "reason")


@dataclass(frozen=True, slots=True)
class Event:
    """A counted crossing, in the columns of its table; None: not known."""

    time_s: float
    gate: str
    direction: str
    run: int
    track_id: int
    kind: str | None = None
    speed_kmh: float | None = None
    speed_sigma_kmh: float | None = None
    confidence: float | None = None
    reason: str | None = None
    headway_s: float | None = None

    @property
    def doubt(self) -> float:
        """From 0 to 1: what the confidence and the distance to the vehicle ahead give reason for."""
        close = self.headway_s is not None and self.headway_s < _DOUBLE_S
        sure = 1.0 if self.confidence is None else self.confidence
        return max(1 - sure, _DOUBLE if close else 0.0)

    @property
    def lot(self) -> bytes:
        """Its place in the random order: always the same, and independent of all that was measured about it."""
        return sha256(f"{self.run}/{self.track_id}/{self.gate}/{self.direction}".encode()).digest()


@dataclass(frozen=True, slots=True)
class CountedEvents:
    """What was counted.

    events      in order of time
    gates       corners of each gate [px], in pictures of `size`
    ways        the two directions of each gate
    recordings  runs whose tracks are still there; `gone`: why others are not, in words
    clock       tells their times
    """

    events: tuple[Event, ...]
    gates: Mapping[str, tuple[Point, ...]]
    size: tuple[int, int]
    recordings: tuple[Recording, ...]
    gone: str
    clock: Clock

    @property
    def ways(self) -> dict[str, tuple[str, str]]:
        """The two directions of each gate."""
        ends = ((name, line[0], line[-1]) for name, line in self.gates.items())
        return {name: Line(name, *first, *last).directions for name, first, last in ends}

    def recording_of(self, event: Event) -> Recording | None:
        """The run, or the part of a live run, that saw an event."""
        ours = [one for one in self.recordings if one.session == event.run]
        return min(ours, key=lambda one: max(one.begin_s - event.time_s, event.time_s - one.end_s), default=None)


def doubtful_order(events: Sequence[Event]) -> Ints:
    """(N,) events by doubt, the most doubtful first, then by time."""
    return np.lexsort(([one.time_s for one in events], [-one.doubt for one in events]))


def random_order(events: Sequence[Event]) -> Ints:
    """(N,) events in an order that is random and always the same."""
    return np.array(sorted(range(len(events)), key=lambda k: events[k].lot), int)


def read_counted(folder: Path) -> CountedEvents:
    """What `vidtrack measure` or `vidtrack track --line` counted.

    Raises SourceError for a folder without counts, FormatError for damaged tables.
    """
    if (folder / "crossings.parquet").is_file():
        return _measured(folder)
    if (folder / "counts.csv").is_file():
        return _run(folder)
    raise SourceError(
        f"{folder} holds no crossings.parquet or counts.csv; measure at a site with gates, or track with --line"
    )


def _measured(folder: Path) -> CountedEvents:
    report, table = _json(folder / "measures.json"), _table(folder / "crossings.parquet")
    site = read_site(folder / "site.toml")
    recordings, gone = [], ""
    for run in report["runs"]:
        try:
            recordings.append(measured_run(run))
        except SourceError as error:
            gone = str(error)
    gates = {name: gate.line for name, gate in site.gates.items()}
    utc = report["utc_of_time_0"]
    clock = Clock.of(None if utc is None else datetime.fromisoformat(utc), site.camera.start)
    return CountedEvents(_events(table), gates, _size(site), tuple(recordings), gone, clock)


def _events(table: pa.Table) -> tuple[Event, ...]:
    columns: dict[str, list[Any]] = {name: table[name].to_pylist() for name in _NEEDED}
    for name in ("speed_kmh", "speed_sigma_kmh", "headway_s", "class"):
        columns[name] = table[name].to_pylist() if name in table.column_names else [None] * len(table)
    columns["kind"] = columns.pop("class")
    return tuple(Event(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True))


def _run(folder: Path) -> CountedEvents:
    start = read_site(folder / SITE_COPY).camera.start if (folder / SITE_COPY).is_file() else None
    day = open_day([str(folder)], start)
    recording = day.recordings[0]
    settings = _json(folder / "summary.json")["settings"]
    lines = parse_lines(settings["output"]["lines"], *recording.size)
    try:
        with (folder / "counts.csv").open(newline="", encoding="utf-8") as file:
            rows = [
                (float(row["time_s"]), row["line"], row["direction"], int(row["track_id"]))
                for row in csv.DictReader(file)
            ]
    except (UnicodeDecodeError, csv.Error, KeyError, TypeError, ValueError) as error:
        raise FormatError(f"{folder / 'counts.csv'} is damaged: {error!r}; vidtrack repair {folder} may help") from None
    last: dict[tuple[str, str], float] = {}
    events = []
    for time_s, line, direction, track in sorted(rows):
        before = last.get((line, direction))
        last[line, direction] = time_s
        events.append(Event(time_s, line, direction, 0, track, headway_s=None if before is None else time_s - before))
    gates = {line.name: ((line.x1, line.y1), (line.x2, line.y2)) for line in lines}
    return CountedEvents(tuple(events), gates, recording.size, (recording,), "", Clock.of(day.utc, start))


def _size(site: Site) -> tuple[int, int]:
    return site.camera.width, site.camera.height


def _table(path: Path) -> pa.Table:
    try:
        missing = [name for name in _NEEDED if name not in pq.read_schema(path).names]
        if not missing:
            return pq.read_table(path)
    except pa.ArrowInvalid as error:
        raise FormatError(f"{path} is damaged: {error}; measure again") from None
    raise FormatError(f"{path} is of another version: it has no column {missing[0]}; measure again with this one")


def _json(path: Path) -> dict[str, Any]:
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SourceError(f"cannot read {path}: {error.strerror}") from None
    except ValueError as error:
        raise FormatError(f"{path} is damaged: {error}") from None
    return content
