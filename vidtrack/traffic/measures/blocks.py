"""The table of tracks of a finished run, a block of rows at a time: only the columns that are wanted."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from os import SEEK_END
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from vidtrack.arrays.types import Floats
from vidtrack.errors import FormatError
from vidtrack.formats import damaged
from vidtrack.traffic.measures.runs import ended

BLOCK = 1 << 16
"""Rows that are worked on at a time, while the next are read: 25 columns of 0.5 MB. Larger blocks are not faster."""
_LONGEST_LINE = 1 << 16
"""Bytes; no line of a table is as long."""


def whole_pictures(tables: Iterable[pa.Table], folder: Path) -> Iterator[pa.Table]:
    """The rows of a run's tables, cut between pictures: what a picture shows belongs together.

    The last picture of a table goes with the table after it, and is no block of its own where none follows.
    Raises FormatError for rows that are not in order of time, or have none.
    """
    rest: pa.Table | None = None
    for table in tables:
        if not len(table):
            continue
        whole = table if rest is None else pa.concat_tables([rest, table])
        t = numbers(whole, "time_s")
        if not (np.isfinite(t[0]) and (np.diff(t) >= 0).all()):
            raise FormatError(_out_of_order(folder, t))
        last = 0 if rest is None else int(np.searchsorted(t, t[len(rest) - 1]))
        rest = whole.slice(last)
        if last:
            yield whole.slice(0, last)
    if rest is not None:
        yield rest


def _out_of_order(folder: Path, t: Floats) -> str:
    """What is wrong with rows at times t (N,) and what to do."""
    path = folder / "tracks.parquet"
    path = path if path.is_file() else folder / "tracks.csv"
    if np.isfinite(t).all():
        return f"{path} is damaged: its rows are not in order of time; sort them by time_s"
    return f"{path} is damaged: a row has no time_s; fill it in, or leave the row out"


def blocks(folder: Path, columns: tuple[str, ...]) -> Iterator[pa.Table]:
    """Some columns of a run's table of tracks, a block of rows at a time. Raises FormatError."""
    path = folder / "tracks.parquet"
    if not path.is_file():
        yield from _csv_blocks(folder / "tracks.csv", columns)
        return
    waiting: list[pa.RecordBatch] = []
    try:
        with pq.ParquetFile(path, read_dictionary=["status"], pre_buffer=False) as file:  # else all of it is buffered
            for batch in file.iter_batches(BLOCK, columns=list(columns)):
                waiting.append(batch)
                if sum(map(len, waiting)) >= BLOCK:
                    yield pa.Table.from_batches(waiting)
                    waiting.clear()
    except (pa.ArrowInvalid, OSError) as error:
        raise damaged(path, error) from None
    if waiting:
        yield pa.Table.from_batches(waiting)


def _csv_blocks(path: Path, columns: tuple[str, ...]) -> Iterator[pa.Table]:
    """Of the whole lines: a run that goes on may be writing the last one, and in one that ended it may have no end."""
    kinds = {name: pa.float64() for name in columns} | {"track_id": pa.int64(), "status": pa.string()}
    convert = pyarrow.csv.ConvertOptions(
        column_types={name: kinds[name] for name in columns}, include_columns=list(columns)
    )
    try:
        whole = pa.OSFile(str(path)).get_stream(0, path.stat().st_size if ended(path.parent) else _whole_lines(path))
        with pyarrow.csv.open_csv(whole, convert_options=convert) as reader:
            for batch in reader:
                yield pa.Table.from_batches([batch])
    except (pa.ArrowInvalid, pa.ArrowKeyError) as error:
        raise damaged(path, error) from None


def _whole_lines(path: Path) -> int:
    """Bytes of a table to the end of its last whole line."""
    with path.open("rb") as file:
        begin = max(0, file.seek(0, SEEK_END) - _LONGEST_LINE)
        file.seek(begin)
        return begin + file.read(_LONGEST_LINE).rfind(b"\n") + 1


def column_names(folder: Path) -> set[str]:
    """Names of the columns of a run's table of tracks. Raises FormatError."""
    path = folder / "tracks.parquet"
    if path.is_file():
        try:
            return set(pq.read_schema(path).names)
        except (pa.ArrowInvalid, OSError) as error:
            raise damaged(path, error) from None
    path = folder / "tracks.csv"
    try:
        with path.open(encoding="utf-8") as file:
            return set(file.readline().strip().split(","))
    except UnicodeDecodeError as error:
        raise damaged(path, error) from None


def numbers(table: pa.Table, name: str) -> Floats:
    """(N,) a column; NaN where it is empty."""
    return np.concatenate([np.empty(0), *_chunks(table, name)])


def side_by_side(table: pa.Table, names: Sequence[str]) -> Floats:
    """(N, K) columns; NaN where they are empty."""
    values = np.empty((len(table), len(names)))
    for k, name in enumerate(names):
        np.concatenate([np.empty(0), *_chunks(table, name)], out=values[:, k])
    return values


def _chunks(table: pa.Table, name: str) -> list[Floats]:
    """A column, as it lies in memory."""
    column = table[name]
    column = column if column.type == pa.float64() else column.cast(pa.float64())
    return [chunk.to_numpy(zero_copy_only=False) for chunk in column.chunks]
