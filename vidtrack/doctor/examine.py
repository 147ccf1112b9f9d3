"""Measures a source for some seconds. Read this file first in `doctor`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import ExitStack, closing
from time import perf_counter

import numpy as np

from vidtrack.config.settings import Settings
from vidtrack.detections.stored import is_detections, open_detections
from vidtrack.doctor.findings import Findings, Reception, Speed
from vidtrack.doctor.objects import ObjectMeter, finer
from vidtrack.doctor.opening import is_live, looked_at, open_pictures
from vidtrack.errors import SourceError
from vidtrack.recording.source import is_recording
from vidtrack.run.trackers import build_blob_tracker
from vidtrack.run.video import build_detector, video_steps
from vidtrack.tracking.tracker import Tracker
from vidtrack.video.frame import Frame
from vidtrack.video.live.address import redact
from vidtrack.video.live.stats import LiveStats
from vidtrack.video.quality.blocks import blockiness
from vidtrack.video.quality.flicker import flicker
from vidtrack.video.quality.light import light
from vidtrack.video.quality.samples import Samples
from vidtrack.video.quality.shake import ShakeMeter
from vidtrack.video.quality.timing import timing
from vidtrack.video.stats import SourceStats

_PATIENCE = 6.0  # limit of the duration, times the requested seconds
_QUIET = 2.0  # live time-outs without a picture: one to give up, one to reconnect
_BLOCKS_EVERY = 25  # frames


def examine(source: str, settings: Settings, seconds: float = 10.0) -> Findings:
    """Measure `seconds` of a source, all its pictures, whatever `source.max_fps`.

    A live source is only read for half of the time, for its timing, and tracked for the other half. A file is read
    twice. Raises SourceError if the source cannot be opened, yields no picture or stops before it is tracked,
    FormatError for a bad line of detections.
    """
    if is_detections(source):
        return _of_detections(source, settings)
    every = settings.source.model_copy(update={"max_fps": None})
    settings = settings.model_copy(update={"source": every})
    live = is_live(source)
    span = seconds / 2 if live else seconds
    patience_s, quiet_s = _PATIENCE * seconds, _QUIET * settings.live.timeout_s
    with ExitStack() as stack:
        opened = stack.enter_context(closing(open_pictures(source, settings)))
        began = perf_counter()
        times = np.array([frame.time_s for frame in looked_at(opened, span, patience_s, quiet_s)])
        decode_s = None if live else (perf_counter() - began) / len(times)
        stats, dropped = opened.stats, opened.stats.frames_dropped
        if not live:
            opened = stack.enter_context(closing(open_pictures(source, settings)))
        watch = Watch(settings, (opened.height, opened.width))
        watch.all(looked_at(opened, span, patience_s, quiet_s))
        reception = _reception(stats, dropped)  # before closing, which changes the state
    if not watch.track_s:
        raise SourceError(f"{redact(source)} gave pictures, and then nothing for {quiet_s:g} s; look at the network")
    pace = timing(times, watch.samples.repeats) if len(times) > 1 else None
    return Findings(
        source=redact(source),
        kind="live" if live else "recording" if is_recording(source) else "video",
        width=opened.width,
        height=opened.height,
        fps=opened.fps,
        reception=reception,
        timing=pace,
        light=light(watch.samples),
        flicker=flicker(watch.samples, pace.rate if pace else opened.fps),
        shake=watch.shake.result(),
        blockiness=float(np.median(watch.blockiness)),
        objects=watch.objects.result(),
        speed=Speed(decode_s, float(np.median(watch.track_s))),
    )


class Watch:
    """All measurements on the pictures and their tracks."""

    def __init__(self, settings: Settings, shape: tuple[int, int]) -> None:
        self.samples = Samples()
        self.shake = ShakeMeter()
        self.blockiness: list[float] = []
        self.objects = ObjectMeter(settings, shape)
        self.track_s: list[float] = []
        self._settings = settings
        self._bounds = (shape[1], shape[0])

    def all(self, frames: Iterable[Frame]) -> None:
        """Measure the frames, tracked with the settings and with finer ones."""
        fine = finer(self._settings, self._bounds[::-1])
        for step in video_steps(self._seen(frames), build_detector(fine), self._tracker(fine), fine):
            self.objects.take_fine(step)

    def _seen(self, frames: Iterable[Frame]) -> Iterator[Frame]:
        """Yields the frames after tracking and measuring them."""
        settings = self._settings
        for step in video_steps(frames, build_detector(settings), self._tracker(settings), settings):
            frame = step.frame
            assert frame is not None
            self.track_s.append(sum(seconds for stage, seconds in step.stage_s.items() if stage != "read"))
            self.objects.take(step)
            self.samples.take(frame)
            self.shake.take(frame)
            if len(self.track_s) % _BLOCKS_EVERY == 1:  # includes the first frame
                self.blockiness.append(blockiness(frame.y))
            yield frame

    def _tracker(self, settings: Settings) -> Tracker:
        return build_blob_tracker(settings.tracker, self._bounds)


def _reception(stats: SourceStats, dropped: int = 0) -> Reception:
    live = stats if isinstance(stats, LiveStats) else LiveStats()
    return Reception(
        header_fps=stats.header_fps,
        fps_assumed=stats.fps_assumed,
        truncated=stats.truncated,
        decode_errors=stats.decode_errors,
        dropped=dropped,
        reconnects=live.reconnects,
        stalls=live.stalls,
        gone=live is stats and live.state != "running",
    )


def _of_detections(source: str, settings: Settings) -> Findings:
    """Findings of stored detections: size and rate, no pictures."""
    opened = open_detections(source, settings)
    return Findings(
        source=source,
        kind="detections",
        width=opened.width,
        height=opened.height,
        fps=opened.fps,
        reception=_reception(opened.stats),
        timing=None,
    )
