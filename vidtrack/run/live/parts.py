"""Writes the results of a live run in consecutive parts, each complete and deletable by itself."""

from __future__ import annotations

import logging
import shutil
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from threading import Thread

import pyarrow as pa
import pyarrow.compute as pc

from vidtrack.errors import Error, StoppedEarly
from vidtrack.output.folder import writing
from vidtrack.output.linefile import Every
from vidtrack.output.repair import is_unfinished, repair
from vidtrack.output.scene import SCENE, write_scene
from vidtrack.output.sink import Step
from vidtrack.output.tables import track_rows
from vidtrack.output.thinned import Pace
from vidtrack.recording.reserve import Reserve
from vidtrack.recording.retention import Retention, new_part, parts_of, size_of
from vidtrack.run.live.counting import Counting
from vidtrack.run.live.events import LiveEvents
from vidtrack.run.live.part import Part, columns_of, count
from vidtrack.run.live.site import FollowedSite
from vidtrack.run.sinks import Subject
from vidtrack.traffic.lines import Crossing
from vidtrack.traffic.measures.rows import LiveReader
from vidtrack.traffic.metres import UsedSite

log = logging.getLogger(__name__)

_LOOK_S = 2.0  # between two checks of sizes
_SCENE_S = 10.0  # between two pictures of the scene, over which a site is drawn meanwhile
_MOST = 100_000  # crossings that wait for room on the disk


class Parts:
    """Writes steps of confirmed tracks to the current part.

    root       the run's folder
    subject    of the run
    decisions  whether each part has a decisions.csv
    roll_s     length of a part [s], aligned to the clock: 3600 begins parts at full hours; None: root is the only part
    counting   finds the crossings for each part's counts.csv; None without counting lines
    reserve    of the disk, which tracks leave to counts
    site       whose every change begins a part; None without a site. It needs `roll_s`
    events     are made of what is written; None: nobody is told of them

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
        site: FollowedSite | None = None,
        events: LiveEvents | None = None,
    ) -> None:
        self._events = events
        self._root = root
        self._subject = subject
        self._reader = _reader_of(subject)
        self._site = site
        self._decisions = decisions
        self._roll_s = roll_s
        self._retention = retention
        self._counting = counting
        self._reserve = reserve
        self._pace = Pace(subject.settings.output.every_s)
        self._crossings: deque[Crossing] = deque(maxlen=_MOST)
        self._ended: list[Part] = []
        self._look, self._show = Every(_LOOK_S), Every(_SCENE_S)
        self._finishing: list[Thread] = []
        unfinished = [part for part in parts_of(root) if is_unfinished(part)]
        self._whole = None if roll_s is None else subject.summary(root)
        self._number = 0
        self._part: Part | None = None
        self._begin()
        for part in unfinished:
            self._later(repair, part)

    def write(self, steps: Sequence[Step]) -> None:
        """Write a batch. Raises StoppedEarly on a write error; a later batch may succeed."""
        if self._site is not None and self._site.changed():
            self._use(self._site.used)
        if self._site is not None and self._subject.scene is not None and steps and self._is_scene_due():
            with suppress(Error, OSError):  # whoever draws has the last one
                self._reserve.check_tracks(self._root)
                write_scene(self._root, self._subject.scene())
        filled = [step for step in steps if len(step.tracks)]
        needed = self._subject.road is not None or self._subject.settings.output.level != "counts"
        rows = track_rows(filled, columns_of(self._subject), self._subject.road) if filled and needed else None
        if self._whole is not None:
            count(self._whole, steps)
        seen = None if self._reader is None or rows is None else self._reader.read(rows)
        with ExitStack() as stack:  # called from the last to the first
            stack.callback(self._write_part, steps, rows)
            if self._counting is not None:
                self._crossings.extend(self._counting.step(steps, seen))
                stack.callback(self._counting.save)
            if self._events is not None:
                self._events.step(steps, seen)
                stack.callback(self._events.save)

    def finish(self) -> None:
        """End the last part, and wait for parts that are being finished."""
        with ExitStack() as stack:
            if self._whole is not None:
                self._whole.interrupted = False
                stack.callback(self._whole.close)
            stack.callback(self._finish_parts)
            if self._counting is not None:
                self._crossings.extend(self._counting.end())
                stack.callback(self._write_last_crossings)
                stack.callback(self._counting.close)
            if self._events is not None:
                stack.callback(self._events.save)
                self._events.end()
        for thread in self._finishing:
            thread.join()

    def _write_part(self, steps: Sequence[Step], rows: pa.Table | None) -> None:
        chosen = [step for step in steps if self._pace(step.time_s)]
        if rows is not None and len(chosen) < len(steps):
            rows = rows.filter(pc.is_in(rows["frame"], pa.array([step.index for step in chosen], pa.int64())))
        self._roll()
        part = self._part or self._begin()
        self._write_crossings(part)
        self._reserve.check_tracks(self._root)
        part.write(steps, chosen, rows)
        for ended in [ended for ended in self._ended if ended.is_settled(steps)]:
            self._ended.remove(ended)
            self._later(Part.finish, ended)

    def _write_crossings(self, part: Part) -> None:
        """Write the crossings, those too that there was no room for before."""
        if self._crossings:
            part.write_crossings(self._crossings)
            self._crossings.clear()

    def _write_last_crossings(self) -> None:
        """Write them at the end, to a part of their own where none could begin since."""
        if not self._crossings:
            return
        try:
            self._write_crossings(self._part or self._begin())
        except StoppedEarly as error:
            count = len(self._crossings)
            raise StoppedEarly(f"{error}; {count} crossings of the end are in the counts by interval alone") from None

    def _finish_parts(self) -> None:
        with ExitStack() as stack:
            for part in (*self._ended, *([self._part] if self._part else [])):
                stack.callback(part.finish)

    def _roll(self) -> None:
        """End the current part if its period is over, it is too large, or the site has changed."""
        large = False
        if self._look():
            self._retention.prune()
            limit = self._retention.tracks_part
            large = self._roll_s is not None and limit is not None and size_of(self._folder) > limit
        if self._part is None:
            return
        if large or self._period() != self._number or self._part.subject is not self._subject:
            ended, self._part = self._part, None
            self._ended.append(ended)
            ended.end()

    def _use(self, site: UsedSite) -> None:
        """Go on at another site; the next part is its first."""
        self._subject = self._subject.at(site)
        self._reader = _reader_of(self._subject)
        if self._counting is not None:
            self._counting.use(site)
        if self._events is not None:
            self._events.change(self._subject)
        log.info("the site has changed; a new part begins with it")

    def _is_scene_due(self) -> bool:
        return self._show() or not (self._root / SCENE).exists()

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


def _reader_of(subject: Subject) -> LiveReader | None:
    """Reads where its vehicles stand; None without a calibrated site."""
    return None if subject.road is None else LiveReader(subject.road.ground)
