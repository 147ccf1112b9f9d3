"""The results of a live run: one part after the other, so that every part is closed and can be deleted by itself."""

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
from vidtrack.output.summary import Summary
from vidtrack.output.tables import ROAD, VIDEO, csv_text, track_rows
from vidtrack.recording.retention import Retention, new_part, parts_of, size_of
from vidtrack.run.sinks import Subject

log = logging.getLogger(__name__)

_LOOK_S = 10.0  # between two looks at the sizes


class Parts:
    """Writes steps of confirmed tracks into the current part.

    root       the run's folder
    subject    its crossings go into each part's counts.csv
    decisions  each part has decisions.csv
    roll_s     length of a part by the clock: 3600 goes from one full hour to the next; None: root is the only part

    Parts that an earlier run could not finish are repaired meanwhile.
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
        """Write a batch. Raises StoppedEarly when the disk refuses; the next batch may fit again."""
        crossings = ""
        if self._counter is not None:
            crossings = "".join(crossing_lines(self._counter.step(step.index, step.tracks)) for step in steps)
        if self._whole is not None:
            count(self._whole, steps)
        self._roll()
        (self._part or self._begin()).write(steps, crossings)

    def finish(self) -> None:
        """End the last part, and wait for those that are being finished."""
        with ExitStack() as stack:
            if self._whole is not None:
                self._whole.interrupted = False
                stack.callback(self._whole.close)
            if self._part is not None:
                stack.callback(self._part.finish)
        for thread in self._finishing:
            thread.join()

    def _roll(self) -> None:
        """End the part if it is old or large enough."""
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
        """Which stretch of the clock this is."""
        return 0 if self._roll_s is None else int(time.time() // self._roll_s)

    def _later(self, finish: Callable[..., object], *of: object) -> None:
        """Finish a part in another thread, so that the next one is written meanwhile."""

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
    """The same files as those of a run over a video: tables that grow, and what is made of them at the end.

    subject  its counter counts on through all parts

    Raises StoppedEarly when the disk refuses.
    """

    def __init__(self, folder: Path, subject: Subject, decisions: bool) -> None:
        self.folder = folder
        self._road = subject.road
        self._columns = VIDEO if subject.road is None else (*VIDEO, *ROAD)
        with ExitStack() as stack:  # if the disk is full, what is open by then is closed
            self._summary = subject.summary(folder)
            self._tracks = LineFile(folder / "tracks.csv", ",".join(column.name for column in self._columns) + "\n")
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

    def write(self, steps: Sequence[Step], crossings: str) -> None:
        """Put the rows of confirmed tracks, and rows of counts.csv, on the disk."""
        filled = [step for step in steps if len(step.tracks)]
        if filled:
            _write(self._tracks, csv_text(track_rows(filled, self._columns, self._road)))
        if self._counts is not None and crossings:
            _write(self._counts, crossings)
        for step in steps:
            self._mot.step(step)
            self._plot.step(step)
            if self._decisions is not None:
                self._decisions.step(step)
        self._mot.flush()
        count(self._summary, steps)

    def finish(self) -> None:
        """Close the tables, sort them, and add tracks.parquet and tracks.png."""
        with ExitStack() as stack:
            self._summary.interrupted = False
            stack.callback(self._summary.close)
            stack.callback(self._plot.close)
            stack.callback(add_parquet, self.folder)
            if self._counts is not None:
                stack.callback(sort_rows, self._counts.path, columns=1, header=True)
            stack.push(self._files)


def count(summary: Summary, steps: Sequence[Step]) -> None:
    """Bring a summary up to date; if the disk refuses it now, the next one says the same and more."""
    for step in steps:
        with suppress(StoppedEarly):
            summary.step(step)


def _write(file: LineFile, lines: str) -> None:
    """Bring lines to the disk, safe from a power cut."""
    file.add(lines)
    file.flush()
    file.sync()
