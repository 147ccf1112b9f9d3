"""The results of a live run: one part after the other, so that every part is closed and can be deleted by itself."""

from __future__ import annotations

import logging
import shutil
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from threading import Thread

from vidtrack.errors import Error, StoppedEarly
from vidtrack.output.counts import crossing_lines
from vidtrack.output.folder import writing
from vidtrack.output.linefile import Every
from vidtrack.output.repair import repair
from vidtrack.output.sink import Step
from vidtrack.run.live.part import Part, count
from vidtrack.run.live.retention import Retention, new_part, parts_of, size_of
from vidtrack.run.sinks import Subject

log = logging.getLogger(__name__)

_LOOK_S = 10.0  # between two looks at the sizes


class Parts:
    """Writes steps of confirmed tracks into the current part.

    root       the run's folder
    subject    its crossings go into each part's counts.csv
    open_part  makes a part in a folder
    roll_s     length of a part by the clock: 3600 goes from one full hour to the next; None: root is the only part

    Parts that an earlier run could not finish are repaired meanwhile.
    """

    def __init__(
        self,
        root: Path,
        subject: Subject,
        open_part: Callable[[Path], Part],
        roll_s: float | None,
        retention: Retention,
    ) -> None:
        self._root = root
        self._open_part = open_part
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
            self._part = self._open_part(self._folder)
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
