"""Writes the results of a live run in consecutive parts, each complete and deletable by itself."""

from __future__ import annotations

import logging
import shutil
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from threading import Thread

from vidtrack.errors import Error, StoppedEarly
from vidtrack.output.counts import HEADER, crossing_lines
from vidtrack.output.decisions import DecisionLog
from vidtrack.output.folder import writing
from vidtrack.output.linefile import Every, LineFile, sort_rows
from vidtrack.output.mot import MotFile
from vidtrack.output.plot import TrajectoryPlot
from vidtrack.output.repair import add_parquet, repair
from vidtrack.output.sink import Step
from vidtrack.output.site_copy import SiteCopy
from vidtrack.output.summary import Summary
from vidtrack.output.tables import ROAD, VIDEO, csv_text, track_rows
from vidtrack.recording.retention import Retention, new_part, parts_of, size_of
from vidtrack.run.sinks import Subject

log = logging.getLogger(__name__)

_LOOK_S = 10.0  # between two checks of sizes


class Parts:
    """Writes steps of confirmed tracks to the current part.

    root       the run's folder
    subject    its line crossings are written to each part's counts.csv
    decisions  whether each part has a decisions.csv
    roll_s     length of a part [s], aligned to the clock: 3600 begins parts at full hours; None: root is the only part

    Unfinished parts of an earlier run are repaired in another thread.
    """

    def __init__(
        self,
        root: Path,
        subject: Subject,
        decisions: bool,
        roll_s: float | None,
        retention: Retention,
    ) -> None:
        self._root = root
        self._subject = subject
        self._decisions = decisions
        self._roll_s = roll_s
        self._retention = retention
        self._counter = subject.counter
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
        crossings = ""
        if self._counter is not None:
            crossings = "".join(crossing_lines(self._counter.step(step.index, step.tracks)) for step in steps)
        if self._whole is not None:
            count(self._whole, steps)
        self._roll()
        (self._part or self._begin()).write(steps, crossings)

    def finish(self) -> None:
        """End the last part, and wait for parts that are being finished."""
        with ExitStack() as stack:
            if self._whole is not None:
                self._whole.interrupted = False
                stack.callback(self._whole.close)
            if self._part is not None:
                stack.callback(self._part.finish)
        for thread in self._finishing:
            thread.join()

    def _roll(self) -> None:
        """End the current part if its period is over or it is too large."""
        large = False
        if self._look():
            self._retention.prune()
            limit = self._retention.part_size
            large = self._roll_s is not None and limit is not None and size_of(self._folder) > limit
        if self._part is not None and (large or self._period() != self._number):
            self._later(Part.finish, self._part)
            self._part = None

    def _begin(self) -> Part:
        self._number = self._period()
        with writing(self._root):
            self._folder = self._root if self._roll_s is None else new_part(self._root)
        try:
            self._part = Part(self._folder, self._subject, self._decisions)
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

    subject  its line counter continues through all parts

    Raises StoppedEarly on a write error.
    """

    def __init__(self, folder: Path, subject: Subject, decisions: bool) -> None:
        self.folder = folder
        self._road = subject.road
        self._columns = VIDEO if subject.road is None else (*VIDEO, *ROAD)
        with ExitStack() as stack:  # on a full disk, files already open are closed
            self._summary = subject.summary(folder)
            self._tracks = LineFile(folder / "tracks.csv", ",".join(column.name for column in self._columns) + "\n")
            stack.callback(self._tracks.close)
            self._mot = MotFile(folder / "mot.txt")
            stack.callback(self._mot.close)
            self._counts = self._decisions = self._site = None
            if subject.site is not None:
                self._site = SiteCopy(folder, subject.site)
            if subject.counter is not None:
                self._counts = LineFile(folder / "counts.csv", HEADER)
                stack.callback(self._counts.close)
            if decisions:
                self._decisions = DecisionLog(folder / "decisions.csv")
                stack.callback(self._decisions.close)
            self._plot = TrajectoryPlot(folder / "tracks.png", subject.shape, subject.scene, subject.lines)
            self._files = stack.pop_all()

    def write(self, steps: Sequence[Step], crossings: str) -> None:
        """Write and synchronise the rows of confirmed tracks, and rows of counts.csv."""
        filled = [step for step in steps if len(step.tracks)]
        if filled:
            _write(self._tracks, csv_text(track_rows(filled, self._columns, self._road)))
        if self._counts is not None and crossings:
            _write(self._counts, crossings)
        for step in steps:
            self._mot.step(step)
            self._plot.step(step)
            if self._site is not None:
                self._site.step(step)
            if self._decisions is not None:
                self._decisions.step(step)
        self._mot.flush()
        count(self._summary, steps)

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
