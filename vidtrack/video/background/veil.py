"""The veil: light that haze or glare adds to everything, more at some places than at others."""

from __future__ import annotations

from operator import attrgetter
from typing import ClassVar

import cv2
import numpy as np

from vidtrack.arrays.types import Floats, Mask
from vidtrack.compiled import kernel
from vidtrack.video.background.scene import Levels
from vidtrack.video.frame import Image

_ROWS, _COLUMNS = 6, 8  # cells
_EVERY_S = 0.2  # s between pictures that are looked at
_LEAST = 0.05  # share of a cell that traffic covers, from which its darkest pixel tells
_SEEN_S = 2.0  # s of traffic in a cell before its veil is known
_LIFT = 1.0  # grey levels by which the darkest luminance is forgotten in a second of traffic
_DARK = 40.0  # grey levels; the darkest part of vehicles is darker than this where nothing adds light


class VeilByPlace:
    """Learns the veil in cells of the picture, from the darkest pixels of the traffic in each.

    Tyres, grilles and what is under a vehicle are nearly black. Where nothing that drives is dark, light is added.
    """

    STATE = ("_darkest", "_seen_s", "_since_s")
    ADDED: ClassVar = {name: attrgetter(name) for name in STATE}  # learnt anew

    def __init__(self) -> None:
        self._darkest = np.full((_ROWS, _COLUMNS), 255.0)
        self._seen_s = np.zeros((_ROWS, _COLUMNS))
        self._since_s = 0.0
        self._last: tuple[Floats, np.float32, Levels] | None = None  # darkest and least of the last black, and it

    def learn(self, luma: Image, mask: Image, dt: float) -> None:
        """Take a picture (h, w) and where it shows traffic, dt [s] after the last one."""
        self._since_s += dt
        if self._since_s < _EVERY_S:
            return
        darkest, share = _darkest(luma, mask)
        seen_s = np.where(share > _LEAST, self._since_s, 0.0)
        lifted = self._darkest + _LIFT * seen_s
        self._darkest = np.where(seen_s > 0, np.minimum(lifted, darkest), lifted)
        self._seen_s += seen_s
        self._since_s = 0.0

    def black(self, least: np.float32, shape: tuple[int, int]) -> Levels:
        """(h, w) the luminance of black at each place: `least` where nothing is added or known."""
        if self._last is not None:
            darkest, base, black = self._last
            if darkest is self._darkest and base == least and black.shape == shape:
                return black
        black = self._interpolated(least, shape)
        self._last = self._darkest, least, black
        return black

    def _interpolated(self, least: np.float32, shape: tuple[int, int]) -> Levels:
        known = self._seen_s > _SEEN_S
        level = np.where(known, np.maximum(self._darkest - _DARK, least), least)
        if not (level > least).any():
            return np.full(shape, least)
        cells = _spread(level, known).astype(np.float32)
        return np.asarray(cv2.resize(cells, shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)


def _spread(level: Floats, known: Mask) -> Floats:
    """Levels of the cells, unknown ones as their nearest known neighbours."""
    around = np.ones((3, 3))
    while not known.all():
        total, count = (
            cv2.filter2D(each, -1, around, borderType=cv2.BORDER_CONSTANT)
            for each in (np.where(known, level, 0.0), known.astype(np.float64))
        )
        level = np.where(known, level, total / np.maximum(count, 1))
        known = known | (count > 0.5)
    return level


@kernel
def _darkest(luma: Image, mask: Image) -> tuple[Floats, Floats]:
    """Least luminance where mask (h, w) is not 0, and the share of such pixels, in each cell."""
    h, w = mask.shape
    darkest, share = np.full((_ROWS, _COLUMNS), 255.0), np.zeros((_ROWS, _COLUMNS))
    for y in range(h):
        i = y * _ROWS // h
        for x in range(w):
            if mask[y, x]:
                j = x * _COLUMNS // w
                darkest[i, j] = min(darkest[i, j], luma[y, x])
                share[i, j] += 1
    return darkest, share * (_ROWS * _COLUMNS / (h * w))
