"""The video pipeline: source, detector, tracker, one frame at a time. Read this file after `tracking/tracker.py`."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from time import perf_counter

from vidtrack.associate.gate import Gate
from vidtrack.associate.shape import Shape
from vidtrack.associate.trust import Trust
from vidtrack.config import DetectionSettings, Settings, TrackerSettings
from vidtrack.estimate.motion import ConstantVelocity
from vidtrack.output.sink import Step
from vidtrack.scan import TENTATIVE, Mask, Tracks
from vidtrack.tracking.border import EXIT_S
from vidtrack.tracking.boxes import longer
from vidtrack.tracking.groups import Groups
from vidtrack.tracking.methods import life, rule
from vidtrack.tracking.road import Road
from vidtrack.tracking.tracker import Tracker
from vidtrack.video import background
from vidtrack.video.foreground import Background
from vidtrack.video.frame import Frame
from vidtrack.video.mask import read_mask
from vidtrack.video.source import open_source
from vidtrack.video.vehicles.explain import explain
from vidtrack.video.vehicles.outlook import Outlook

log = logging.getLogger(__name__)


def track(path: str | Path, settings: Settings | None = None) -> Iterator[tuple[Frame, Tracks]]:
    """Frames of a video (file, image folder or glob) with the tracks in each, lazily.

    settings  such as load_settings(assignments=["tracker.coast_s=2"]); None: the defaults

    Raises SourceError when the input is missing or yields nothing.
    """
    settings = settings or Settings()
    with open_source(str(path), settings.source) as source:
        detector = build_detector(settings)
        tracker = build_tracker(settings.tracker, (source.width, source.height))
        for step in video_steps(source, detector, tracker, settings):
            assert step.frame is not None
            yield step.frame, step.shown


def box_tracker(settings: Settings | None = None, bounds: tuple[float, float] | None = None) -> Tracker:
    """A tracker for `box_scan`, the boxes of your own detector, as `vidtrack track det.txt` has it.

    bounds  (width, height) of the picture [px]: tracks that leave it end at once; None: they end when unseen for long

    What the settings leave open (accelerations, scores that may not start a track) a file tells beforehand and a
    stream cannot: `tracker.accel` holds then, and every box may start a track.
    """
    settings = settings or Settings()
    return build_tracker(settings.tracker, bounds, whole=settings.detections)


def build_detector(settings: Settings) -> Background:
    """The detector that the settings describe. Raises ConfigError for a mask that is not a picture."""
    path = settings.source.mask
    keep = None if path is None else read_mask(path)
    return background.create(settings.detector, settings.source.scale, keep)


def build_tracker(
    settings: TrackerSettings,
    bounds: tuple[float, float] | None = None,
    *,
    whole: DetectionSettings | None = None,
    pace: float = 1.0,
    explain: bool = False,
    smooth: bool = False,
) -> Tracker:
    """The tracker that the settings describe, for scans of boxes in pixels within bounds (width, height).

    whole    settings for stored detections, where each box is one whole object: boxes may overlap but are never
             shared, their size and score are evidence, and M hits of N confirm a track even if it does not move
    pace     seconds of the scans' clock in a second of the settings; not 1 where the rate of the scans is assumed
    explain  keep each scan's choices, for decisions.csv and rerun
    smooth   keep what a smoother needs
    """
    accel = (settings.accel if whole is None or whole.accel is None else whole.accel) / pace**2
    return Tracker(
        model=ConstantVelocity(
            dim=2,
            accel=accel,
            cross=accel * settings.cross / settings.accel,
            speed=settings.speed / pace,
            hold_s=settings.hold_s * pace,
            per_size=True,
        ),
        associate=rule(settings),
        gate=Gate(settings.gate_probability, settings.distance, settings.euclidean_radius_px),
        life=life(
            settings.life,
            settings,
            (whole or settings).confirm_hits,
            (whole or settings).confirm_window,
            confirm_s=0.0 if whole else settings.confirm_s,
            confirm_travel=0.0 if whole else settings.confirm_travel,
            coast_s=settings.coast_s * pace,
            hidden_s=settings.hidden_s * pace,
            coast_scans=None,
            idle_s=None if whole else settings.idle_s,
            idle_travel=settings.idle_travel,
        ),
        groups=Groups(cover=settings.group_cover, overlap=settings.blob_overlap)
        if settings.merged_blobs and not whole
        else None,
        shape=Shape() if whole else None,
        trust=Trust(whole.sure_score) if whole and whole.sure_score is not None else None,
        road=Road(*bounds, wary=settings.restless) if bounds and not whole else None,
        bounds=bounds,
        detection_probability=(whole or settings).detection_probability,
        clutter_density=settings.clutter_density,
        box_s=(whole or settings).box_s * pace,
        exit_s=EXIT_S * pace,
        explain=explain,
        smooth=smooth,
    )


def video_steps(frames: Iterable[Frame], detector: Background, tracker: Tracker, settings: Settings) -> Iterator[Step]:
    """Each frame through detector and tracker.

    The tracker's prediction reaches the detector before the frame is processed: fragments are joined inside a
    predicted box, and vehicles that were seen driving are not absorbed into the scene.
    """
    outlook = Outlook()
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
        warnings = foreground.warnings + outlook.look(frame, foreground, tracker.road)
        for warning in warnings:
            log.warning("at %.1f s: %s", frame.time_s, warning)
        yield Step(frame.index, frame.time_s, scan, tracks, frame, foreground, seconds, motion, warnings)
        ended = perf_counter()


def has_driven(tracks: Tracks) -> Mask:
    """(T,) confirmed tracks that have travelled farther than one and a half times their size.

    A ghost, the mark that a departed vehicle leaves in the scene, never does, and must not be kept from being absorbed.
    """
    return (tracks.status != TENTATIVE) & (tracks.travel > 1.5 * longer(tracks.box))
