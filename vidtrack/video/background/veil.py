"""The veil: light that haze or glare adds to everything, more at some places than at others."""

from __future__ import annotations

from operator import attrgetter
from typing import ClassVar, NamedTuple

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
_FAINT, _FAINTEST = np.float32(0.25), np.float32(0.5)  # veil, as a share of the haze's own light, that spreads light


class Haze(NamedTuple):
    """Haze over the whole scene.

    share  how far it blurs the scene, 0 clear .. 1
    clear  luminance of black in clear air
    black  luminance of black as it is seen
    light  luminance of the haze itself, at most
    """

    share: np.float32
    clear: np.float32
    black: np.float32
    light: np.float32


class Air(NamedTuple):
    """What the air does to the light at each place.

    black   (h, w) luminance of black as it is seen
    spread  (h, w) how far haze spreads the light of the sky, 0 clear .. 1: shadows are faint then
    """

    black: Levels
    spread: Levels


def even(haze: Haze, shape: tuple[int, int]) -> Air:
    """The same air at all places of a picture (h, w)."""
    return Air(np.full(shape, haze.black), np.full(shape, _spread(haze.black, haze)))


class VeilByPlace:
    """Learns the veil in cells of the picture, from the darkest pixels of the traffic in each.

    Tyres, grilles and what is under a vehicle are nearly black. Where nothing that drives is dark, light is added.
    Glare only adds it; haze also takes away from what is behind it (Koschmieder's law).
    """

    STATE = ("_darkest", "_seen_s", "_since_s")
    ADDED: ClassVar = {name: attrgetter(name) for name in STATE}  # learnt anew

    def __init__(self) -> None:
        self._darkest = np.full((_ROWS, _COLUMNS), 255.0)
        self._seen_s = np.zeros((_ROWS, _COLUMNS))
        self._since_s = 0.0
        self._last: tuple[Floats, Haze, Air] | None = None  # levels and haze that the last air was made of, and it
        self._known: tuple[Floats, Haze, Floats] | None = None  # what the last levels were made of, and they

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

    def air(self, haze: Haze, shape: tuple[int, int]) -> Air:
        """The air at each place of a picture (h, w): that of `haze` where it is not known that more is added."""
        level = self._levels(haze)
        if self._last is not None:
            before, base, air = self._last
            if base == haze and air.black.shape == shape and np.array_equal(before, level):
                return air
        air = _between(level, haze, shape) if (level > haze.black).any() else even(haze, shape)
        self._last = level, haze, air
        return air

    def _levels(self, haze: Haze) -> Floats:
        """Luminance of black in each cell; the same until something is learnt: `_darkest` is another array then."""
        if self._known is None or self._known[0] is not self._darkest or self._known[1] != haze:
            self._known = self._darkest, haze, self._of_cells(haze)
        return self._known[2]

    def _of_cells(self, haze: Haze) -> Floats:
        """Luminance of black in each cell; where it is not known that of the nearest known cells, if any is."""
        known = self._seen_s > _SEEN_S
        room = max(float(haze.light) - _DARK, 1.0)
        behind = 1 - haze.share * np.clip((self._darkest - _DARK) / room, 0, 1)  # share of the light that comes through
        level = np.where(known, np.maximum(self._darkest - _DARK * behind, haze.black), haze.black)
        return _filled(level, known) if (level > haze.black).any() else level


def _between(level: Floats, haze: Haze, shape: tuple[int, int]) -> Air:
    """The air of a picture (h, w) between cells with these levels of black."""
    black = np.asarray(cv2.resize(level.astype(np.float32), shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)
    return Air(black, _spread(black, haze) if haze.share else np.zeros(shape, np.float32))


def _spread(black: Levels | np.float32, haze: Haze) -> Levels:
    """Air.spread (h, w) where black is seen so bright."""
    veil = (black - haze.clear) / max(haze.light - haze.clear, np.float32(1))
    return np.asarray(haze.share * np.clip((veil - _FAINT) / (_FAINTEST - _FAINT), np.float32(0), np.float32(1)))


def _filled(level: Floats, known: Mask) -> Floats:
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
