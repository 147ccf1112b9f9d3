"""Tracks stored detections: each box in the file is one whole object."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from itertools import islice
from typing import Any

from vidtrack.config.settings import Settings
from vidtrack.detections.stored import open_detections
from vidtrack.output.confirmed import HOLD_S
from vidtrack.output.folder import refuse_overwriting
from vidtrack.run.run import Extras, Pipeline
from vidtrack.run.sinks import file_sinks, file_subject
from vidtrack.run.steps import REHEARSED, scan_steps
from vidtrack.run.trackers import build_box_tracker


@contextmanager
def box_pipeline(path: str, settings: Settings, extras: Extras) -> Iterator[Pipeline]:
    """The pipeline of a MOT file of detections. Raises SourceError, FormatError, ConfigError, OutputError."""
    boxes = open_detections(path, settings)
    refuse_overwriting(boxes.place, extras.masks, extras.video)
    smooth = settings.output.smooth is not False and settings.output.level != "counts"
    tracker = build_box_tracker(
        settings.tracker,
        boxes.settings,
        (boxes.width, boxes.height),
        pace=boxes.pace,
        explain=extras.explain,
        smooth=smooth,
    )
    subject = file_subject(extras.source or path, boxes, tracker.rates.as_dict, settings, scene=None)
    link_s = None if settings.output.link is False else settings.output.link_s * boxes.pace
    yield Pipeline(
        name=boxes.name,
        place=boxes.place,
        count=boxes.frames,
        steps=scan_steps(((index, scan) for index, _, scan in boxes), tracker, settings.tracker.redundant),
        summary=subject.summary,
        sinks=partial(file_sinks, subject, extras, motion=tracker.model, smooth=smooth, link_s=link_s, hold_s=HOLD_S),
    )


def first_boxes(path: str, settings: dict[str, Any]) -> None:
    """Track the first frames of a MOT file, by the settings that are not defaults: a rehearsal of its run."""
    with box_pipeline(path, Settings.model_validate(settings), Extras()) as pipeline:
        for _ in islice(pipeline.steps, REHEARSED):
            pass
