"""What is counted in one day, and the table of its intervals: the columns of `intervals` of vidtrack measure."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, date, datetime
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv

from vidtrack.arrays.types import Floats
from vidtrack.errors import FormatError
from vidtrack.output.intervals.days import edges_of_day, span_of, zone_of
from vidtrack.traffic.lengths import class_of
from vidtrack.traffic.measures.intervals import coverage, figure_columns, figures
from vidtrack.traffic.measures.passing import Passed
from vidtrack.traffic.measures.tables import stamps, table

CROSSINGS, WATCHED, PLAN = "crossings.csv", "watched.csv", "plan.json"
_TIME = pa.timestamp("ms", "UTC")
CROSSING_COLUMNS = {
    "utc": _TIME,
    "gate": pa.string(),
    "direction": pa.string(),
    "track_id": pa.int64(),
    "length_m": pa.float64(),
    "speed_kmh": pa.float64(),
    "speed_sigma_kmh": pa.float64(),
    "speed_shared_sigma_kmh": pa.float64(),
}
WATCHED_COLUMNS = {"begin_utc": _TIME, "end_utc": _TIME}

Spans = tuple[tuple[float | None, float | None], ...]


@dataclass(frozen=True, slots=True)
class Plan:
    """What is counted.

    gates    names of the counting lines, each with its two directions
    classes  low and high length of each class [m]; empty without a calibrated site
    zone     time zone of the days; None: that of this machine
    spans    begin and end of the times in which a gate was counted, Unix times [s], None: open; a gate without any was
             always there
    """

    gates: Mapping[str, tuple[str, str]]
    classes: Mapping[str, tuple[float, float]]
    zone: str | None
    spans: Mapping[str, Spans] = field(default_factory=dict)

    def after(self, before: Plan, now_s: float) -> Plan:
        """This plan from now on [Unix s], with what is known of the time before it."""
        spans = dict(before.spans)
        same = {name for name, ways in self.gates.items() if before.gates.get(name) == ways}
        for name in before.gates.keys() - same:
            *earlier, (begin_s, _) = before.spans.get(name, ((None, None),))
            spans[name] = (*earlier, (begin_s, now_s))
        for name in self.gates.keys() - same:
            spans[name] = (*spans.get(name, ()), (now_s, None))
        return replace(self, spans=spans)

    def watched(self, gate: str, watched: Floats) -> Floats:
        """(S, 2) the watched times in which a gate was counted."""
        if gate not in self.spans:
            return watched
        begin, end = np.array(
            [[-np.inf if b is None else b, np.inf if e is None else e] for b, e in self.spans[gate]]
        ).T
        low, high = np.maximum(watched[:, :1], begin), np.minimum(watched[:, 1:], end)
        return np.column_stack([low[low < high], high[low < high]])

    def to_json(self) -> str:
        """The content of plan.json."""
        return json.dumps(asdict(self), indent=2) + "\n"

    @classmethod
    def read(cls, folder: Path) -> Plan:
        """The plan of a folder of counts. Raises FormatError."""
        path = folder / PLAN
        try:
            tree: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            gates = {str(name): (str(one), str(other)) for name, (one, other) in tree["gates"].items()}
            classes = {str(name): (float(low), float(high)) for name, (low, high) in tree["classes"].items()}
            spans = {name: tuple((begin, end) for begin, end in of) for name, of in tree.get("spans", {}).items()}
            zone_of(tree["zone"])
            return cls(gates, classes, tree["zone"], spans)
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise FormatError(f"cannot read the plan of the counts {path}: {error}") from None


@dataclass(frozen=True, slots=True)
class Day:
    """The crossings of a day, in the columns CROSSING_COLUMNS, and the (S, 2) Unix times [s] that were watched.

    Spans overlap if the clock was set back: what was watched twice is counted twice, and covered twice.
    """

    date: date
    crossings: pa.Table
    watched: Floats

    def intervals(self, every_s: float, plan: Plan) -> pa.Table:
        """A row per gate, direction and interval, from the first watched interval to the last one.

        A gate that was not there yet, or no more, is not watched. Crossings outside of what was watched, such as the
        last ones before a kill, are in `count` alone.
        """
        edges = edges_of_day(self.date, every_s, zone_of(plan.zone))
        counted = np.histogram(_unix(self.crossings["utc"]), edges)[0]
        kept = np.flatnonzero((coverage(self.watched, edges) > 0) | (counted > 0))
        edges = edges[kept[0] : kept[-1] + 2] if len(kept) else edges[:1]
        return _table(self, edges, plan)


def read_day(folder: Path) -> Day:
    """The counts in a day's folder; a file that is missing has none. Raises FormatError."""
    crossings = read_lines(folder / CROSSINGS, CROSSING_COLUMNS)
    spans = [_unix(column) for column in read_lines(folder / WATCHED, WATCHED_COLUMNS).columns]
    return Day(date.fromisoformat(folder.name), crossings, np.column_stack(spans))


def read_lines(path: Path, columns: Mapping[str, pa.DataType]) -> pa.Table:
    """The whole lines of a table: a kill may have cut the last one."""
    schema = pa.schema(list(columns.items()))
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return schema.empty_table()
    convert = pyarrow.csv.ConvertOptions(column_types=schema, include_columns=schema.names, strings_can_be_null=False)
    try:
        whole = BytesIO(content[: content.rfind(b"\n") + 1])
        return pyarrow.csv.read_csv(whole, convert_options=convert).cast(schema)
    except (pa.ArrowInvalid, pa.ArrowKeyError) as error:
        raise FormatError(f"{path} is damaged: {error}") from None


def _table(day: Day, edges: Floats, plan: Plan) -> pa.Table:
    crossings = day.crossings
    gates = _all_gates(crossings, plan)
    ways = [(gate, way) for gate, pair in gates.items() for way in pair]
    bins = len(edges) - 1
    watched = np.array([coverage(plan.watched(gate, day.watched), edges) for gate, _ in ways]).reshape(len(ways), bins)
    unix, length = _unix(crossings["utc"]), _reals(crossings, "length_m")
    inside = (unix >= edges[0]) & (unix < edges[-1]) & (bins > 0)
    crossings, unix, length = crossings.filter(pa.array(inside)), unix[inside], length[inside]
    pairs = zip(crossings["gate"].to_pylist(), crossings["direction"].to_pylist(), strict=True)
    numbers = {way: number for number, way in enumerate(ways)}
    way = np.array([numbers[pair] for pair in pairs], int)
    passed = _passed(crossings, unix, way)
    begin = edges[0]
    found = figures(passed, np.ones(len(passed)), length, edges, watched, len(ways))
    cell = way * bins + np.searchsorted(edges, unix, side="right") - 1
    counted = np.bincount(cell, minlength=len(ways) * bins).reshape(found.count.shape)
    found = replace(found, count=np.where(counted > 0, counted, found.count))
    utc = datetime.fromtimestamp(begin, UTC)
    when = [np.tile(edge - begin, len(ways)) for edge in (edges[:-1], edges[1:])]
    columns = {
        "gate": ("", [gate for gate, _ in ways for _ in range(bins)]),
        "direction": ("", [direction for _, direction in ways for _ in range(bins)]),
        "begin_utc": ("utc", stamps(utc, when[0])),
        "end_utc": ("utc", stamps(utc, when[1])),
        "coverage": ("1", watched.ravel()),
        **figure_columns(found),
    }
    named = np.array(class_of(length, dict(plan.classes)), object)
    for name in plan.classes:
        count = np.bincount(cell[named == name], minlength=len(ways) * bins)
        columns[f"count_{name}"] = ("n", np.where(np.isnan(found.count.ravel()), np.nan, count))
    return table(columns)


def _all_gates(crossings: pa.Table, plan: Plan) -> dict[str, tuple[str, ...]]:
    """The gates of the plan, and those that were counted earlier in the day and have been removed since."""
    gates: dict[str, tuple[str, ...]] = dict(plan.gates)
    for pair in crossings.group_by(["gate", "direction"], use_threads=False).aggregate([]).to_pylist():
        known = gates.get(pair["gate"], ())
        if pair["direction"] not in known:
            gates[pair["gate"]] = (*known, pair["direction"])
    return gates


def _passed(crossings: pa.Table, unix: Floats, way: np.ndarray) -> Passed:
    """The crossings as passings; `gate` and `side` are such that 2 gate + side is the way."""
    n = len(unix)
    unknown, surely = np.full(n, np.nan), np.ones(n, bool)
    speed, own, shared = (
        _reals(crossings, name) / 3.6 for name in ("speed_kmh", "speed_sigma_kmh", "speed_shared_sigma_kmh")
    )
    return Passed(
        unix, way // 2, np.arange(n), way % 2, unknown, unknown, unknown, unknown, surely, ~surely, speed, own, shared,
        unknown, ~surely,
    )  # fmt: skip


def _reals(rows: pa.Table, name: str) -> Floats:
    return np.asarray(rows[name].to_numpy(), float)


def _unix(column: pa.ChunkedArray) -> Floats:
    return np.asarray(column.cast(pa.int64()).to_numpy(), float) / 1000


def day_folders(folder: Path) -> list[Path]:
    """The folders of the days, oldest first."""
    found = []
    for entry in sorted(folder.iterdir()) if folder.is_dir() else []:
        try:
            date.fromisoformat(entry.name)
        except ValueError:
            continue
        found.append(entry)
    return found


def is_over(folder: Path, now_s: float, plan: Plan) -> bool:
    """Whether a day has ended."""
    return span_of(date.fromisoformat(folder.name), zone_of(plan.zone))[1] <= now_s
