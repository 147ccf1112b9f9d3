"""Repairs the folder of a killed run."""

from __future__ import annotations

import csv
import json
import shutil
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pyarrow as pa
import pyarrow.compute
import pyarrow.csv

from vidtrack.errors import FormatError
from vidtrack.output.folder import LINE_FILES
from vidtrack.output.linefile import drop_partial_line, replace_text, sort_rows
from vidtrack.output.parquet import join_parts, parts_folder, read_parquet, write_parquet
from vidtrack.output.tables import layout, schema

_BLOCK = 1 << 20  # bytes of text read at a time


def is_unfinished(folder: Path) -> bool:
    """Whether a killed run has left tracks here without a whole tracks.parquet."""
    path = folder / "tracks.parquet"
    return not path.exists() and ((folder / "tracks.csv").exists() or parts_folder(path).exists())


def has_tracks(folder: Path) -> bool:
    """Whether there are tracks in a folder, whole or in parts."""
    path = folder / "tracks.parquet"
    return any(each.exists() for each in (folder / "tracks.csv", path, parts_folder(path)))


def repair(folder: Path) -> int:
    """Rebuild tracks.parquet from tracks.csv, or without it from its parts; remove incomplete lines.

    Returns the number of rows. summary.json stays marked as interrupted; its tracks and counts are taken from the
    tables. Raises FormatError if there are no tracks, or if they are damaged.
    """
    for name in LINE_FILES:
        if (folder / name).is_file():
            drop_partial_line(folder / name)
    parquet = folder / "tracks.parquet"
    if (folder / "tracks.csv").exists() or not has_tracks(folder):
        table = read_tracks(folder / "tracks.csv")
        add_parquet(folder)
    else:
        table = read_parquet(parquet) if parquet.exists() else join_parts(parquet)
    shutil.rmtree(parts_folder(folder / "tracks.parquet"), ignore_errors=True)
    if (folder / "counts.csv").is_file():
        sort_rows(folder / "counts.csv", columns=1, header=True)
    _repair_summary(folder, table)
    return len(table)


def add_parquet(folder: Path) -> None:
    """Write tracks.parquet from tracks.csv, block by block. Raises FormatError, and StoppedEarly on a full disk."""
    wanted, blocks = _blocks(folder / "tracks.csv")
    write_parquet(folder / "tracks.parquet", wanted, blocks)


def read_tracks(path: Path) -> pa.Table:
    """Read a tracks.csv, with units in the schema. Raises FormatError."""
    wanted, blocks = _blocks(path)
    return pa.concat_tables([wanted.empty_table(), *blocks])


def _blocks(path: Path) -> tuple[pa.Schema, Iterator[pa.Table]]:
    """Schema and blocks of a tracks.csv, read lazily. Raises FormatError, now or while iterating."""
    try:
        with path.open() as file:
            wanted = schema(layout(file.readline().strip().split(",")))
    except (FileNotFoundError, NotADirectoryError):
        raise FormatError(f"{path.parent} is not a run: it has no {path.name}") from None
    return wanted, _read_blocks(path, wanted)


def _read_blocks(path: Path, wanted: pa.Schema) -> Iterator[pa.Table]:
    convert = pyarrow.csv.ConvertOptions(column_types=wanted, include_columns=wanted.names, strings_can_be_null=False)
    read = pyarrow.csv.ReadOptions(use_threads=False, block_size=_BLOCK)
    try:
        with pyarrow.csv.open_csv(path, read_options=read, convert_options=convert) as reader:
            for batch in reader:
                yield pa.Table.from_batches([batch]).cast(wanted)
    except (pa.ArrowInvalid, pa.ArrowKeyError) as error:
        raise FormatError(f"{path} is damaged: {error}") from None


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
