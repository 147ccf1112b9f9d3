"""Writes the results of a live run in consecutive parts, each complete and deletable by itself."""

from __future__ import annotations

import logging
import shutil
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from threading import Thread

import pyarrow as pa

from vidtrack.errors import Error, StoppedEarly
from vidtrack.output.counts import HEADER, crossing_lines
from vidtrack.output.decisions import DecisionLog
from vidtrack.output.folder import writing
from vidtrack.output.linefile import Every, LineFile, sort_rows
from vidtrack.output.mot import MotFile
from vidtrack.output.plot import TrajectoryPlot
from vidtrack.output.repair import add_parquet, repair
from vidtrack.output.sink import Step
from vidtrack.output.summary import Summary
from vidtrack.output.tables import ROAD, VIDEO, Column, csv_text, track_rows
from vidtrack.recording.reserve import Reserve
from vidtrack.recording.retention import Retention, new_part, parts_of, size_of
from vidtrack.run.live.counting import Counting
from vidtrack.run.sinks import Subject
from vidtrack.traffic.lines import Crossing

log = logging.getLogger(__name__)

_LOOK_S = 2.0  # between two checks of sizes
_MOST = 100_000  # crossings that wait for room on the disk


class Parts:
    """Writes steps of confirmed tracks to the current part.

    root       the run's folder
    subject    of the run
    decisions  whether each part has a decisions.csv
    roll_s     length of a part [s], aligned to the clock: 3600 begins parts at full hours; None: root is the only part
    counting   finds the crossings for each part's counts.csv; None without counting lines
    reserve    of the disk, which tracks leave to counts

    What matters more is written first, and whatever fails, the rest is tried: counts by interval, crossings, tracks.
    Unfinished parts of an earlier run are repaired in another thread.
    """

    def __init__(
        self,
        root: Path,
        subject: Subject,
        decisions: bool,
        roll_s: float | None,
        retention: Retention,
        counting: Counting | None,
        reserve: Reserve,
    ) -> None:
        self._root = root
        self._subject = subject
        self._decisions = decisions
        self._columns = VIDEO if subject.road is None else (*VIDEO, *ROAD)
        self._roll_s = roll_s
        self._retention = retention
        self._counting = counting
        self._reserve = reserve
        self._crossings: deque[Crossing] = deque(maxlen=_MOST)
        self._ended: list[Part] = []
        self._look = Every(_LOOK_S)
        self._finishing: list[Thread] = []
        begun = [part for part in parts_of(root) if (part / "tracks.csv").exists()]
        unfinished = [part for part in begun if not (part / "tracks.parquet").exists()]
        self._whole = None if roll_s is None else subject.summary(root)
        self._number = 0
        self._part: Part | None = None
        self._begin()
        for part in unfinished:
            self._later(repair, part)

    def write(self, steps: Sequence[Step]) -> None:
        """Write a batch. Raises StoppedEarly on a write error; a later batch may succeed."""
        filled = [step for step in steps if len(step.tracks)]
        rows = track_rows(filled, self._columns, self._subject.road) if filled else None
        if self._whole is not None:
            count(self._whole, steps)
        with ExitStack() as stack:  # called from the last to the first
            stack.callback(self._write_part, steps, rows)
            if self._counting is not None:
                on_road = None if self._subject.road is None else rows
                self._crossings.extend(self._counting.step(steps, on_road))
                stack.callback(self._counting.save)

    def finish(self) -> None:
        """End the last part, and wait for parts that are being finished."""
        with ExitStack() as stack:
            if self._whole is not None:
                self._whole.interrupted = False
                stack.callback(self._whole.close)
            for part in (*self._ended, *([self._part] if self._part else [])):
                stack.callback(part.finish)
            if self._counting is not None:
                self._crossings.extend(self._counting.end())
                stack.callback(self._write_crossings)
                stack.callback(self._counting.close)
        for thread in self._finishing:
            thread.join()

    def _write_part(self, steps: Sequence[Step], rows: pa.Table | None) -> None:
        self._roll()
        part = self._part or self._begin()
        self._write_crossings()
        self._reserve.check_tracks(self._root)
        part.write(steps, rows)
        for ended in [ended for ended in self._ended if ended.is_settled(steps)]:
            self._ended.remove(ended)
            self._later(Part.finish, ended)

    def _write_crossings(self) -> None:
        """Write the crossings, those too that there was no room for before."""
        if self._part is not None and self._crossings:
            self._part.write_crossings(self._crossings)
            self._crossings.clear()

    def _roll(self) -> None:
        """End the current part if its period is over or it is too large."""
        large = False
        if self._look():
            self._retention.prune()
            limit = self._retention.tracks_part
            large = self._roll_s is not None and limit is not None and size_of(self._folder) > limit
        if self._part is not None and (large or self._period() != self._number):
            ended, self._part = self._part, None
            self._ended.append(ended)
            ended.end()

    def _begin(self) -> Part:
        self._number = self._period()
        with writing(self._root):
            self._folder = self._root if self._roll_s is None else new_part(self._root)
        try:
            self._part = Part(self._folder, self._subject, self._decisions, self._columns)
        except StoppedEarly:
            if self._folder != self._root:
                shutil.rmtree(self._folder, ignore_errors=True)
            raise
        return self._part

    def _period(self) -> int:
        """Number of the current period of `roll_s` seconds."""
        return 0 if self._roll_s is None else int(time.time() // self._roll_s)

    def _later(self, finish: Callable[..., object], *of: object) -> None:
        """Finish a part in another thread, so that the next part can be written."""

        def run() -> None:
            try:
                finish(*of)
            except (Error, OSError) as error:
                log.warning("a part could not be finished: %s", error)

        self._finishing = [thread for thread in self._finishing if thread.is_alive()]
        thread = Thread(target=run, name="finish-part", daemon=True)
        thread.start()
        self._finishing.append(thread)


class Part:
    """One part: the same files as those of a run over a video.

    columns  of its tracks

    Raises StoppedEarly on a write error.
    """

    def __init__(self, folder: Path, subject: Subject, decisions: bool, columns: Sequence[Column]) -> None:
        self.folder = folder
        self._lines = subject.lines
        self._counted: Counter[tuple[str, str]] = Counter()
        with ExitStack() as stack:  # on a full disk, files already open are closed
            self._summary = subject.summary(folder, self._totals)
            self._tracks = LineFile(folder / "tracks.csv", ",".join(column.name for column in columns) + "\n")
            stack.callback(self._tracks.close)
            self._mot = MotFile(folder / "mot.txt")
            stack.callback(self._mot.close)
            self._counts = self._decisions = None
            if subject.counter is not None:
                self._counts = LineFile(folder / "counts.csv", HEADER)
                stack.callback(self._counts.close)
            if decisions:
                self._decisions = DecisionLog(folder / "decisions.csv")
                stack.callback(self._decisions.close)
            self._plot = TrajectoryPlot(folder / "tracks.png", subject.shape, subject.scene, subject.lines)
            self._files = stack.pop_all()

    def write_crossings(self, crossings: Iterable[Crossing]) -> None:
        """Write and synchronise rows of counts.csv."""
        assert self._counts is not None
        _write(self._counts, crossing_lines(crossings))
        self._counted.update((crossing.line, crossing.direction) for crossing in crossings)

    def write(self, steps: Sequence[Step], rows: pa.Table | None) -> None:
        """Write and synchronise steps and the rows of their confirmed tracks."""
        if rows is not None:
            _write(self._tracks, csv_text(rows))
        for step in steps:
            self._mot.step(step)
            self._plot.step(step)
            if self._decisions is not None:
                self._decisions.step(step)
        self._mot.flush()
        count(self._summary, steps)

    def end(self) -> None:
        """No more steps will be written; tracks in a gap may still be found again."""
        self._mot.end()

    def is_settled(self, later: Sequence[Step]) -> bool:
        """Whether no gap is open, given the steps after the part."""
        for step in later:
            self._mot.step(step)
        self._mot.flush()
        return not self._mot.waits

    def _totals(self) -> dict[str, dict[str, int]]:
        """The part's counts by line and direction."""
        return {line.name: {way: self._counted[line.name, way] for way in line.directions} for line in self._lines}

    def finish(self) -> None:
        """Close and sort the tables; write tracks.parquet and tracks.png."""
        with ExitStack() as stack:
            self._summary.interrupted = False
            stack.callback(self._summary.close)
            stack.callback(self._plot.close)
            stack.callback(add_parquet, self.folder)
            if self._counts is not None:
                stack.callback(sort_rows, self._counts.path, columns=1, header=True)
            stack.push(self._files)


def count(summary: Summary, steps: Sequence[Step]) -> None:
    """Update a summary; a write error is ignored, because the next write contains everything."""
    for step in steps:
        with suppress(StoppedEarly):
            summary.step(step)


def _write(file: LineFile, lines: str) -> None:
    """Write lines and synchronise the file with the disk."""
    file.add(lines)
    file.flush()
    file.sync()
