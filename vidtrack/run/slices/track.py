"""Tracks one slice of a video."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from vidtrack.config.settings import Settings
from vidtrack.errors import SourceError
from vidtrack.output.folder import writing
from vidtrack.run.slices.cuts import Cut
from vidtrack.run.slices.kept import About, KeptSteps
from vidtrack.run.trackers import build_blob_tracker
from vidtrack.run.video import build_detector, look_ahead, read_reduced, video_steps
from vidtrack.state import gather, read_state, restore, write_state
from vidtrack.tracking.tracker import Tracker
from vidtrack.traffic.lines import parse_lines
from vidtrack.video.foreground import Background
from vidtrack.video.resources import frame_by_frame
from vidtrack.video.source import open_part, open_source

SCENE, STATE = "scene.npy", "state.npz"
"""The background at the end of a slice; the state that the next one goes on from."""


class _Both:
    """Detector and tracker: all on which the next frame's tracks depend."""

    STATE = ("detector", "tracker")

    def __init__(self, detector: Background, tracker: Tracker) -> None:
        self.detector = detector
        self.tracker = tracker


def track_slice(
    path: str, settings: Settings, cut: Cut, folder: Path, before: Path | None, beat: Callable[[], None]
) -> None:
    """Track a slice of a video file, and keep its steps in a folder.

    before  folder of the slice before it, if this one goes on from its state
    beat    called after each frame

    Raises SourceError, FormatError or ConfigError as a run does; StoppedEarly on a write error. A slice after the first
    that holds no frame is kept empty: the file is shorter than it states.
    """
    span = settings.source.model_copy(update={"start_s": cut.from_s, "end_s": cut.to_s})
    source = (open_part if cut.number else open_source)(path, span)
    with source, frame_by_frame(settings.detector.kind):
        detector = build_detector(settings)
        size = source.width, source.height
        parse_lines(settings.output.lines, *size, refuse=True)  # else only the stitched run would refuse them
        tracker = build_blob_tracker(settings.tracker, size, smooth=bool(settings.output.smooth))
        both = _Both(detector, tracker)
        kept, count = KeptSteps(folder), 0
        frames = (frame for frame in source if cut.holds(frame.time_s))
        try:
            if before is None:
                look_ahead(source, detector, settings)
            else:
                restore(both, read_state(before / STATE))
                read_reduced(source, detector)
            for step in video_steps(frames, detector, tracker, settings):
                count += 1
                if step.time_s >= cut.kept_from_s:
                    kept.step(step)
                beat()
        except SourceError:
            if count or not cut.number:
                raise
            source.stats.warn(f"{path} is shorter than it states: nothing after {cut.from_s:g} s")
        kept.close()
        with writing(folder):
            if count:
                np.save(folder / SCENE, detector.scene())
            if cut.warm_s is None and cut.end_s is not None:
                write_state(folder / STATE, gather(both))
        stats, rates = asdict(source.stats), tracker.rates.as_dict()
        kept.about(About(source.fps, *size, stats, rates, before=source.before))
