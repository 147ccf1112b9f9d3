"""Background models: what of a frame is traffic, by the scene learnt from the frames before."""

from __future__ import annotations

from vidtrack.config import DetectorSettings
from vidtrack.video.background.disturbance import Disturbance
from vidtrack.video.background.opencv import OpenCV
from vidtrack.video.background.paper import Paper
from vidtrack.video.foreground import Background
from vidtrack.video.frame import Image


def create(settings: DetectorSettings, scale: float | None = None, keep: Image | None = None) -> Background:
    """The detector `settings.kind`.

    scale: processed over source size, None by the picture's size; keep (h, w) of any size: there is no foreground
    where this picture is black.
    """
    if settings.kind == "paper":
        return Paper(settings.paper, scale, keep)
    if settings.kind == "disturbance":
        return Disturbance(settings.disturbance, scale, keep)
    return OpenCV(settings.kind, scale, keep)
