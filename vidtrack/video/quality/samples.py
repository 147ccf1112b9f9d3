"""A sparse grid of pixels of every picture, for light and noise."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from vidtrack.video.frame import Frame, Image

_POINTS = 20_000  # wanted on the grid: 150 rows of 130, enough for the gain of a row
_REMEMBERED = 1500  # pictures; 30 MB


class Samples:
    """Luminance on a grid of single pixels, without averages, so that the noise is unchanged.

    black, white  the luminance of black and white in this source
    repeats       (K,) whether all pixels of a picture equal those of the one before
    """

    def __init__(self) -> None:
        self._grids: deque[Image] = deque(maxlen=_REMEMBERED)
        self._repeats: deque[bool] = deque(maxlen=_REMEMBERED)
        self._former: Image | None = None
        self.black, self.white = 0, 255

    def take(self, frame: Frame) -> None:
        """Add a picture."""
        if self._former is None:
            self.black, self.white = (0, 255) if frame.full_range else (16, 235)
        stride = max(1, math.ceil(math.sqrt(frame.y.size / _POINTS)))
        self._grids.append(frame.y[::stride, ::stride].copy())
        self._repeats.append(self._former is not None and np.array_equal(frame.y, self._former))
        self._former = frame.y

    @property
    def luma(self) -> NDArray[np.uint8]:
        """(K, h, w) the points of each picture."""
        return np.stack(self._grids)

    @property
    def repeats(self) -> NDArray[np.bool_]:
        """(K,)."""
        return np.array(self._repeats)
