"""Number columns of a CSV or Parquet file, and the faults by line."""

from __future__ import annotations

import difflib
import re
from codecs import BOM_UTF8
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.csv
import pyarrow.parquet

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.errors import PlotFormatError, SourceError

WIDE = ("utf-32-le", "utf-32-be", "utf-16-le", "utf-16-be")
"""Encodings of text that are named, since they are not read."""
PLAIN = 0.9
"""Share of characters of a table or of NMEA that are ASCII."""
SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars"}
"""What programs write between the cells of a line in place of commas."""
LOOKED_AT = 4096
"""Octets from which an encoding is told."""

Faults = dict[int, str]
"""Fault by line of the file; the first fault of a line is kept."""

SHOWN = 5
"""Number of faults that a message lists."""
EMPTY = ("", "none", "null", "nan")
"""Cells without a value, in lower case."""
SENSOR = "(radar|sensor|station)(id|name|no|nr|number)?"
"""Names, without case and punctuation, of a column that tells which radar a plot is of."""
DATED = ("date", "day")
"""Words, one of which is in the name of a column that tells the day of a plot, whatever is in its cells."""
CENTURIES = range(1900, 2100)
"""Years of dates that are written as plain numbers."""


@dataclass(frozen=True, slots=True)
class Table:
    """A file's columns as numbers, NaN for cells that are not numbers.

    cells   all columns as they are in the file; `columns` has the wanted ones
    line    (N,) line of each row: the header of a CSV is line 1, blank lines do not count; rows of a Parquet file
            count from 1
    unit    what `line` counts: "line" or "row"
    faults  bad lines and cells
    """

    path: Path
    cells: pa.Table
    columns: dict[str, Floats]
    line: Ints
    unit: str
    faults: Faults

    @property
    def names(self) -> list[str]:
        """Names of all columns in the file."""
        return self.cells.column_names

    def changes(self, name: str) -> Mask:
        """(N,) rows whose cell in a column is another than that of the row before."""
        column = self.cells[name]
        try:
            same = pa.compute.equal(column[1:], column[:-1]).fill_null(False)
        except pa.ArrowNotImplementedError:  # cells that cannot be compared
            return np.arange(len(column)) > 0
        return np.concatenate([[False], ~same.to_numpy()])

    def values(self, name: str) -> set[str]:
        """The different values of a column, as text; empty cells have none."""
        column = self.cells[name]
        with suppress(pa.ArrowNotImplementedError):  # cells that cannot be compared
            column = column.unique()
        return {text for text in map(str, column.to_pylist()) if text.strip().lower() not in EMPTY}

    def days(self, name: str) -> Ints | None:
        """(N,) the day that a column tells of each row; None if it tells none, or not of all.

        Columns of dates do, and those whose names have a word of DATED, of numbers or else of names in order of days.
        """
        named = any(word in DATED for word in re.split(r"[\W_]+", name.lower()))
        try:
            coded = self.cells[name].combine_chunks().dictionary_encode()
        except pa.ArrowNotImplementedError:  # cells that cannot be compared
            return None
        values = coded.dictionary.to_pylist()
        if coded.null_count or not (named or _day(values[0])):
            return None
        number: list[int | None] = [_day(value) for value in values]
        if None in number and not named:
            return None
        if None in number and all(re.fullmatch(r"\d{1,5}", str(value)) for value in values):
            number = [int(value) for value in values]
        elif None in number:
            number = list(range(len(values)))
        return np.array(number, np.int64)[coded.indices.to_numpy()]

    def refuse(self, bad: Mask, name: str, rule: str) -> None:
        """Add a fault for the rows of a mask (N,) whose value in column `name` breaks a rule."""
        for row in np.flatnonzero(bad):
            self.note(int(row), f"{name} is {self.columns[name][row]:.10g}; {rule}")

    def note(self, row: int, fault: str) -> None:
        """Add a fault of a row."""
        self.faults.setdefault(int(self.line[row]), fault)

    @property
    def good(self) -> Mask:
        """(N,) rows without a fault."""
        return ~np.isin(self.line, list(self.faults))

    def problem(self) -> str:
        """The message about all faults; it lists the first few."""
        return _complaint(self.path, self.unit, self.faults)


def read_table(path: Path, wanted: Iterable[str]) -> Table:
    """The wanted columns of a CSV or Parquet file; the content decides which format it is.

    Raises SourceError if the file does not exist, PlotFormatError if it has neither format, or no rows.
    """
    try:
        with path.open("rb") as file:
            beginning = file.read(LOOKED_AT)
    except OSError as error:
        raise SourceError(f"cannot open {path}: {error.strerror}; give a CSV or Parquet file of plots") from None
    if not beginning.removeprefix(BOM_UTF8).strip() and len(beginning) < LOOKED_AT:
        raise PlotFormatError(f"{path} is empty; give a table of plots (CSV, Parquet) or a recording (ASTERIX, NMEA)")
    wide = _wide(beginning)
    if wide is not None:
        raise PlotFormatError(f"{path} is text in {wide.upper()[:6]}; save it in UTF-8")
    faults: Faults = {}
    parquet = beginning.startswith(b"PAR1")
    unit = "row" if parquet else "line"
    try:
        table = pyarrow.parquet.read_table(path) if parquet else _read_csv(path, faults)
        table = table.rename_columns([name.strip() for name in table.column_names])
    except (pa.ArrowException, UnicodeDecodeError, OSError) as error:
        binary = isinstance(error, UnicodeDecodeError)
        reason = "its content is not text" if binary else str(error).strip().splitlines()[0]
        if parquet:
            raise PlotFormatError(f"{path} is not a readable Parquet file: {reason}") from None
        raise PlotFormatError(
            f"{path} is neither a table of plots (CSV, Parquet) nor a recording of ASTERIX or NMEA: {reason}; give one"
        ) from None
    header = ",".join(table.column_names)
    for mark, called in SEPARATORS.items():
        if header.count(mark) >= table.num_columns:
            raise PlotFormatError(f"{path}: the cells of a line are separated by {called}; save it with commas")
    _refuse_repeated_names(path, table.column_names)
    if not len(table):
        raise PlotFormatError(
            _complaint(path, unit, faults) if faults else f"{path} holds no plots but a line of names"
        )
    line = np.arange(1, len(table) + 1) if parquet else _lines(len(table), list(faults))
    columns = {name: _numbers(table[name], name, line, faults) for name in wanted if name in table.column_names}
    return Table(path, table, columns, line, unit, faults)


def _wide(beginning: bytes) -> str | None:
    """The encoding of text in characters of two or four octets, with or without a byte order mark; None: it is none."""
    whole = beginning[: len(beginning) // 4 * 4]
    for encoding in WIDE if b"\0" in whole else ():
        text = whole.decode(encoding, errors="replace")
        plain = sum(one.isascii() and (one.isprintable() or one.isspace()) for one in text)
        if plain > PLAIN * len(text):
            return encoding
    return None


def nearest(wanted: str, names: Iterable[str]) -> str:
    """Part of a message: the names that resemble a wanted one."""
    names = list(names)
    near = difflib.get_close_matches(wanted, names, n=3, cutoff=0.5) or names[:6]
    return f"the nearest {'is' if len(near) == 1 else 'are'} {', '.join(map(repr, near))}" if near else "it has none"


def bare(name: str) -> str:
    """A column's name without case, punctuation and unit."""
    words = re.split(r"[\W_]+", name.lower())
    return "".join(word for word in words if word not in ("m", "s", "deg", "rad", "km", "degrees"))


def names_sensors(name: str) -> bool:
    """Whether a column of this name tells which radar a plot is of."""
    return re.fullmatch(SENSOR, bare(name)) is not None


def _complaint(path: Path, unit: str, faults: Faults) -> str:
    count = len(faults)
    shown = [f"{unit} {line}: {fault}" for line, fault in sorted(faults.items())[:SHOWN]]
    more = [f"and {count - SHOWN} more"] if count > SHOWN else []
    return f"{path}: {count} bad {'row' if count == 1 else 'rows'}: " + "; ".join(shown + more)


def _read_csv(path: Path, faults: Faults) -> pa.Table:
    """All cells as text; rows with too few or too many of them become faults."""

    def uneven(row: pyarrow.csv.InvalidRow) -> str:
        faults[row.number] = f"{row.actual_columns} cells where the header has {row.expected_columns}"
        return "skip"

    content = path.read_bytes()
    header = content.decode("utf-8-sig").partition("\n")[0].strip("\r").replace('"', "").split(",")
    return pyarrow.csv.read_csv(
        pa.BufferReader(content),
        read_options=pyarrow.csv.ReadOptions(use_threads=False),  # rows are numbered in one thread only
        parse_options=pyarrow.csv.ParseOptions(invalid_row_handler=uneven),
        convert_options=pyarrow.csv.ConvertOptions(column_types={name: pa.string() for name in header}),
    )


def _lines(rows: int, skipped: list[int]) -> Ints:
    """(rows,) line of each row of a CSV, without the skipped lines."""
    return np.delete(np.arange(2, rows + len(skipped) + 2), np.array(skipped, np.int64) - 2)


def _refuse_repeated_names(path: Path, names: list[str]) -> None:
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise PlotFormatError(f"{path} has two columns {min(twice)!r}; keep one")


def _day(cell: object) -> int | None:
    """The number of the day of a date, with or without a time after it; None for another cell.

    Eight digits are a date in the years of CENTURIES only: serial numbers have them, too.
    """
    found = re.fullmatch(r"(\d{4}-?\d\d-?\d\d)([T ].*)?", str(cell).strip())
    if found is None or (found[0].isdigit() and int(found[0][:4]) not in CENTURIES):
        return None
    try:
        return date.fromisoformat(found[1]).toordinal()
    except ValueError:
        return None


def _numbers(column: pa.ChunkedArray, name: str, line: Ints, faults: Faults) -> Floats:
    """A column as floats; each cell that is not a number becomes a fault."""
    try:
        if pa.types.is_string(column.type):
            column = pa.compute.utf8_trim_whitespace(column)
        return np.array(column.cast(pa.float64()).to_numpy(), dtype=float)
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError):
        values = np.full(len(column), np.nan)
        for row, cell in enumerate(column.to_pylist()):
            try:
                values[row] = cell
            except (TypeError, ValueError):
                faults.setdefault(int(line[row]), f"{name} is {cell!r}; a number is needed")
        return values
