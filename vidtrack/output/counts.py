"""counts.csv: one row per line crossing."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from vidtrack.output.linefile import LineFile, sort_rows
from vidtrack.output.sink import Step
from vidtrack.traffic.lines import Crossing, LineCounter

HEADER = "time_s,frame,line,direction,track_id\n"


class CountsFile:
    """Sink that runs `counter` and writes its crossings; `close` sorts them by time."""

    def __init__(self, path: Path, counter: LineCounter) -> None:
        self._counter = counter
        self._file = LineFile(path, HEADER)

    def step(self, step: Step) -> None:
        """Count one frame's tracks."""
        self._file.add(crossing_lines(self._counter.step(step.index, step.tracks)))

    def close(self) -> None:
        """Count tracks whose last position is beyond a line, and sort."""
        try:
            self._file.add(crossing_lines(self._counter.close()))
        finally:
            self._file.close()
        sort_rows(self._file.path, columns=1, header=True)


def crossing_lines(crossings: Iterable[Crossing]) -> str:
    """Rows of counts.csv, in the columns of HEADER."""
    return "".join(f"{c.time_s:.6f},{c.frame},{c.line},{c.direction},{c.track_id}\n" for c in crossings)
