"""Counts the tracks of a live run: for the files of its parts, the page, and the counts by interval."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.config.settings import Settings
from vidtrack.output.intervals.book import CountBook, Passage, totals
from vidtrack.output.intervals.day import Plan
from vidtrack.output.sink import Step
from vidtrack.run.sinks import Subject
from vidtrack.traffic.lengths import add_lengths, mean_length
from vidtrack.traffic.lines import Crossing, Line, LineCounter, parse_line, parse_lines
from vidtrack.traffic.measures.rows import Rows
from vidtrack.traffic.metres import UsedSite

if TYPE_CHECKING:
    from vidtrack.traffic.footprint import Footprints

COUNTS = "intervals"
"""Folder of the counts by interval"""

_MARGIN_S = 1.0  # for a vehicle to be clear of the line
_SURE = 0.6  # share of the time that tracks coast in which they are surely found again: later a box may miss its own
_UNUSUAL, _LATELY = 2.5, 0.2  # times the usual pause between frames; weight of the last one in it
_STEP_S = 0.5  # the wall clock was set if it moved by more than this
_NOTHING = (np.nan, np.nan, np.nan)


class RoadReadings:
    """Mean length [m] and newest speed [m/s], with its standard deviations (own, shared), of tracks on the road."""

    def __init__(self) -> None:
        self._sums: dict[int, Floats] = {}
        self._speeds: dict[int, tuple[float, float, float]] = {}
        self._seen_s: dict[int, float] = {}

    def add(self, rows: Rows) -> None:
        """Take rows of tracks on the road, in order of time."""
        ids, track = np.unique(rows.track, return_inverse=True)
        speeds = np.column_stack([rows.speed, rows.speed_sigma, rows.speed_shared])
        sums = np.zeros((len(ids), 4))
        add_lengths(sums, track, rows.length, rows.length_sigma, rows.hidden)
        last, fast = np.zeros((2, len(ids)), int)
        last[track] = np.arange(len(track))
        known = np.flatnonzero(np.isfinite(speeds[:, 0]))
        fast[track[known]] = known + 1
        for number, one in enumerate(ids.tolist()):
            self._sums[one] = self._sums.get(one, 0.0) + sums[number]
            self._seen_s[one] = float(rows.t[last[number]])
            if fast[number]:
                speed, own, shared = speeds[fast[number] - 1].tolist()
                self._speeds[one] = speed, own, shared

    def of(self, track_id: int) -> tuple[float, float, float, float]:
        """Length, speed and its standard deviations; NaN where nothing is known."""
        sums = self._sums.get(track_id)
        length = np.nan if sums is None else float(mean_length(sums[None])[0][0])
        return length, *self._speeds.get(track_id, _NOTHING)

    def forget(self, before_s: float) -> None:
        """Forget the tracks without rows since then."""
        for one in [one for one, seen_s in self._seen_s.items() if seen_s < before_s]:
            for memory in (self._sums, self._speeds, self._seen_s):
                memory.pop(one, None)


class Counting:
    """Counts steps of confirmed tracks over the lines of `counter`, and writes the counts by interval to `book`.

    began_s  returns the Unix time of time_s 0, by the wall clock as it is now
    coast_s  no track outlives a longer time without frames
    late_s   crossings are decided within this time after they happened, and vehicles are found within it after a gap
    keep_s   older days are deleted; None: they stay
    tell     called with each batch of crossings; None: nobody else wants them
    own      lines that are counted at every site
    road     of the site, on which vehicles pass its gates; None: not known, and their boxes tell where they stand

    A time is watched if frames were tracked in it, tracks are carried through it and found again after a gap, and their
    crossings are decided.
    """

    def __init__(
        self,
        counter: LineCounter,
        book: CountBook,
        began_s: Callable[[], float],
        coast_s: float,
        late_s: float,
        keep_s: float | None = None,
        tell: Callable[[Sequence[Passage]], None] | None = None,
        own: Sequence[Line] = (),
        road: Footprints | None = None,
    ) -> None:
        self._tell = tell
        self._road = road
        self._counter = counter
        self._own = own
        self._book = book
        self._began_s = began_s
        self._coast_s, self._late_s, self._keep_s = coast_s, late_s, keep_s
        self._usual_s = np.inf  # between two frames, lately
        self._readings = RoadReadings()
        self._offset_s = began_s()
        self._last_s: float | None = None
        self._spans: list[tuple[float, float]] = []  # watched, and not told yet; the last one goes on

    @property
    def lost(self) -> int:
        """Number of crossings that could not be written to the intervals."""
        return self._book.lost

    def step(self, steps: Sequence[Step], seen: Rows | None) -> list[Crossing]:
        """Count a batch of steps; `seen`: the tracks of these steps on the road, None without a calibrated site."""
        self._set_clock()
        if seen is not None and len(seen):
            self._readings.add(seen)
        crossings = [
            crossing
            for step, stand in zip(steps, self._stands(steps, seen), strict=True)
            for crossing in self._counter.step(step.index, step.tracks, stand)
        ]
        self._note(crossings)
        for step in steps:
            self._watch(step.time_s)
        if self._last_s is not None:
            self._readings.forget(self._last_s - self._late_s)
        self._tell_watched(self._late_s)
        return crossings

    def use(self, site: UsedSite) -> None:
        """Go on with the gates and classes of another site, on whose road nothing is known of the vehicles yet.

        Gates that are the same go on; those that are new count from the last frame on.
        """
        self._counter.use(lines_at(self._own, site))
        self._road = site.road
        since_s = self._offset_s + self._last_s if self._last_s is not None else time.time()
        self._book.use(ways_of(self._counter), site.classes, since_s)
        self._readings = RoadReadings()

    def save(self) -> None:
        """Write the counts by interval. Raises StoppedEarly."""
        self._book.save(self._keep_s)

    def end(self) -> list[Crossing]:
        """Count tracks whose last position is beyond a line."""
        crossings = self._counter.close()
        self._note(crossings)
        self._tell_watched(0.0)
        return crossings

    def close(self) -> None:
        """Finish the files of the intervals. Raises StoppedEarly."""
        self._book.close()

    def _stands(self, steps: Sequence[Step], seen: Rows | None) -> Sequence[Floats | None]:
        """(T, 2) px of the scene where the tracks of each step stand on the road."""
        if seen is None or self._road is None:
            return [None] * len(steps)
        xy = self._road.ground.pixels(seen.xy)
        return np.split(xy, np.cumsum([len(step.tracks) for step in steps])[:-1])

    def _note(self, crossings: Sequence[Crossing]) -> None:
        passages = [
            Passage(
                self._offset_s + crossing.time_s,
                crossing.line,
                crossing.direction,
                crossing.track_id,
                *self._readings.of(crossing.track_id),
            )
            for crossing in crossings
        ]
        self._book.add(passages)
        if self._tell is not None:
            self._tell(passages)

    def _set_clock(self) -> None:
        """Follow the wall clock; what was watched before it was set has the times of then."""
        offset_s = self._began_s()
        if abs(offset_s - self._offset_s) > _STEP_S:
            self._tell_watched(0.0)
            self._offset_s = offset_s

    def _watch(self, time_s: float) -> None:
        """Frames were tracked until this time.

        In a pause almost as long as tracks coast, and not usual, some are lost: it is a gap too.
        """
        pause_s = np.inf if self._last_s is None else time_s - self._last_s
        if pause_s <= min(self._coast_s, max(_SURE * self._coast_s, _UNUSUAL * self._usual_s)):
            begin_s, _ = self._spans[-1]
            self._spans[-1] = (begin_s, max(begin_s, time_s))
        else:
            self._spans.append((time_s + self._late_s, time_s + self._late_s))
        if pause_s <= self._coast_s:
            self._usual_s = _LATELY * pause_s + (1 - _LATELY) * min(self._usual_s, self._coast_s)
        self._last_s = time_s

    def _tell_watched(self, late_s: float) -> None:
        """Tell the book of what was watched until `late_s` before the last frame."""
        if self._last_s is None:
            return
        until_s = self._last_s - late_s
        for begin_s, end_s in self._spans:
            if begin_s < min(end_s, until_s):
                self._book.watch(self._offset_s + begin_s, self._offset_s + min(end_s, until_s))
        left = [(max(begin_s, min(end_s, until_s)), end_s) for begin_s, end_s in self._spans]
        self._spans = [span for span in left[:-1] if span[0] < span[1]] + left[-1:]


def counting_of(
    subject: Subject,
    folder: Path,
    began_s: Callable[[], float],
    tell: Callable[[Sequence[Passage]], None] | None = None,
) -> Counting:
    """The counting of a run with counting lines, which goes on from the counts in `folder`.

    Raises FormatError, StoppedEarly.
    """
    counter, settings = subject.counter, subject.settings
    assert counter is not None
    book = CountBook(folder, Plan(ways_of(counter), subject.classes, settings.live.zone))
    counter.resume(totals(folder))
    coast_s, hidden_s = settings.tracker.coast_s, settings.tracker.hidden_s
    late_s = max(coast_s, hidden_s) + _MARGIN_S
    own = list(map(parse_line, settings.output.lines))
    return Counting(counter, book, began_s, coast_s, late_s, settings.live.keep_counts_s, tell, own, subject.road)


def counter_of(settings: Settings, width: int, height: int, site: UsedSite | None) -> LineCounter | None:
    """The counter of a live run: over the lines of the settings and the gates of its site, which may come later.

    None without lines and site. Raises ConfigError.
    """
    lines = parse_lines(settings.output.lines, width, height)
    return LineCounter(lines_at(lines, site)) if lines or site else None


def lines_at(own: Sequence[Line], site: UsedSite | None) -> list[Line]:
    """The lines of the settings, and the gates of a site that have other names."""
    names = {line.name for line in own}
    return [*own, *(gate for gate in (site.gates if site else ()) if gate.name not in names)]


def ways_of(counter: LineCounter) -> dict[str, tuple[str, str]]:
    """The two directions of each line."""
    return {line.name: line.directions for line in counter.lines}
