"""Writes the counts of a camera: each crossing once, and what was watched, in a folder by local day.

    intervals/plan.json                    what is counted
    intervals/2026-11-22/crossings.csv     appended as they come
    intervals/2026-11-22/watched.csv       spans of time in which crossings were counted
    intervals/2026-11-22/1min.csv, ...     the tables, made from these two

A crossing is written before the time in which it happened is said to be watched, so that a kill leaves no interval that
claims to be whole and is not. Nothing here depends on a run or a part: the next run goes on in the same files.
"""

from __future__ import annotations

import logging
import os
import shutil
import time
from collections import Counter, deque
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import astuple, dataclass
from datetime import UTC, datetime
from math import isnan
from pathlib import Path

import pyarrow as pa

from vidtrack.errors import Error, FormatError
from vidtrack.output.figures import csv_of
from vidtrack.output.folder import append, replacing, writing
from vidtrack.output.intervals.day import (
    CROSSING_COLUMNS,
    CROSSINGS,
    PLAN,
    WATCHED,
    WATCHED_COLUMNS,
    Plan,
    day_folders,
    is_over,
    read_day,
    read_lines,
)
from vidtrack.output.intervals.days import EVERY, by_day, date_of, zone_of
from vidtrack.output.linefile import Every, drop_partial_line, replace_text

log = logging.getLogger(__name__)

_SPAN_S = 2.0  # between two entries of what was watched
_TABLES_S = 900  # the tables of the day are made anew at these times of the clock
_MOST = 100_000  # crossings that wait for room on the disk
_SAME_S = 0.002  # spans closer than this are one: times are written in milliseconds

Totals = dict[str, dict[str, int]]


@dataclass(frozen=True, slots=True)
class Passage:
    """A counted crossing; NaN where nothing is known of the vehicle on the road.

    unix_s        Unix time [s]
    length        m
    speed, speed_sigma, speed_shared   m/s
    """

    unix_s: float
    gate: str
    direction: str
    track_id: int
    length: float
    speed: float
    speed_sigma: float
    speed_shared: float


class CountBook:
    """The counts in `folder`, which this run continues.

    lost  number of crossings dropped, because the disk was full for too long

    The constructor raises OutputError or StoppedEarly if the folder cannot be written.
    """

    def __init__(self, folder: Path, plan: Plan) -> None:
        self.lost = 0
        self._folder = folder
        with suppress(FormatError):  # a damaged one: all gates were always there
            if (folder / PLAN).exists():
                plan = plan.after(Plan.read(folder), time.time())
        self._plan = plan
        self._zone = zone_of(plan.zone)
        self._waiting: deque[Passage] = deque(maxlen=_MOST)
        self._watched: list[tuple[float, float]] = []
        self._planned = True
        self._due = Every(_SPAN_S)
        self._period = int(time.time() // _TABLES_S)
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
        replace_text(folder / PLAN, plan.to_json())
        for day in day_folders(folder):
            if _is_behind(day):
                self._recover(day)

    def add(self, passages: Iterable[Passage]) -> None:
        """Note crossings; `save` writes them."""
        for passage in passages:
            self.lost += len(self._waiting) == _MOST
            self._waiting.append(passage)

    def watch(self, begin_s: float, end_s: float) -> None:
        """Note that all crossings in this span of Unix time [s] have been added."""
        if self._watched and abs(self._watched[-1][1] - begin_s) < _SAME_S:
            begin_s = self._watched.pop()[0]
        self._watched.append((begin_s, end_s))

    def use(
        self, gates: Mapping[str, tuple[str, str]], classes: Mapping[str, tuple[float, float]], since_s: float
    ) -> None:
        """Count over these gates from a Unix time [s] on; sort lengths by these classes, of the day so far too.

        `save` writes it.
        """
        self._plan = Plan(gates, classes, self._plan.zone).after(self._plan, since_s)
        self._planned = False

    def save(self, keep_s: float | None = None) -> None:
        """Write what waits, and delete days older than keep_s [s].

        Raises StoppedEarly on a full disk; a later call writes it.
        """
        if self._waiting or self._due():
            self._write_crossings()
            self._write_watched()
        if not self._planned:
            replace_text(self._folder / PLAN, self._plan.to_json())
            self._planned = True
        if (period := int(time.time() // _TABLES_S)) != self._period:
            self._period = period
            if keep_s is not None:
                self._prune(time.time() - keep_s)
            self._write_tables()

    def close(self) -> None:
        """Write the rest, and the tables."""
        self._write_crossings()
        self._write_watched()
        self._write_tables()

    def _prune(self, oldest_s: float) -> None:
        """Delete the days that ended before a Unix time [s]."""
        for day in day_folders(self._folder):
            if is_over(day, oldest_s, self._plan):
                shutil.rmtree(day, ignore_errors=True)
                log.info("deleted %s", day)

    def _write_crossings(self) -> None:
        while self._waiting:
            day = date_of(self._waiting[0].unix_s, self._zone)
            count = next(
                (k for k, each in enumerate(self._waiting) if date_of(each.unix_s, self._zone) != day),
                len(self._waiting),
            )
            rows = "".join(_row(self._waiting[k]) for k in range(count))
            _append(self._folder / day.isoformat() / CROSSINGS, CROSSING_COLUMNS, rows)
            for _ in range(count):
                self._waiting.popleft()

    def _write_watched(self) -> None:
        while self._watched:
            begin_s, end_s = self._watched[0]
            pieces = by_day(begin_s, end_s, self._zone)
            for day, begin, end in pieces:
                _append(self._folder / day.isoformat() / WATCHED, WATCHED_COLUMNS, f"{_stamp(begin)},{_stamp(end)}\n")
                self._watched[0] = (end, end_s)
            self._watched.pop(0)

    def _write_tables(self) -> None:
        for day in day_folders(self._folder):
            if _is_behind(day):
                self._make_tables(day)

    def _make_tables(self, folder: Path) -> None:
        """Make the tables of a day, and join the spans of watched.csv that follow each other."""
        day = read_day(folder)
        spans: list[list[float]] = []
        for begin, end in day.watched.tolist():
            if spans and abs(spans[-1][1] - begin) < _SAME_S:
                spans[-1][1] = end
            else:
                spans.append([begin, end])
        if len(spans) < len(day.watched):
            rows = "".join(f"{_stamp(begin)},{_stamp(end)}\n" for begin, end in spans)
            replace_text(folder / WATCHED, ",".join(WATCHED_COLUMNS) + "\n" + rows)
        for name, every_s in EVERY.items():
            with replacing(folder / f"{name}.csv") as new:
                new.write_bytes(csv_of(day.intervals(every_s, self._plan)))

    def _recover(self, folder: Path) -> None:
        """Make the tables of a day that a killed run has left; set what cannot be read aside."""
        try:
            for name in (CROSSINGS, WATCHED):
                if (folder / name).exists():
                    drop_partial_line(folder / name)
            self._make_tables(folder)
        except FormatError as error:
            log.warning("%s; it is set aside, and its day is counted anew", error)
            for name in (CROSSINGS, WATCHED, *(f"{name}.csv" for name in EVERY)):  # else totals are those of the tables
                with suppress(OSError):
                    (folder / name).rename(folder / f"{name}.damaged-{int(time.time())}")
        except Error as error:
            log.warning("%s", error)


def totals(folder: Path) -> Totals:
    """All crossings in a folder of counts, by gate and direction. Raises FormatError."""
    total: Counter[tuple[str, str]] = Counter()
    for day in day_folders(folder):
        total.update(_totals_of(day))
    found: Totals = {}
    for (gate, direction), count in sorted(total.items()):
        found.setdefault(gate, {})[direction] = count
    return found


def _totals_of(folder: Path) -> Counter[tuple[str, str]]:
    """The crossings of a day: from its shortest table, or from all of them if that is older or damaged."""
    columns = {"gate": pa.string(), "direction": pa.string(), "count": pa.int64()}
    with suppress(FormatError):
        if not _is_behind(folder):
            rows = read_lines(folder / "1d.csv", columns).to_pylist()
            return Counter({(row["gate"], row["direction"]): row["count"] or 0 for row in rows})
    crossings = read_day(folder).crossings
    return Counter(zip(crossings["gate"].to_pylist(), crossings["direction"].to_pylist(), strict=True))


def _is_behind(folder: Path) -> bool:
    """Whether the tables of a day are older than what they are made from."""
    made = [_changed_ns(folder / f"{name}.csv") for name in EVERY]
    return min(made) < max(_changed_ns(folder / name) for name in (CROSSINGS, WATCHED))


def _changed_ns(path: Path) -> int:
    with suppress(FileNotFoundError):
        return path.stat().st_mtime_ns
    return 0


def _append(path: Path, columns: Iterable[str], rows: str) -> None:
    """Append lines to a table and synchronise it; on an error nothing of them is written."""
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            replace_text(path, ",".join(columns) + "\n")
        with open(path, "r+b", buffering=0) as file:
            file.seek(0, os.SEEK_END)
            append(file, rows.encode())
            os.fdatasync(file.fileno())


def _row(passage: Passage) -> str:
    unix_s, gate, direction, track_id, length, *speeds = astuple(passage)
    kmh = [_cell(3.6 * speed) for speed in speeds]
    return ",".join([_stamp(unix_s), gate, direction, str(track_id), _cell(length), *kmh]) + "\n"


def _cell(value: float) -> str:
    return "" if isnan(value) else f"{value:.4f}"


def _stamp(unix_s: float) -> str:
    return datetime.fromtimestamp(unix_s, UTC).strftime("%Y-%m-%d %H:%M:%S.%f")[:-3] + "Z"
