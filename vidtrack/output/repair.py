"""Makes a run folder whole again after its process was killed."""

from __future__ import annotations

import csv
import json
import shutil
from collections import Counter
from pathlib import Path

import pyarrow as pa
import pyarrow.compute
import pyarrow.csv

from vidtrack.errors import FormatError
from vidtrack.output.linefile import drop_partial_line, replace_text, sort_rows
from vidtrack.output.parquet import parts_folder, write_parquet
from vidtrack.output.tables import layout, schema


def repair(folder: Path) -> int:
    """Rebuild tracks.parquet from tracks.csv, cut half-written lines; returns the number of rows.

    A summary of a killed run stays marked as interrupted; its tracks and counts are taken from the tables.
    Raises FormatError when `folder` holds no tracks.csv or a damaged one.
    """
    for name in ("tracks.csv", "mot.txt", "counts.csv", "decisions.csv"):
        if (folder / name).is_file():
            drop_partial_line(folder / name)
    table = read_tracks(folder / "tracks.csv")
    parquet = folder / "tracks.parquet"
    write_parquet(parquet, table.schema, [table])
    shutil.rmtree(parts_folder(parquet), ignore_errors=True)
    if (folder / "counts.csv").is_file():
        sort_rows(folder / "counts.csv", columns=1, header=True)
    _repair_summary(folder, table)
    return len(table)


def read_tracks(path: Path) -> pa.Table:
    """The table in a tracks.csv, with units in its schema. Raises FormatError."""
    try:
        with path.open() as file:
            wanted = schema(layout(file.readline().strip().split(",")))
        table = pyarrow.csv.read_csv(
            path,
            convert_options=pyarrow.csv.ConvertOptions(
                column_types=wanted, include_columns=wanted.names, strings_can_be_null=False
            ),
        )
    except FileNotFoundError:
        raise FormatError(f"{path.parent} is not a run: it has no {path.name}") from None
    except (pa.ArrowInvalid, pa.ArrowKeyError) as error:
        raise FormatError(f"{path} is damaged: {error}") from None
    return table.cast(wanted)


def _repair_summary(folder: Path, table: pa.Table) -> None:
    path = folder / "summary.json"
    try:
        summary = json.loads(path.read_text())
    except (FileNotFoundError, json.JSONDecodeError):
        summary = {"interrupted": True}
    if not summary["interrupted"]:
        return
    summary["tracks"] = pyarrow.compute.count_distinct(table["track_id"]).as_py()
    if (folder / "counts.csv").is_file():
        with open(folder / "counts.csv", newline="") as file:
            totals = Counter((row["line"], row["direction"]) for row in csv.DictReader(file))
        counts = summary.setdefault("counts", {})
        for (line, direction), total in totals.items():
            counts.setdefault(line, {})[direction] = total
    replace_text(path, json.dumps(summary, indent=2) + "\n")
