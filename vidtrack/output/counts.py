"""counts.csv: the evidence for each count."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from vidtrack.output.linefile import LineFile, sort_rows
from vidtrack.output.sink import Step
from vidtrack.traffic.lines import Crossing, LineCounter

HEADER = "time_s,frame,line,direction,track_id\n"


class CountsFile:
    """Sink that steps `counter` and writes its crossings; `close` sorts them by time."""

    def __init__(self, path: Path, counter: LineCounter) -> None:
        self._counter = counter
        self._file = LineFile(path, HEADER)

    def step(self, step: Step) -> None:
        """Count one frame's tracks."""
        self._file.add(crossing_lines(self._counter.step(step.index, step.tracks)))

    def close(self) -> None:
        """Count tracks that were last seen beyond a line."""
        try:
            self._file.add(crossing_lines(self._counter.close()))
        finally:
            self._file.close()
        sort_rows(self._file.path, columns=1, header=True)


def crossing_lines(crossings: Iterable[Crossing]) -> str:
    """Rows of counts.csv under HEADER."""
    return "".join(f"{c.time_s:.6f},{c.frame},{c.line},{c.direction},{c.track_id}\n" for c in crossings)
