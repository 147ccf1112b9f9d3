"""How the camera moves: phase correlation of each picture with the one before, in tiles that vote."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.scan import Floats
from vidtrack.video.frame import Frame

_COLUMNS = 512  # pictures are reduced to at most so many
_TILES = (4, 3)  # columns and rows: traffic fills less than half of them
_TEXTURE = 3.0  # grey levels; standard deviation below which a tile shows nothing to hold on to
_FEWEST = 4  # tiles with texture
_OFTEN = 90  # percentile: gusts count, a lorry that fills the picture once does not


@dataclass(frozen=True, slots=True)
class Shake:
    """Displacements in source pixels; None where the picture has nothing to hold on to.

    px        from one picture to the next, exceeded one time in ten
    drift_px  from the first picture to the last
    """

    px: float | None
    drift_px: float | None


class ShakeMeter:
    """Measures the displacement of each picture against the one before."""

    def __init__(self) -> None:
        self._former: NDArray[np.float32] | None = None
        self._shifts: list[Floats] = []
        self._step = 1

    def take(self, frame: Frame) -> None:
        """Add a picture."""
        self._step = max(1, math.ceil(frame.shape[1] / _COLUMNS))
        h, w = (size // self._step for size in frame.shape)
        picture = cv2.resize(frame.y[: h * self._step, : w * self._step], (w, h), interpolation=cv2.INTER_AREA)
        current = picture.astype(np.float32)
        if self._former is not None:
            shift = _shift(self._former, current)
            if shift is not None:
                self._shifts.append(shift * self._step)
        self._former = current

    def result(self) -> Shake:
        """Of all pictures so far."""
        if not self._shifts:
            return Shake(None, None)
        shifts = np.array(self._shifts)
        drift = shifts.sum(axis=0)
        swing = np.linalg.norm(shifts - shifts.mean(axis=0), axis=1)
        return Shake(float(np.percentile(swing, _OFTEN)), float(np.linalg.norm(drift)))


def _shift(former: NDArray[np.float32], current: NDArray[np.float32]) -> Floats | None:
    """(2,) median over the tiles with texture; None if they are too few."""
    columns, rows = _TILES
    h, w = former.shape[0] // rows, former.shape[1] // columns
    if min(h, w) < 8:
        return None
    window = cv2.createHanningWindow((w, h), cv2.CV_32F)
    shifts = []
    for top in range(0, rows * h, h):
        for left in range(0, columns * w, w):
            a, b = (np.ascontiguousarray(p[top : top + h, left : left + w]) for p in (former, current))
            if a.std() > _TEXTURE:
                shifts.append(cv2.phaseCorrelate(a - a.mean(), b - b.mean(), window)[0])
    return np.median(shifts, axis=0) if len(shifts) >= _FEWEST else None
