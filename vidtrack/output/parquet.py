"""Writes Parquet in closed parts: a file without its footer is unreadable, so a kill loses only the open part."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import chain
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from vidtrack.errors import FormatError
from vidtrack.output.folder import replacing, writing
from vidtrack.output.linefile import Every

_PART_ROWS = 20_000  # 3 MB: rows buffered in memory, and rows in a group of the final file
_PART_S = 60.0


@contextmanager
def memory_of_c() -> Iterator[None]:
    """Context in which pyarrow takes its memory from the C library.

    Its own allocator keeps some of what every thread has freed, and each part of a live run is finished by a new one.
    """
    before = pa.default_memory_pool()
    pa.set_memory_pool(pa.system_memory_pool())
    try:
        yield
    finally:
        pa.set_memory_pool(before)


class ParquetParts:
    """Writes `NAME.parts/000000.parquet`, ...; `close` joins them to the file NAME.

    A killed run leaves the parts, each readable (`pyarrow.parquet.read_table` reads the folder).
    """

    def __init__(self, path: Path, schema: pa.Schema) -> None:
        self._path = path
        self._schema = schema
        self._folder = parts_folder(path)
        self._waiting: list[pa.Table] = []
        self._count = 0
        self._due = Every(_PART_S)

    def add(self, rows: pa.Table) -> None:
        """Add rows; close the part before them if it is large or old enough."""
        if self._waiting and (self._due() or sum(len(table) for table in self._waiting) >= _PART_ROWS):
            self._close_part()
        self._waiting.append(rows)

    def close(self) -> None:
        """Join all parts into one file."""
        parts = (pq.read_table(self._part(i)) for i in range(self._count))
        last = pa.concat_tables([self._schema.empty_table(), *self._waiting])
        write_parquet(self._path, self._schema, chain(parts, [last]))
        shutil.rmtree(self._folder, ignore_errors=True)

    def _close_part(self) -> None:
        table = pa.concat_tables(self._waiting)
        self._waiting.clear()
        path = self._part(self._count)
        with writing(path):
            self._folder.mkdir(exist_ok=True)
        write_parquet(path, self._schema, [table])
        self._count += 1

    def _part(self, number: int) -> Path:
        return self._folder / f"{number:06d}.parquet"


def _grouped(tables: Iterable[pa.Table]) -> Iterator[pa.Table]:
    """The same rows in tables of at least _PART_ROWS rows, except the last."""
    group: list[pa.Table] = []
    for table in tables:
        group.append(table)
        if sum(len(part) for part in group) >= _PART_ROWS:
            yield pa.concat_tables(group)
            group.clear()
    if group:
        yield pa.concat_tables(group)


def parts_folder(path: Path) -> Path:
    """Folder of the parts of an unfinished Parquet file."""
    return path.with_name(path.name + ".parts")


def read_parquet(path: Path) -> pa.Table:
    """The rows of a Parquet file. Raises FormatError."""
    try:
        return pq.read_table(path)
    except (pa.ArrowInvalid, OSError) as error:
        raise FormatError(f"{path} is damaged: {error}") from None


def join_parts(path: Path) -> pa.Table:
    """Write a Parquet file from the parts that a killed run left; returns its rows. Raises FormatError."""
    tables = [read_parquet(part) for part in sorted(parts_folder(path).glob("*.parquet"))]
    if not tables:
        raise FormatError(f"{path.parent} is not a run: it was killed before its tracks were written")
    table = pa.concat_tables(tables)
    write_parquet(path, table.schema, [table])
    return table


def write_parquet(path: Path, schema: pa.Schema, tables: Iterable[pa.Table]) -> None:
    """Write the tables to one file, which appears when it is complete."""
    with replacing(path) as new, pq.ParquetWriter(new, schema) as writer:
        for table in _grouped(tables):
            writer.write_table(table)
