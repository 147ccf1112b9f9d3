"""Tables of crossings: those that were counted, and those that somebody noted by hand."""

from __future__ import annotations

import csv
import difflib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import chain
from pathlib import Path

import numpy as np

from vidtrack.arrays.types import Floats, Mask
from vidtrack.errors import ConfigError, SourceError

_GATE = ("gate", "line")
_CLOCKS = ("time_s", "utc")
_OPPOSITE = {"up": "down", "down": "up", "left": "right", "right": "left"}
_CERTAIN = {"1": True, "true": True, "yes": True, "": True, "0": False, "false": False, "no": False}


@dataclass(frozen=True, slots=True)
class Events:
    """N crossings.

    clock      "time_s": seconds since the video's first picture; "utc": seconds since 1970
    time       (N,) s, by that clock
    gate       (N,) names
    direction  (N,) names
    certain    (N,) False: may be found or not at no cost
    """

    clock: str
    time: Floats
    gate: np.ndarray
    direction: np.ndarray
    certain: Mask

    def __len__(self) -> int:
        return len(self.time)

    def select(self, rows: Mask) -> Events:
        """The given rows."""
        return Events(self.clock, self.time[rows], self.gate[rows], self.direction[rows], self.certain[rows])


@dataclass(frozen=True, slots=True)
class Counted:
    """What was counted, and the directions of each gate, also of those that nobody crossed."""

    path: Path
    events: Events
    directions: dict[str, tuple[str, ...]]

    def check(self, manual: Events, path: Path) -> None:
        """Raise ConfigError for a gate, or a direction of it, in a manual count that the counted table cannot have."""
        for gate, direction in dict.fromkeys(zip(manual.gate.tolist(), manual.direction.tolist(), strict=True)):
            ways = self.directions.get(gate)
            what, name, known = ("gate", gate, [*self.directions]) if ways is None else ("direction", direction, ways)
            if name not in known:
                near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
                hint = f"did you mean {near[0]}?" if near else f"there is {', '.join(known)}"
                of = "" if ways is None else f" of gate {gate}"
                raise ConfigError(f"{path}: {what} {name!r}{of} is not in {self.path}; {hint}")


def read_manual(path: Path, clocks: Iterable[str]) -> Events:
    """A count by hand: `time_s` or `utc`, `gate` or `line`, `direction`, and perhaps `certain`.

    clocks  those that the counted table has; the first one that this table has too is taken

    Raises SourceError for a file that is not there, ConfigError for one that cannot be meant, naming the line.
    """
    rows, names = _read(path)
    clock = next((clock for clock in clocks if clock in names), None)
    if clock is None:
        if "utc" in names:
            raise ConfigError(
                f"{path} has times of day, and the counted table has none: give [site] the time of the first picture, "
                "for example start = 2026-06-01T07:00:00+02:00, and measure again, or give time_s in seconds of the "
                "video"
            )
        hint = "; separate columns by commas" if len(names) == 1 else ""
        raise ConfigError(f"{path} has no column time_s or utc; it has {', '.join(names) or 'none'}{hint}")
    if not rows:
        raise ConfigError(f"{path} is empty: there is nothing to compare with")
    return _events(path, rows, names, clock)


def read_counted(folder: Path, path: Path, clock: str) -> Counted:
    """The crossings in a table of a folder, by the given clock. Raises ConfigError."""
    rows, names = _read(path)
    if not rows:
        raise ConfigError(f"{path} is empty: nothing was counted, so there is nothing to compare")
    events = _events(path, rows, names, clock)
    directions: dict[str, tuple[str, ...]] = {}
    ways = chain(zip(events.gate.tolist(), events.direction.tolist(), strict=True), _ways(folder))
    for gate, direction in ways:
        both = direction, _OPPOSITE.get(direction, direction)
        directions[gate] = tuple(dict.fromkeys((*directions.get(gate, ()), *both)))
    return Counted(path, events, directions)


def table_of(folder: Path) -> Path:
    """The table of crossings in a folder. Raises SourceError where there is none."""
    for name in ("crossings.csv", "counts.csv"):
        if (folder / name).is_file():
            return folder / name
    raise SourceError(
        f"{folder} holds no crossings.csv or counts.csv; measure at a site with gates, or track with --line"
    )


def clocks_of(path: Path) -> list[str]:
    """The clocks that a table has times by; one of a site without a start has an empty column utc."""
    rows, names = _read(path)
    return [clock for clock in _CLOCKS if clock in names and (not rows or any(row[clock] for row in rows))]


def seconds(text: str, clock: str, where: str) -> float:
    """A time of the table. Raises ConfigError naming the place for one that is none, or has no zone."""
    try:
        if clock == "time_s":
            value = float(text)
            if not np.isfinite(value):
                raise ValueError
            return value
        moment = datetime.fromisoformat(text.strip())
    except ValueError:
        wanted = (
            "seconds, for example 3.2"
            if clock == "time_s"
            else "a date and a time, for example 2026-06-01T07:00:00+02:00"
        )
        raise ConfigError(f"{where}: {clock} is {text!r}; write {wanted}") from None
    if moment.tzinfo is None:
        raise ConfigError(f"{where}: utc is {text!r}, without a zone; write it with Z or, for example, +02:00")
    return moment.timestamp()


def written(time: float, clock: str) -> str:
    """A time as a table has it."""
    return f"{time:.3f} s" if clock == "time_s" else datetime.fromtimestamp(time, UTC).isoformat(timespec="seconds")


def _read(path: Path) -> tuple[list[dict[str, str]], list[str]]:
    """The rows with their column names."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file, restval="")
            return list(reader), list(reader.fieldnames or [])
    except OSError as error:
        raise SourceError(f"cannot read {path}: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error):
        raise ConfigError(f"{path} is no CSV table") from None


def _events(path: Path, rows: list[dict[str, str]], names: list[str], clock: str) -> Events:
    gate = next((name for name in _GATE if name in names), None)
    if gate is None or "direction" not in names:
        missing = "gate" if gate is None else "direction"
        raise ConfigError(f"{path} has no column {missing}; it has {', '.join(names) or 'none'}")
    times = [seconds(row[clock], clock, f"{path}, line {i}") for i, row in enumerate(rows, start=2)]
    certain = [_certain(row.get("certain", "1"), f"{path}, line {i}") for i, row in enumerate(rows, start=2)]
    gates, directions = ([row[name].strip() for row in rows] for name in (gate, "direction"))
    order = np.argsort(times, kind="stable")
    columns = (np.array(times), np.array(gates, object), np.array(directions, object), np.array(certain))
    return Events(clock, *(column[order] for column in columns))


def _certain(text: str, where: str) -> bool:
    word = text.strip().lower()
    if word not in _CERTAIN:
        raise ConfigError(f"{where}: certain is {text!r}; write 1 or 0")
    return _CERTAIN[word]


def _ways(folder: Path) -> Iterable[tuple[str, str]]:
    """The gates and directions that a run or a measurement has, whoever crossed them."""
    intervals = folder / "intervals.csv"
    rows = _read(intervals)[0] if intervals.is_file() else []
    by_measures = ((row["gate"], row["direction"]) for row in rows if {"gate", "direction"} <= row.keys())
    summary = folder / "summary.json"
    try:
        counts = json.loads(summary.read_text())["counts"] if summary.is_file() else {}
    except (ValueError, KeyError):
        counts = {}
    return chain(by_measures, ((gate, direction) for gate, ways in counts.items() for direction in ways))
