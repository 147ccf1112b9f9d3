"""The disturbance map of paper 004 (Halevy and Weinshall): a running average and a fixed threshold."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.config.video import PaperSettings
from vidtrack.video.background.picture import Picture, View
from vidtrack.video.foreground import Foreground
from vidtrack.video.frame import Frame, Image


class Paper:
    """D = I - A, foreground where |D| > threshold, then A = (1 - w) A + w I; luminance only, per frame.

    A is the average of the earlier frames. The first frame initialises it and has no foreground.
    """

    STATE = ("_view", "_average")

    def __init__(self, settings: PaperSettings, view: View) -> None:
        self._settings = settings
        self._view = view
        self._average: Floats = np.empty((0, 0))

    def apply(self, frame: Frame, known: Floats) -> Foreground:
        """Foreground of `frame`; strength is |D| / threshold; `known` boxes change nothing here."""
        s = self._settings
        planes = self._view.reduce(frame)
        intensity = planes.luma.astype(float)
        if not self._average.size:
            self._average = intensity
        D = intensity - self._average
        strength = (np.abs(D) if s.two_sided else np.maximum(D, 0)) / s.threshold
        self._average = (1 - s.weight) * self._average + s.weight * intensity
        return self._view.foreground(np.where(strength > 1, np.uint8(255), np.uint8(0)), strength, planes=planes)

    def keep(self, mask: Image | None) -> None:
        """Find no foreground where a mask (h, w) is dark."""
        self._view.keep = mask

    def scene(self) -> Image:
        """(H, W, 3) the running average in source size, grey as blue-green-red."""
        none = np.empty((0, 0))
        return self._view.enlarge(Picture(self._average, none, none))
