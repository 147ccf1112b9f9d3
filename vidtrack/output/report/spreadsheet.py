"""CSV that a spreadsheet opens and runs nothing of."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from vidtrack.output.folder import replacing

_DECIMALS = 4
Cell = str | float | int | None
_FORMULA = tuple("=+-@＝＋－＠")
_CONTROL = re.compile(r"[\x00-\x1f]")


def write_sheet(path: Path, header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> None:
    """Write UTF-8 with a byte order mark, as spreadsheets expect it; None and NaN become empty cells.

    Words that a spreadsheet would take for a formula get an apostrophe in front; control characters become spaces.
    Raises StoppedEarly on a full disk.
    """
    with replacing(path) as new, new.open("w", encoding="utf-8-sig", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([_plain(name) for name in header])
        writer.writerows([_plain(cell) for cell in row] for row in rows)


def without_apostrophe(cell: str) -> str:
    """The words of a cell as they were before `write_sheet` put an apostrophe in front."""
    return cell[1:] if cell.startswith("'") and cell[1:].lstrip().startswith(_FORMULA) else cell


def _plain(cell: Cell) -> str:
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return ""
    if isinstance(cell, str):
        line = _CONTROL.sub(" ", cell)
        return f"'{line}" if line.lstrip().startswith(_FORMULA) else line
    return f"{round(cell, _DECIMALS):.12g}"
