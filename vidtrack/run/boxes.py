"""Stored detections become tracks: each box of the file is one whole object."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from vidtrack.box_pipeline import build_tracker
from vidtrack.config import Settings
from vidtrack.output.confirmed import HOLD_S
from vidtrack.output.folder import spare
from vidtrack.run.run import Extras, Pipeline
from vidtrack.run.steps import scan_steps
from vidtrack.video.detections import open_detections


@contextmanager
def box_pipeline(path: str, settings: Settings, extras: Extras) -> Iterator[Pipeline]:
    """A MOT file of detections. Raises SourceError, FormatError, ConfigError, OutputError."""
    from vidtrack.run.sinks import file_pipeline

    boxes = open_detections(path, settings)
    spare(boxes.place, extras.masks, extras.video)
    tracker = build_tracker(
        settings.tracker,
        (boxes.width, boxes.height),
        whole=boxes.settings,
        pace=boxes.pace,
        explain=extras.explain,
        smooth=settings.output.smooth,
    )
    yield file_pipeline(
        path,
        boxes,
        scan_steps(((index, scan) for index, _, scan in boxes), tracker, settings.tracker.redundant),
        tracker,
        settings,
        extras,
        scene=None,
        link_s=None if settings.output.link is False else settings.output.link_s * boxes.pace,
        hold_s=HOLD_S,
    )
