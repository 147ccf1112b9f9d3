"""Everything that a live run writes, each beside the tracker."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

from vidtrack.config import Settings
from vidtrack.live.beside import Beside
from vidtrack.live.keep import Keep
from vidtrack.live.part import Part
from vidtrack.live.parts import Parts
from vidtrack.output.confirmed import LIVE_HOLD_S, Confirmed
from vidtrack.output.masks import MaskFolder
from vidtrack.output.sink import Sink, Step
from vidtrack.output.summary import Summary
from vidtrack.traffic.lines import LineCounter
from vidtrack.traffic.road import road_at
from vidtrack.video.frame import Image

_WRITE_S = 0.25  # between two writes: with LIVE_HOLD_S this is what a kill costs
_ROWS_DEPTH = 1000  # steps without pictures that may wait for a slow disk
_LEAST_S = 0.2  # that each output gets to end, however late it is


@dataclass(frozen=True, slots=True)
class Extras:
    """What a live run writes beside its tables.

    rerun      FILE.rrd, "spawn" or "serve"
    video      annotated video
    masks      folder of masks
    decisions  why each track got what it got
    state      file that the next run goes on from
    record     folder for what the camera sends
    """

    rerun: str | None = None
    video: Path | None = None
    masks: Path | None = None
    decisions: bool = False
    state: Path | None = None
    record: Path | None = None


@dataclass(frozen=True, slots=True)
class Subject:
    """What the outputs are about.

    source   its address without credentials
    shape    (H, W) of its pictures
    fps      its nominal rate
    scene    gives the (H, W, 3) background
    reading  gives the source's own account for the summary
    counter  counts over lines; None without any
    """

    source: str
    shape: tuple[int, int]
    fps: float
    scene: Callable[[], Image]
    reading: Callable[[], Mapping[str, object]]
    counter: LineCounter | None


class Outputs:
    """Sink of all results in `folder` and of the extras. Raises OutputError at the start, later it counts losses."""

    def __init__(
        self, folder: Path, subject: Subject, settings: Settings, extras: Extras, roll_s: float | None, keep: Keep
    ) -> None:
        self._subject = subject
        self._settings = settings
        self._decisions = extras.decisions
        self._road = road_at(settings.output.site, subject.shape[1], subject.shape[0])
        self._besides: list[Beside] = []
        self._sinks: list[Sink] = []
        if extras.masks is not None:
            self._add("masks", MaskFolder(extras.masks))
        lines = subject.counter.lines if subject.counter else ()
        if extras.video is not None:
            from vidtrack.output.video import AnnotatedVideo

            self._add("video", AnnotatedVideo(extras.video, subject.fps, settings.output, lines))
        if extras.rerun is not None:
            from vidtrack.output.rerun import RerunSink

            self._add("rerun", RerunSink(extras.rerun, subject.shape, settings, lines))
        # The last, so that what cannot be opened above leaves the folder empty.
        parts = Parts(folder, self._part, roll_s, keep, subject.counter, self._summary)
        tables = Beside("results", parts.write, parts.finish, _WRITE_S, _ROWS_DEPTH)
        self._confirmed = Confirmed(tables, hold_s=LIVE_HOLD_S)
        self._besides.append(tables)
        self._sinks.append(self._confirmed)

    @property
    def lost(self) -> dict[str, int]:
        """Frames that each output could not write."""
        return {beside.name: beside.lost for beside in self._besides}

    def step(self, step: Step) -> None:
        """Hand a step to all."""
        for sink in self._sinks:
            sink.step(step)

    def close(self, until_s: float) -> None:
        """Finish all by a monotonic time; what is not finished then stays as it is, and valid."""
        for sink in self._sinks:
            sink.close()
        for beside in reversed(self._besides):  # the tables first
            beside.join(max(_LEAST_S, until_s - monotonic()))

    def _add(self, name: str, sink: Sink) -> None:
        beside = Beside.of(name, sink)
        self._besides.append(beside)
        self._sinks.append(beside)

    def _part(self, folder: Path) -> Part:
        subject = self._subject
        return Part(folder, subject.shape, subject.scene, self._summary, subject.counter, self._road, self._decisions)

    def _summary(self, path: Path) -> Summary:
        subject = self._subject
        return Summary(path, subject.source, self._settings, subject.reading, subject.counter)
