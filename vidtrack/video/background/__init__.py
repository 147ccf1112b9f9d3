"""Background models: foreground by comparison with a scene learnt from earlier frames."""

from __future__ import annotations

from numpy.typing import NDArray

from vidtrack.config.video import DetectorSettings
from vidtrack.video.background.disturbance import Disturbance
from vidtrack.video.background.opencv import OpenCV
from vidtrack.video.background.paper import Paper
from vidtrack.video.background.picture import View
from vidtrack.video.foreground import Background


def create(settings: DetectorSettings, scale: float | None = None, keep: NDArray | None = None) -> Background:
    """The background model `settings.kind`.

    scale  processed over source size; None: by the picture's size
    keep   (h, w) mask of any size; dark pixels have no foreground
    """
    view = View(scale, keep)
    if settings.kind == "paper":
        return Paper(settings.paper, view)
    if settings.kind == "disturbance":
        return Disturbance(settings.disturbance, view)
    return OpenCV(settings.kind, view)
