"""One part of a live run: its summary, its crossings, and its tracks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path

import pyarrow as pa

from vidtrack.errors import StoppedEarly
from vidtrack.output.counts import HEADER, crossing_lines
from vidtrack.output.decisions import DecisionLog
from vidtrack.output.linefile import LineFile, sort_rows
from vidtrack.output.sink import Step
from vidtrack.output.site_copy import SiteCopy
from vidtrack.output.summary import Summary
from vidtrack.output.tables import ROAD, VIDEO, Column
from vidtrack.run.live.track_files import TRACK_FILES, write_lines
from vidtrack.run.sinks import Subject
from vidtrack.traffic.lines import Crossing, Line


class Counted:
    """Counts of a part by line and direction."""

    def __init__(self, lines: Iterable[Line]) -> None:
        self._counts = Counter({(line.name, way): 0 for line in lines for way in line.directions})

    def add(self, crossings: Iterable[Crossing]) -> None:
        """Count crossings."""
        self._counts.update((crossing.line, crossing.direction) for crossing in crossings)

    def totals(self) -> dict[str, dict[str, int]]:
        """The counts; 0 for a line that nobody crossed."""
        found: dict[str, dict[str, int]] = {}
        for (line, way), count in self._counts.items():
            found.setdefault(line, {})[way] = count
        return found


class Part:
    """One part: with output.level = all the same files as those of a run over a video.

    Nothing that it owns refers to it: in a cycle, its pictures would stay until Python looks for cycles, which may be
    after hundreds of parts.
    Raises StoppedEarly on a write error.
    """

    def __init__(self, folder: Path, subject: Subject, decisions: bool) -> None:
        self.subject = subject
        self._counted = Counted(subject.lines)
        with ExitStack() as stack:  # on a full disk, files already open are closed
            self._summary = subject.summary(folder, self._counted.totals)
            self._counts = self._decisions = self._site = None
            if subject.site is not None:
                self._site = SiteCopy(folder, subject.site)
            if subject.counter is not None:
                self._counts = LineFile(folder / "counts.csv", HEADER)
                stack.callback(self._counts.close)
            if decisions:
                self._decisions = DecisionLog(folder / "decisions.csv")
                stack.callback(self._decisions.close)
            self._tracks = TRACK_FILES[subject.settings.output.level](folder, subject, columns_of(subject))
            self._files = stack.pop_all()

    def write_crossings(self, crossings: Iterable[Crossing]) -> None:
        """Write and synchronise rows of counts.csv."""
        assert self._counts is not None
        write_lines(self._counts, crossing_lines(crossings))
        self._counted.add(crossings)

    def write(self, steps: Sequence[Step], chosen: Sequence[Step], rows: pa.Table | None) -> None:
        """Write and synchronise the chosen ones of these steps, and the rows of their confirmed tracks."""
        self._tracks.write(chosen, rows)
        for step in steps:
            if self._site is not None:
                self._site.step(step)
            if self._decisions is not None:
                self._decisions.step(step)
        count(self._summary, steps)

    def end(self) -> None:
        """No more steps will be written; tracks in a gap may still be found again."""
        self._tracks.end()

    def is_settled(self, later: Sequence[Step]) -> bool:
        """Whether no gap is open, given the steps after the part."""
        return self._tracks.is_settled(later)

    def finish(self) -> None:
        """Close and sort the tables; complete the files of tracks."""
        with ExitStack() as stack:
            self._summary.interrupted = False
            stack.callback(self._summary.close)
            stack.callback(self._tracks.finish)
            if self._counts is not None:
                stack.callback(sort_rows, self._counts.path, columns=1, header=True)
            stack.push(self._files)


def columns_of(subject: Subject) -> Sequence[Column]:
    """The columns of a part's tracks."""
    return VIDEO if subject.road is None else (*VIDEO, *ROAD)


def count(summary: Summary, steps: Sequence[Step]) -> None:
    """Update a summary; a write error is ignored, because the next write contains everything."""
    for step in steps:
        with suppress(StoppedEarly):
            summary.step(step)
