"""How far each pixel is from the scene, in units of its threshold."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vidtrack.compiled import kernel
from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import BEAM, Levels, Scene
from vidtrack.video.frame import Image

_ONE, _NO_HIT = np.float32(1), np.uint8(0)
_CLEAR = 40.0  # grey levels over two pixels; one pixel in a hundred of a scene in clear light has a steeper edge
_STEEP = 99.0  # percent
LEAST_CONTRAST = 0.5  # of the threshold in clear light
_SHARP, _BLURRED = 65.0, 50.0  # grey levels over two pixels of the steepest edges in clear light, and in haze
_STEEPEST = 99.9  # percent
_DARKEST, _BRIGHTEST = 0.5, 99.9  # percent of the pixels
_STANDS_OUT = 1.25  # interquartile ranges below the median; evenly spread levels reach down by 1.0
_DARK_PAINT = 10.0  # grey levels; tyres are not quite black
_ROWS = 4  # every so many are looked at
_SAMPLED, _SURELY_BELOW = 16, 0.95  # one value in so many, and the share of these below which others are left out


def contrast(luma: Levels) -> np.float32:
    """Contrast of the scene (h, w) relative to clear light, 0.5..1; vehicles lose as much to haze and darkness."""
    rows = luma[::_ROWS]
    edges = np.abs(rows[:, 2:] - rows[:, :-2])
    return np.float32(min(max(_upper_percentile(edges, _STEEP) / _CLEAR, LEAST_CONTRAST), 1.0)) if edges.size else _ONE


def haziness(luma: Levels) -> np.float32:
    """How far haze or darkness blurs the scene (h, w), 0 clear .. 1: by its steepest edges, across or down.

    A clear view of a smooth road has few edges, but those of its marks and kerbs are steep.
    """
    steepest = [
        _upper_percentile(edges, _STEEPEST)
        for edges in (np.abs(luma[::_ROWS, 2:] - luma[::_ROWS, :-2]), np.abs(luma[2:, ::_ROWS] - luma[:-2, ::_ROWS]))
        if edges.size
    ]
    return np.float32(np.clip((_SHARP - max(steepest, default=_SHARP)) / (_SHARP - _BLURRED), 0, 1))


def veil(luma: Image) -> float | None:
    """Luminance that haze adds to black, from the darkest pixels of a picture (h, w), which are black in clear air.

    None if the darkest pixels do not stand out from the rest: the picture then shows nothing black.
    """
    dark, low, median, high = _percentiles(luma[::_ROWS], (_DARKEST, 25, 50, 75))
    if median - dark < _STANDS_OUT * (high - low):
        return None
    return max(float(dark) - _DARK_PAINT, 0.0)


def brightest(luma: Levels) -> np.float32:
    """Luminance of the brightest of the scene (h, w); haze has less."""
    rows = luma[::_ROWS]
    return np.float32(_upper_percentile(rows, _BRIGHTEST)) if rows.size else np.float32(255)


def _upper_percentile(values: Levels, percent: float) -> float:
    """np.percentile of many values, of which nearly all are smaller: only the larger ones are sorted, in a tenth of
    the time.
    """
    flat = values.ravel()
    place = (flat.size - 1) * (percent / 100)
    k, share = int(place), place - int(place)
    sample = np.sort(flat[::_SAMPLED])
    top = flat[flat > sample[int(_SURELY_BELOW * len(sample))]]
    if len(top) < flat.size - k:
        top = flat
    at = k - flat.size + len(top)
    pair = np.partition(top, (at, min(at + 1, len(top) - 1)))[at : at + 2]
    return _between(pair[0], pair[-1], share)


def _percentiles(levels: Image, percents: Sequence[float]) -> list[float]:
    """np.percentile of levels uint8, from how often each of the 256 occurs."""
    below = np.bincount(levels.ravel(), minlength=256).cumsum()
    place = [(levels.size - 1) * (percent / 100) for percent in percents]
    least, next_one = (below.searchsorted([int(each) + more for each in place], side="right") for more in (0, 1))
    return [
        _between(float(a), float(min(b, 255)), each - int(each))
        for a, b, each in zip(least, next_one, place, strict=True)
    ]


def _between(a: float, b: float, share: float) -> float:
    """From a towards b by a share of the way, from the nearer end, as NumPy does."""
    return float(a + (b - a) * share if share < 0.5 else b - (b - a) * (1 - share))


@kernel
def disturbance(
    picture: Picture,
    scene: Scene,
    floor: np.float32,
    noise_factor: np.float32,
    chroma_threshold: np.float32,
    least: np.float32,
    strength: Levels,
    weak: Image,
    hit: Image,
) -> None:
    """strength = sqrt((dY / TY)^2 + (dCb / TC)^2 + (dCr / TC)^2), weak = strength > least, hit = strength > 1, (h, w).

    TY = max(floor, noise_factor * noise), per pixel; TC = chroma_threshold. Four luminance pixels share one of
    chroma. strength is float32, weak and hit are uint8 0 or 1. A loop that writes several arrays, or reads more than
    a few, is not vectorised: they may overlap.
    """
    h, w = hit.shape
    scale = _ONE / chroma_threshold
    half = np.zeros((w + 1) // 2, np.float32)
    chroma = np.zeros(2 * len(half), np.float32)
    for y in range(h):
        if len(picture.cb) > 0 and y % 2 == 0:
            for x in range(len(half)):
                blue = (np.float32(picture.cb[y // 2, x]) - scene.cb[y // 2, x]) * scale
                red = (np.float32(picture.cr[y // 2, x]) - scene.cr[y // 2, x]) * scale
                half[x] = blue * blue + red * red
            for x in range(len(half)):
                chroma[2 * x], chroma[2 * x + 1] = half[x], half[x]
        for x in range(w):
            threshold = max(floor, noise_factor * scene.noise[y, x])
            d = (np.float32(picture.luma[y, x]) - scene.luma[y, x]) / threshold
            strength[y, x] = np.sqrt(d * d + chroma[x])
        for x in range(w):
            weak[y, x] = np.uint8(strength[y, x] > least)
        for x in range(w):
            hit[y, x] = np.uint8(strength[y, x] > _ONE)


@kernel
def strong(weak: Image, hit: Image) -> None:
    """Give the hits (h, w), 0 or 1, the values of the weak hits, where lamps light the scene all of them."""
    h, w = weak.shape
    for y in range(h):
        for x in range(w):
            hit[y, x] = weak[y, x] if (hit[y, x] == 1) | (weak[y, x] == BEAM) else _NO_HIT
