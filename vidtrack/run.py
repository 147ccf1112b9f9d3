"""A run: a source tracked into a folder of results."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType

from vidtrack.config import Settings
from vidtrack.live.memory import Memory
from vidtrack.output.confirmed import HOLD_S, LIVE_HOLD_S, Confirmed
from vidtrack.output.counts import CountsFile
from vidtrack.output.decisions import DecisionLog
from vidtrack.output.folder import begun
from vidtrack.output.masks import MaskFolder
from vidtrack.output.mot import MotFile
from vidtrack.output.plot import TrajectoryPlot
from vidtrack.output.results import Results
from vidtrack.output.sink import Step
from vidtrack.output.smoothed import smoothed_first
from vidtrack.output.summary import Summary
from vidtrack.output.tables import TrackTable
from vidtrack.output.threaded import Threaded
from vidtrack.pipeline import build_detector, build_tracker, video_steps
from vidtrack.steps import scan_steps
from vidtrack.traffic.lines import LineCounter, parse_lines
from vidtrack.video.detections import Detections, is_detections, open_detections
from vidtrack.video.recording import Recording, is_recording
from vidtrack.video.resources import keep_freed_memory, opencv_single_threaded
from vidtrack.video.source import Source, open_source


class Run:
    """Iterates over the steps of a source while the results are written; use it with `with`.

    folder  where the results are
    name, frames  of the source; frames may be None

    Leaving the `with` block, whatever the reason, ends all results as complete and valid up to the
    last whole step; `summary.json` says whether the run was interrupted.
    Raises SourceError, ConfigError, OutputError at the start, StoppedEarly when results cannot be written on.
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
        with ExitStack() as stack:  # whatever fails below, what is open by then is closed
            self._source = opened = _open(source, settings)
            if not isinstance(opened, Detections):
                stack.callback(opened.close)
            shape = (opened.height, opened.width)
            bounds = (opened.width, opened.height)
            whole = opened.settings if isinstance(opened, Detections) else None
            explain = decisions or rerun is not None
            smooth = settings.output.smooth
            self._tracker = tracker = build_tracker(
                settings.tracker, bounds, whole=whole, explain=explain, smooth=smooth
            )
            detector = None
            if not isinstance(opened, Detections):
                keep_freed_memory()
                if settings.detector.kind not in ("mog2", "knn"):  # they are OpenCV's, and long enough for its threads
                    stack.enter_context(opencv_single_threaded())
                detector = build_detector(settings)
                if isinstance(opened, Recording):
                    opened.remember = Memory(detector, tracker, opened.like).restore
                self._steps = video_steps(opened, detector, tracker, settings)
            else:
                scans = ((index, scan) for index, _, scan in opened)
                self._steps = scan_steps(scans, tracker, settings.tracker.redundant)
            lines = parse_lines(settings.output.lines, opened.width, opened.height)
            self.name, self.frames = opened.name, opened.frames
            with begun(output, opened.name, force) as self.folder, ExitStack() as written:
                counter = LineCounter(lines) if lines else None
                summary = Summary(self.folder / "summary.json", source, settings, self._reading, counter)
                self._results = results = written.enter_context(Results(summary))
                if counter is not None:
                    results.add(CountsFile(self.folder / "counts.csv", counter))
                plot = TrajectoryPlot(self.folder / "tracks.png", shape, detector.scene if detector else None, lines)
                hold_s = LIVE_HOLD_S if isinstance(opened, Recording) else HOLD_S
                sinks = smoothed_first(settings.output, TrackTable(self.folder), MotFile(self.folder / "mot.txt"), plot)
                results.add(Confirmed(*sinks, hold_s=hold_s))
                if decisions:
                    results.add(DecisionLog(self.folder / "decisions.csv"))
                if masks is not None:
                    results.add(Threaded(MaskFolder(masks)))
                if video is not None:
                    from vidtrack.output.video import AnnotatedVideo

                    results.add(Threaded(AnnotatedVideo(video, opened.fps, settings.output, lines)))
                if rerun is not None:
                    from vidtrack.output.rerun import RerunSink

                    results.add(Threaded(RerunSink(rerun, shape, settings, lines)))
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
