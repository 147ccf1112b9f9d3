"""OpenCV's background subtractors behind the same interface, for comparison."""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.video.background.picture import View
from vidtrack.video.foreground import Foreground
from vidtrack.video.frame import Frame, Image

_WINDOW = 7  # px, of the median that cleans the mask
_SHADOW = 127  # OpenCV's mark


class OpenCV:
    """MOG2 or KNN with OpenCV's defaults on the reduced picture; shadow is not foreground; 7x7 median."""

    def __init__(self, kind: Literal["mog2", "knn"], view: View) -> None:
        create = cv2.createBackgroundSubtractorMOG2 if kind == "mog2" else cv2.createBackgroundSubtractorKNN
        self._model = create(detectShadows=True)
        self._view = view

    def apply(self, frame: Frame, known: Floats) -> Foreground:
        """Foreground of `frame`; strength is 1 on it, as OpenCV gives none; `known` boxes change nothing here."""
        planes = self._view.reduce(frame)
        y, u, v = planes
        coloured = frame.u is not None
        picture = Frame(
            frame.index, frame.time_s, y, u if coloured else None, v if coloured else None, frame.full_range
        )
        found = self._model.apply(picture.bgr())
        mask = cv2.medianBlur(np.where(found > _SHADOW, np.uint8(255), np.uint8(0)), _WINDOW)
        return self._view.foreground(np.asarray(mask, np.uint8), (mask > 0).astype(np.float32), planes=planes)

    def keep(self, mask: Image | None) -> None:
        """Find no foreground where a mask (h, w) is dark."""
        self._view.keep = mask

    def scene(self) -> Image:
        """(H, W, 3) the model's background in source size, blue-green-red."""
        h, w = self._view.shape
        return np.asarray(
            cv2.resize(self._model.getBackgroundImage(), (w, h), interpolation=cv2.INTER_LINEAR), np.uint8
        )
