"""Camera shake: phase correlation of each picture with an earlier one, median over tiles."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats
from vidtrack.video.frame import Frame

_COLUMNS = 512  # pictures are reduced to at most so many
_TILES = (4, 3)  # columns and rows: traffic fills less than half of them
_TEXTURE = 3.0  # grey levels; tiles with a smaller standard deviation are not used
_FEWEST = 4  # tiles with texture
_ANCHORED_S = 1.0
_OFTEN = 90  # percentile: gusts count, a lorry that fills the picture once does not


@dataclass(frozen=True, slots=True)
class Shake:
    """Displacements in source pixels; None if the picture has too little texture.

    px        90th percentile of the displacement from one picture to the next
    drift_px  from the first picture to the last
    """

    px: float | None
    drift_px: float | None


class ShakeMeter:
    """Measures the displacement of each picture against one up to a second older."""

    def __init__(self) -> None:
        self._anchor: NDArray[np.float32] | None = None
        self._anchor_s = 0.0
        self._anchor_at = np.zeros(2)
        self._places: list[Floats] = []

    def take(self, frame: Frame) -> None:
        """Add a picture."""
        step = max(1, math.ceil(frame.shape[1] / _COLUMNS))
        h, w = (size // step for size in frame.shape)
        picture = cv2.resize(frame.y[: h * step, : w * step], (w, h), interpolation=cv2.INTER_AREA).astype(np.float32)
        if self._anchor is None:
            self._anchor, self._anchor_s = picture, frame.time_s
            return
        shift = _shift(self._anchor, picture)
        if shift is None:
            return
        self._places.append(self._anchor_at + shift * step)
        if frame.time_s - self._anchor_s > _ANCHORED_S:
            self._anchor, self._anchor_s, self._anchor_at = picture, frame.time_s, self._places[-1]

    def result(self) -> Shake:
        """The shake of all pictures so far."""
        if len(self._places) < 2:
            return Shake(None, None)
        places = np.array(self._places)
        swing = np.linalg.norm(np.diff(places, axis=0), axis=1)
        return Shake(float(np.percentile(swing, _OFTEN)), float(np.linalg.norm(places[-1])))


def _shift(anchor: NDArray[np.float32], current: NDArray[np.float32]) -> Floats | None:
    """(2,) median displacement of the tiles with texture; None if there are too few."""
    columns, rows = _TILES
    h, w = anchor.shape[0] // rows, anchor.shape[1] // columns
    if min(h, w) < 8:
        return None
    window = cv2.createHanningWindow((w, h), cv2.CV_32F)
    shifts = []
    for top in range(0, rows * h, h):
        for left in range(0, columns * w, w):
            a, b = (np.ascontiguousarray(p[top : top + h, left : left + w]) for p in (anchor, current))
            if a.std() > _TEXTURE:
                shifts.append(cv2.phaseCorrelate(a - a.mean(), b - b.mean(), window)[0])
    return np.median(shifts, axis=0) if len(shifts) >= _FEWEST else None
