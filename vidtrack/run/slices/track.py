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
from vidtrack.run.video import build_detector, video_steps
from vidtrack.video.resources import frame_by_frame
from vidtrack.video.source import open_part, open_source

SCENE = "scene.npy"
"""The background at the end of a slice."""


def track_slice(path: str, settings: Settings, cut: Cut, folder: Path, beat: Callable[[int], None]) -> None:
    """Track a slice of a video file from its warm-up on, and keep its steps in a folder.

    beat  called with the number of frames so far

    Raises SourceError, FormatError or ConfigError as a run does; StoppedEarly on a write error. A slice after the first
    that holds no frame is kept empty: the file is shorter than it states.
    """
    span = settings.source.model_copy(update={"start_s": cut.from_s, "end_s": cut.to_s})
    source = (open_part if cut.number else open_source)(path, span)
    with source, frame_by_frame(settings.detector.kind):
        detector = build_detector(settings)
        size = source.width, source.height
        tracker = build_blob_tracker(settings.tracker, size, smooth=settings.output.smooth)
        kept, count = KeptSteps(folder), 0
        try:
            for count, step in enumerate(video_steps(source, detector, tracker, settings), start=1):
                if step.time_s >= cut.kept_from_s:
                    kept.step(step)
                beat(count)
        except SourceError:
            if count or not cut.number:
                raise
            source.stats.mark_truncated(f"{path} is shorter than it states: nothing after {cut.from_s:g} s")
        kept.close()
        if count:
            with writing(folder / SCENE):
                np.save(folder / SCENE, detector.scene())
        kept.about(About(source.fps, *size, asdict(source.stats), tracker.rates.as_dict()))
