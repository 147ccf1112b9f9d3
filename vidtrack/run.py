"""A run: a source tracked into a folder of results."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from vidtrack.box_pipeline import build_tracker
from vidtrack.config import Settings
from vidtrack.errors import SourceError
from vidtrack.live.memory import Memory
from vidtrack.output.confirmed import HOLD_S, LIVE_HOLD_S, Confirmed
from vidtrack.output.counts import CountsFile
from vidtrack.output.decisions import DecisionLog
from vidtrack.output.folder import begun, spare, withdraw
from vidtrack.output.linked import Linked
from vidtrack.output.masks import MaskFolder
from vidtrack.output.mot import MotFile
from vidtrack.output.plot import TrajectoryPlot
from vidtrack.output.results import Results
from vidtrack.output.sink import Sink, Step
from vidtrack.output.smoothed import smoothed_first
from vidtrack.output.summary import Summary
from vidtrack.output.tables import TrackTable
from vidtrack.output.threaded import Threaded
from vidtrack.pipeline import build_detector, video_steps
from vidtrack.steps import scan_steps
from vidtrack.traffic.lines import Line, LineCounter, parse_lines
from vidtrack.traffic.road import road_at
from vidtrack.video.detections import Detections, is_detections, open_detections
from vidtrack.video.frame import Image
from vidtrack.video.recording import Recording, is_recording
from vidtrack.video.resources import frame_by_frame
from vidtrack.video.source import Source, open_source

if TYPE_CHECKING:
    from vidtrack.traffic.footprint import Footprints


class Run:
    """Tracks a source and writes the results while it is iterated; use it with `with`.

    source         video file, image folder or glob, MOT det.txt, or a recording of a live run
    output         folder of the results; None: runs/NAME
    force          replace the results of an earlier run in `output`
    rerun          FILE.rrd, "spawn" or "serve"
    video, masks   annotated video, folder of masks
    decisions      write decisions.csv

    folder         where the results are
    name, frames   of the source; frames may be None

    However the `with` block is left, all results are complete and valid up to the last whole step;
    `summary.json` says whether the run was interrupted.
    Raises SourceError, ConfigError or OutputError at the start, StoppedEarly when results can no longer be written.
    """

    def __init__(
        self,
        source: str,
        settings: Settings,
        output: Path | None = None,
        *,
        force: bool = False,
        rerun: str | None = None,
        video: Path | None = None,
        masks: Path | None = None,
        decisions: bool = False,
    ) -> None:
        self._settings = settings
        with ExitStack() as stack:  # if a later step fails, what is already open is closed
            self._source = opened = _open(source, settings)
            stack.callback(opened.close)
            spare(opened.place, output, masks, video)
            self._pace = opened.pace if isinstance(opened, Detections) else 1.0
            self._tracker = build_tracker(
                settings.tracker,
                (opened.width, opened.height),
                whole=opened.settings if isinstance(opened, Detections) else None,
                pace=self._pace,
                explain=decisions or rerun is not None,
                smooth=settings.output.smooth,
            )
            scene: Callable[[], Image] | None = None
            if isinstance(opened, Detections):
                scans = ((index, scan) for index, _, scan in opened)
                self._steps = scan_steps(scans, self._tracker, settings.tracker.redundant)
            else:
                stack.enter_context(frame_by_frame(settings.detector.kind))
                detector = build_detector(settings)
                scene = detector.scene
                if isinstance(opened, Recording):
                    opened.remember = Memory(detector, self._tracker, opened.like).restore
                self._steps = video_steps(opened, detector, self._tracker, settings)
            lines = parse_lines(settings.output.lines, opened.width, opened.height)
            road = road_at(settings.output.site, opened.width, opened.height)
            self.name, self.frames = opened.name, opened.frames
            with begun(output, opened.name, force) as self.folder, ExitStack() as written:
                counter = LineCounter(lines) if lines else None
                summary = Summary(self.folder / "summary.json", source, settings, self._reading, counter)
                self._results = written.enter_context(Results(summary))
                self._add_tables(lines, counter, scene, road, decisions)
                self._add_pictures(lines, masks, video, rerun)
                stack.push(written.pop_all())
            self._open = stack.pop_all()

    def __iter__(self) -> Iterator[Step]:
        return self._results.record(self._steps)

    def __enter__(self) -> Run:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.__exit__(kind, error, trace)
        if isinstance(error, SourceError) and not self._source.stats.frames_read:
            withdraw(self.folder)  # the corrected command may use it

    def _add_tables(
        self,
        lines: list[Line],
        counter: LineCounter | None,
        scene: Callable[[], Image] | None,
        road: Footprints | None,
        decisions: bool,
    ) -> None:
        """The tables and tracks.png, with counts.csv and decisions.csv where they are asked for."""
        folder, source, output = self.folder, self._source, self._settings.output
        if counter is not None:
            self._results.add(CountsFile(folder / "counts.csv", counter))
        totals = counter.totals if counter else None
        plot = TrajectoryPlot(folder / "tracks.png", (source.height, source.width), scene, lines, totals)
        sinks: tuple[Sink, ...] = (TrackTable(folder, road=road), MotFile(folder / "mot.txt"), plot)
        if isinstance(source, Detections) if output.link is None else output.link:
            sinks = (Linked(*sinks, motion=self._tracker.model, longest_s=output.link_s * self._pace),)
        sinks = smoothed_first(output, *sinks)
        self._results.add(Confirmed(*sinks, hold_s=LIVE_HOLD_S if isinstance(source, Recording) else HOLD_S))
        if decisions:
            self._results.add(DecisionLog(folder / "decisions.csv"))

    def _add_pictures(self, lines: list[Line], masks: Path | None, video: Path | None, rerun: str | None) -> None:
        """Masks, the annotated video and rerun, each encoded in a thread of its own."""
        source, settings = self._source, self._settings
        if masks is not None:
            self._results.add(Threaded(MaskFolder(masks)))
        if video is not None:
            from vidtrack.output.video import AnnotatedVideo

            self._results.add(Threaded(AnnotatedVideo(video, source.fps, settings.output, lines)))
        if rerun is not None:
            from vidtrack.output.rerun import RerunSink

            self._results.add(Threaded(RerunSink(rerun, (source.height, source.width), settings, lines)))

    def _reading(self) -> dict[str, object]:
        source, stats = self._source, self._source.stats
        return {
            "fps": round(source.fps, 6),
            "width": source.width,
            "height": source.height,
            "frames_read": stats.frames_read,
            "frames_dropped": stats.frames_dropped,
            "decode_errors": stats.decode_errors,
            "reconnects": 0,
            "stalls": 0,
            "truncated": stats.truncated,
            **self._tracker.rates.as_dict(),
        }


def _open(source: str, settings: Settings) -> Source | Recording | Detections:
    if is_detections(source):
        return open_detections(source, settings)
    if is_recording(source):
        return Recording(source)
    return open_source(source, settings.source)
