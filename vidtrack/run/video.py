"""Tracks video: source, detector and tracker, frame by frame. Read this file after `run.py`."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from functools import partial
from itertools import pairwise
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from vidtrack.arrays.types import Mask
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError
from vidtrack.output.confirmed import HOLD_S, LIVE_HOLD_S
from vidtrack.output.folder import refuse_overwriting
from vidtrack.output.sink import Step
from vidtrack.output.stated import stated
from vidtrack.recording.source import Recording, is_recording
from vidtrack.run.live.checkpoint import Checkpoint
from vidtrack.run.run import Extras, Pipeline
from vidtrack.run.trackers import build_blob_tracker
from vidtrack.tracking.boxes import longer
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracks import TENTATIVE, Status, Tracks
from vidtrack.traffic.metres import footprints_of
from vidtrack.traffic.site import read_site
from vidtrack.video import background
from vidtrack.video.background.disturbance import PREVIEW_EVERY_S, Disturbance
from vidtrack.video.blobs.explain import explain
from vidtrack.video.blobs.limits import LimitChecks
from vidtrack.video.foreground import Background
from vidtrack.video.frame import Frame, Image
from vidtrack.video.mask import Corners, read_mask, without
from vidtrack.video.resources import frame_by_frame
from vidtrack.video.source import Source, open_source

if TYPE_CHECKING:
    from vidtrack.traffic.footprint import Footprints, Stand

log = logging.getLogger(__name__)


@overload
def track(path: str | Path, settings: Settings | None = None) -> Iterator[tuple[Frame, Tracks]]: ...


@overload
def track(
    path: str | Path, settings: Settings | None = None, *, site: str | Path
) -> Iterator[tuple[Frame, Tracks, Stand]]: ...


def track(
    path: str | Path, settings: Settings | None = None, *, site: str | Path | None = None
) -> Iterator[tuple[Frame, Tracks]] | Iterator[tuple[Frame, Tracks, Stand]]:
    """Yields each frame of a video (file, image folder or glob) with its tracks, lazily.

    settings  for example load_settings(assignments=["tracker.coast_s=2"]); None: the defaults
    site      site.toml with a calibration; each frame then comes with the `Stand` of its tracks too, row by row:
              xy [m], v and speed [m/s], heading [rad], length [m], with their errors

    Raises SourceError if the input is missing or yields no frame, ConfigError for a site that does not fit.
    """
    steps = _file_steps(str(path), settings or Settings(), None if site is None else Path(site))
    if site is None:
        return ((frame, tracks) for frame, tracks, _ in steps)
    return steps


def _file_steps(path: str, settings: Settings, site: Path | None) -> Iterator[tuple[Frame, Tracks, Any]]:
    """Each frame with its tracks and their Stand; None without a site."""
    with open_source(path, settings.source) as source:
        road = footprints_of(site, source.width, source.height)
        if site is not None and road is None:
            raise ConfigError(f"{site} has no section [calibration], so nobody knows the metres; track without a site")
        detector = build_detector(settings)
        look_ahead(source, detector, settings, whole=True)
        tracker = build_blob_tracker(settings.tracker, (source.width, source.height))
        for step in video_steps(source, detector, tracker, settings):
            assert step.frame is not None
            yield step.frame, step.shown, None if road is None else _stand(road, stated(step).tracks, step.scan.rim)


def _stand(road: Footprints, tracks: Tracks, rim: float) -> Stand:
    """Where the tracks, in pixels of the scene, stand on the road; their boxes have a rim [px]."""
    plane = [*tracks.position, *tracks.velocity]
    t, P, merged = np.full(len(tracks), tracks.t), tracks.P[:, plane][:, :, plane], tracks.status == Status.MERGED
    return road.place(tracks.id, t, tracks.xy, tracks.v, P, tracks.box, merged, rim=rim)


@contextmanager
def video_pipeline(path: str, settings: Settings, extras: Extras) -> Iterator[Pipeline]:
    """The pipeline of a video file, image folder, glob, or recording of a live run.

    Raises SourceError, FormatError, ConfigError, OutputError.
    """
    from vidtrack.run.sinks import file_sinks, file_subject  # `track` needs no sinks

    recorded = is_recording(path)
    with (
        closing(Recording(path) if recorded else open_source(path, settings.source)) as source,
        frame_by_frame(settings.detector.kind),
    ):
        refuse_overwriting(source.place, extras.masks, extras.video)
        smooth = bool(settings.output.smooth)
        tracker = build_blob_tracker(
            settings.tracker, (source.width, source.height), explain=extras.explain, smooth=smooth
        )
        detector = build_detector(settings)
        if isinstance(source, Recording):
            source.restore = Checkpoint(detector, tracker, source.like).restore
        else:
            look_ahead(source, detector, settings, whole=extras.shows)
        subject = file_subject(extras.source or path, source, tracker.rates.as_dict, settings, detector.scene)
        link_s = settings.output.link_s if settings.output.link else None
        hold_s = LIVE_HOLD_S if recorded else HOLD_S
        yield Pipeline(
            name=source.name,
            place=source.place,
            count=source.frames,
            steps=video_steps(source, detector, tracker, settings),
            summary=subject.summary,
            sinks=partial(
                file_sinks, subject, extras, motion=tracker.model, smooth=smooth, link_s=link_s, hold_s=hold_s
            ),
        )


def build_detector(settings: Settings) -> Background:
    """The detector of the settings, with the masks of their site. Raises ConfigError for a bad mask or site."""
    site = settings.output.site
    drawn = None if site is None else read_site(site)
    keep = kept(settings) if drawn is None else kept(settings, drawn.masked, drawn.camera.width, drawn.camera.height)
    return background.create(settings.detector, settings.source.scale, keep)


def kept(settings: Settings, masked: Sequence[Corners] = (), width: int = 0, height: int = 0) -> Image | None:
    """Where traffic is looked for: by the mask of the settings, without the areas in a picture of this size [px].

    None: everywhere. Raises ConfigError.
    """
    path = settings.source.mask
    return without(None if path is None else read_mask(path), masked, width, height)


def look_ahead(source: Source, detector: Background, settings: Settings, *, whole: bool = False) -> None:
    """Show the first seconds of a video, of which the source may be a slice, to a detector that learns the scene.

    whole  whether anything but the detector looks at the pictures: else they come as it reduces them
    """
    if not whole:
        read_reduced(source, detector)
    seconds = settings.detector.disturbance.preview_s
    if isinstance(detector, Disturbance) and seconds:
        detector.preview(source.opening(seconds, settings.source.end_s, PREVIEW_EVERY_S))


def read_reduced(source: Source, detector: Background) -> None:
    """Let the thread that reads a video reduce its pictures for a detector, when nothing else looks at them."""
    if isinstance(detector, Disturbance):
        source.reduce_by(detector.reduced)


def video_steps(frames: Iterable[Frame], detector: Background, tracker: Tracker, settings: Settings) -> Iterator[Step]:
    """Yields a step for each frame, after detector and tracker.

    The detector receives the tracker's prediction before it processes the frame: fragments are joined inside a
    predicted box, and vehicles that have driven are not absorbed into the scene.
    """
    checks = LimitChecks()
    ended = perf_counter()
    for frame in frames:
        clock = [ended, perf_counter()]
        expected = tracker.predict(frame.time_s)
        driven = expected.box[has_driven(expected)]
        foreground = detector.apply(frame, driven)
        if foreground.elsewhere and tracker.road:
            tracker.road.forget()
        clock.append(perf_counter())
        scan = explain(foreground, expected, tracker.road, settings.blobs).scan(frame.time_s)
        clock.append(perf_counter())
        tracks = tracker.step(scan)
        clock.append(perf_counter())
        spans = (end - begin for begin, end in pairwise(clock))
        seconds = dict(zip(("read", "detect", "blobs", "track"), spans, strict=True))
        motion = foreground.motion
        warnings = foreground.warnings + checks.look(frame, foreground, tracker.road)
        for warning in warnings:
            log.warning("at %.1f s: %s", frame.time_s, warning)
        yield Step(frame.index, frame.time_s, scan, tracks, frame, foreground, seconds, motion, warnings)
        ended = perf_counter()


def has_driven(tracks: Tracks) -> Mask:
    """(T,) confirmed tracks that travelled over 1.5 times their size; over 0.75 if they came in over the border.

    A ghost, the mark that a departed vehicle leaves in the scene, never travels, and must be absorbed. So must leaves
    at the border, what they join with, and light on the road ahead of a vehicle.
    """
    assert tracks.entered is not None
    far = np.where(tracks.entered, 0.75, 1.5) * longer(tracks.box)
    return (tracks.status != TENTATIVE) & (tracks.travel > far)
