"""OpenCV's background subtractors behind the same interface, for comparison."""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np

from vidtrack.errors import Error
from vidtrack.scan import Floats
from vidtrack.video.background.picture import kept, reduce, reduction
from vidtrack.video.foreground import Foreground
from vidtrack.video.frame import Frame, Image

_WINDOW = 7  # px, of the median that cleans the mask
_SHADOW = 127  # OpenCV's mark


class OpenCV:
    """MOG2 or KNN with OpenCV's defaults on the reduced picture; shadow is not foreground; 7x7 median."""

    def __init__(self, kind: Literal["mog2", "knn"], scale: float | None = None, keep: Image | None = None) -> None:
        """scale: processed over source size; keep (any size): there is no foreground where it is black."""
        create = cv2.createBackgroundSubtractorMOG2 if kind == "mog2" else cv2.createBackgroundSubtractorKNN
        self._model = create(detectShadows=True)
        self._scale = scale
        self._keep_image = keep
        self._shape: tuple[int, int] | None = None

    def apply(self, frame: Frame, known: Floats) -> Foreground:
        """Foreground of `frame`; strength is 1 on it, as OpenCV gives none; `known` boxes change nothing here."""
        step = reduction(frame.shape[0], self._scale)
        luma, cb, cr = reduce(frame, step)
        colours = (cb, cr) if cb.size else (None, None)
        picture = Frame(frame.index, frame.time_s, luma, *colours, frame.full_range).bgr()
        if self._shape is None:
            self._shape = frame.shape
            self._keep = kept(self._keep_image, luma.shape)
        found = self._model.apply(picture)
        mask = cv2.medianBlur(np.where(found > _SHADOW, np.uint8(255), np.uint8(0)), _WINDOW)
        if self._keep is not None:
            mask &= self._keep
        return Foreground(mask, (mask > 0).astype(np.float32), step)

    def scene(self) -> Image:
        """(H, W, 3) the model's background in source size, blue-green-red."""
        if self._shape is None:
            raise Error("there is no scene before the first frame; call apply first")
        return np.asarray(
            cv2.resize(self._model.getBackgroundImage(), self._shape[::-1], interpolation=cv2.INTER_LINEAR)
        )
