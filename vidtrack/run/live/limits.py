"""How much a live run keeps, and whether its limits can be held."""

from __future__ import annotations

import numpy as np

from vidtrack.config.live import LiveSettings
from vidtrack.config.settings import Settings
from vidtrack.recording.retention import Limits, Retention
from vidtrack.run.video import build_detector
from vidtrack.state import gather
from vidtrack.video.frame import Frame


def retention_of(live: LiveSettings) -> Retention:
    """The retention that the settings ask for."""
    return Retention(
        Limits(live.keep_s, live.keep_bytes),
        Limits(live.keep_tracks_s, live.keep_tracks_bytes),
        Limits(live.keep_recordings_s, live.keep_recordings_bytes),
        live.keep_counts_s,
    )


def part_sizes(settings: Settings, like: Frame, *, recorded: bool) -> tuple[float, float]:
    """Bytes that one part of the results and one of the recording take at least: the picture, and the state.

    The saved state of a busy scene takes half of its arrays.
    """
    height, width = like.shape
    if not recorded:
        return 3.0 * width * height, 0.0
    detector = build_detector(settings)
    detector.apply(like, np.empty((0, 4)))
    arrays = (value for value in gather(detector).values() if isinstance(value, np.ndarray))
    return 3.0 * width * height, sum(array.nbytes for array in arrays) / 2
