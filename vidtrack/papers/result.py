"""The result of an experiment: a figure, a table, and one sentence."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vidtrack.output.folder import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Row = dict[str, object]


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """An experiment's outcome.

    figure   the figure, not yet written
    rows     the table, with the paper's or a reference's values; all rows have the same keys
    verdict  one sentence: the outcome, compared with the paper
    """

    figure: Figure
    rows: Sequence[Row]
    verdict: str

    def write(self, folder: Path, name: str) -> None:
        """Write NAME.png and NAME.csv into an existing folder, each at once. Raises StoppedEarly if writing fails."""
        with replacing(folder / f"{name}.png") as new:
            self.figure.savefig(new, format="png")
        with replacing(folder / f"{name}.csv") as new, new.open("w", newline="", encoding="utf-8") as file:
            table = csv.DictWriter(file, list(self.rows[0]))
            table.writeheader()
            table.writerows({key: _text(value) for key, value in row.items()} for row in self.rows)


def _text(value: object) -> object:
    return f"{value:.6g}" if isinstance(value, float) else value
