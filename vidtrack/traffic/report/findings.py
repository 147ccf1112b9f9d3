"""A folder of `vidtrack measure`, read back."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import FormatError, SourceError
from vidtrack.traffic.clock import Clock
from vidtrack.traffic.site import Site, read_site

COLUMNS = {
    "crossings": ("time_s", "gate", "direction", "speed_kmh", "speed_sigma_kmh", "speed_shared_sigma_kmh"),
    "trips": ("run", "track_id", "from_leg", "to_leg", "begin_s", "end_s", "complete"),
    "queues": ("leg", "begin_s", "end_s", "vehicles", "length_m"),
    "checks": ("begin_s", "end_s", "coverage", "inflow", "outflow", "left_over", "appeared", "vanished"),
}
"""What is read of each table."""
CONFLICTS = (
    *("time_s", "kind", "angle_deg", "first_track_id", "first_speed_kmh", "second_track_id", "second_speed_kmh"),
    *("ttc_s", "ttc_sigma_s", "pet_s", "pet_sigma_s", "reason"),
)
"""What is read of the table of conflicts, which only calibrated sites have"""
KEYS = (
    *("site", "metres", "runs", "utc_of_time_0", "watched_s", "tracks", "joins", "impossible_movements"),
    *("scale", "straightness"),
)
"""What is read of measures.json."""


@dataclass(frozen=True, slots=True)
class Findings:
    """What was measured at a site.

    tables    by name, see COLUMNS
    report    measures.json
    edges     (I + 1,) s; ends of the intervals
    coverage  (I,) share of each interval that was watched
    """

    site: Site
    tables: dict[str, pa.Table]
    report: dict[str, Any]
    edges: Floats
    coverage: Floats

    @property
    def clock(self) -> Clock:
        """Of the zone of the site's start; else UTC."""
        utc = self.report["utc_of_time_0"]
        return Clock.of(None if utc is None else datetime.fromisoformat(utc), self.site.camera.start)

    @property
    def metres(self) -> bool:
        """Whether positions and speeds are on the road."""
        return bool(self.report["metres"])

    def numbers(self, table: str, column: str) -> Floats:
        """(N,) a column; NaN where a cell is empty."""
        values = pc.cast(self.tables[table][column], pa.float64()).combine_chunks()
        return np.asarray(values.to_numpy(zero_copy_only=False), float)

    def words(self, table: str, column: str) -> list[str | None]:
        """(N,) a column of words; None where a cell is empty."""
        words: list[str | None] = self.tables[table][column].to_pylist()
        return words

    def interval(self, t: Floats) -> Ints:
        """(N,) number of the interval of each time [s]."""
        return np.asarray(np.clip(np.searchsorted(self.edges, t, side="right") - 1, 0, len(self.coverage) - 1))


def read_findings(folder: Path) -> Findings:
    """The tables of `vidtrack measure` with their site.

    Raises SourceError for a folder without them, FormatError for damaged ones and those of another version.
    """
    if not folder.is_dir():
        raise SourceError(f"{folder} is not a folder; give one that vidtrack measure wrote")
    for name in ("measures.json", "site.toml", *(f"{table}.parquet" for table in COLUMNS)):
        if not (folder / name).is_file():
            raise SourceError(f"{folder} has no {name}; give a folder that vidtrack measure wrote, or measure again")
    tables = {name: _table(folder / f"{name}.parquet", columns) for name, columns in COLUMNS.items()}
    report = _report(folder / "measures.json")
    if report["metres"] and (folder / "conflicts.parquet").is_file():
        tables["conflicts"] = _table(folder / "conflicts.parquet", CONFLICTS)
    begin, end = (np.asarray(tables["checks"][name].to_numpy(), float) for name in ("begin_s", "end_s"))
    if len(begin) == 0:
        raise SourceError(f"{folder / 'checks.parquet'} has no intervals; there is nothing to report")
    coverage = np.asarray(tables["checks"]["coverage"].to_numpy(), float)
    return Findings(read_site(folder / "site.toml"), tables, report, np.append(begin, end[-1]), coverage)


def _table(path: Path, columns: tuple[str, ...]) -> pa.Table:
    try:
        missing = [name for name in columns if name not in pq.read_schema(path).names]
        if not missing:
            return pq.read_table(path, columns=list(columns))
    except pa.ArrowInvalid as error:
        raise FormatError(f"{path} is damaged: {error}; measure again") from None
    raise FormatError(f"{path} is of another version: it has no column {missing[0]}; measure again with this one")


def _report(path: Path) -> dict[str, Any]:
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise FormatError(f"{path} is damaged: {error}; measure again") from None
    missing = [key for key in KEYS if not isinstance(report, dict) or key not in report]
    if missing:
        raise FormatError(f"{path} is of another version: it has no {missing[0]}; measure again with this one")
    return dict(report)
