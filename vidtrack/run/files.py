"""Runs over files: video, images, recordings or stored detections."""

from __future__ import annotations

from pathlib import Path

from vidtrack.config.inputs import Input
from vidtrack.config.settings import Settings
from vidtrack.detections.stored import is_detections
from vidtrack.recording.source import is_recording
from vidtrack.run.boxes import box_pipeline
from vidtrack.run.run import Extras, Run
from vidtrack.run.video import video_pipeline


def kind_of_file(source: str) -> Input:
    """The kind of a source that is no camera."""
    if is_detections(source):
        return Input.DETECTIONS
    return Input.RECORDING if is_recording(source) else Input.VIDEO


def run_file(
    source: str, settings: Settings, output: Path | None = None, extras: Extras | None = None, *, force: bool = False
) -> Run:
    """A run over a video file, image folder or glob, MOT det.txt, or a recording of a live run. Raises as Run."""
    pipeline = box_pipeline if is_detections(source) else video_pipeline
    return Run(pipeline(source, settings, extras or Extras()), output, force=force)
