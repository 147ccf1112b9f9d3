"""corrections.csv: what somebody found who looked at counted crossings, kept beside them."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

from vidtrack.errors import ConfigError, FormatError
from vidtrack.output.report.spreadsheet import without_apostrophe, write_sheet
from vidtrack.traffic.validation.audit import MISSED, VERDICTS, Correction, Reviewed, audited, review_of
from vidtrack.traffic.validation.audit_events import read_counted

NAME = "corrections.csv"
HEADER = ("verdict", "time_s", "gate", "direction", "run", "track_id")


def read_corrections(folder: Path) -> tuple[Correction, ...]:
    """The corrections in a folder; none without a file. Raises FormatError, naming the line."""
    path = folder / NAME
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            table = csv.DictReader(file, restval="")
            if table.fieldnames is None or not set(HEADER) <= set(table.fieldnames):
                raise FormatError(f"{path} does not have the columns {', '.join(HEADER)}")
            return tuple(_correction(row, f"{path}, line {i}") for i, row in enumerate(table, start=2))
    except FileNotFoundError:
        return ()
    except (UnicodeDecodeError, csv.Error) as error:
        raise FormatError(f"{path} is no CSV table: {error}") from None


def reviewed(folder: Path) -> Reviewed | None:
    """What the corrections in a folder say about its counts; None without any. Raises FormatError, SourceError."""
    corrections = read_corrections(folder)
    if not corrections:
        return None
    counted = read_counted(folder)
    return review_of(counted, audited(counted.events, corrections))


def _correction(row: dict[str, str], where: str) -> Correction:
    verdict = row["verdict"]
    if verdict not in (*VERDICTS, MISSED):
        raise FormatError(f"{where}: verdict is {verdict!r}; it is one of {', '.join((*VERDICTS, MISSED))}")
    try:
        gate, direction = (without_apostrophe(row[name]) for name in ("gate", "direction"))
        track = [int(row[name]) if row[name] else None for name in ("run", "track_id")]
        return Correction(verdict, float(row["time_s"]), gate, direction, *track)
    except ValueError as error:
        raise FormatError(f"{where}: {error}") from None


class CorrectionsFile:
    """Writes corrections.csv in a folder, whole and at once; one program at a time (`output.lock`).

    rows  what it holds
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / NAME
        self.rows = read_corrections(folder)
        self._known = self._content()

    def replace(self, rows: Sequence[Correction]) -> None:
        """Write these rows. Raises ConfigError for a file that changed meanwhile, StoppedEarly on a full disk."""
        if self._content() != self._known:
            raise ConfigError(f"{self._path.name} was changed by another program; start vidtrack review again")
        cells = [(one.verdict, one.time_s, one.gate, one.direction, one.run, one.track_id) for one in rows]
        write_sheet(self._path, HEADER, cells)
        self.rows, self._known = tuple(rows), self._content()

    def _content(self) -> bytes | None:
        return self._path.read_bytes() if self._path.is_file() else None
