"""The disturbance map as paper 004 has it (Halevy and Weinshall): a running average and a fixed threshold."""

from __future__ import annotations

import numpy as np

from vidtrack.config import PaperSettings
from vidtrack.errors import Error
from vidtrack.scan import Floats
from vidtrack.video.background.picture import NO_CHROMA, Picture, kept, reduce, reduction, to_bgr
from vidtrack.video.foreground import Foreground
from vidtrack.video.frame import Frame, Image


class Paper:
    """D = I - A, foreground where |D| > threshold, then A = (1 - w) A + w I, on luminance, per frame whatever its time.

    A is the average of the frames before; the first frame is the first average and shows nothing.
    """

    def __init__(self, settings: PaperSettings, scale: float | None = None, keep: Image | None = None) -> None:
        """scale: processed over source size; keep (any size): there is no foreground where it is black."""
        self._settings = settings
        self._scale = scale
        self._keep_image = keep
        self._first: Frame | None = None

    def apply(self, frame: Frame, known: Floats) -> Foreground:
        """Foreground of `frame`; `known` boxes change nothing here."""
        s = self._settings
        step = reduction(frame.shape[0], self._scale)
        luma = reduce(frame, step).luma.astype(float)
        if self._first is None:
            self._first = frame
            self._keep = kept(self._keep_image, luma.shape)
            self._average = luma
        D = luma - self._average
        size = np.abs(D) if s.two_sided else np.maximum(D, 0)
        mask = np.where(size > s.threshold, np.uint8(255), np.uint8(0))
        if self._keep is not None:
            mask &= self._keep
        self._average = (1 - s.weight) * self._average + s.weight * luma
        return Foreground(mask, size / s.threshold, step)

    def scene(self) -> Image:
        """(H, W, 3) the running average in source size, grey as blue-green-red."""
        if self._first is None:
            raise Error("there is no scene before the first frame; call apply first")
        step = reduction(self._first.shape[0], self._scale)
        return to_bgr(Picture(self._average, NO_CHROMA, NO_CHROMA), self._first.shape, step, self._first.full_range)
