"""How far each pixel is from the scene, in units of its threshold."""

from __future__ import annotations

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
_DARKEST = 0.5  # percent of the pixels
_STANDS_OUT = 1.25  # interquartile ranges below the median; evenly spread levels reach down by 1.0
_DARK_PAINT = 10.0  # grey levels; tyres are not quite black
_ROWS = 4  # every so many are looked at


def contrast(luma: Levels) -> np.float32:
    """Contrast of the scene (h, w) relative to clear light, 0.5..1; vehicles lose as much to haze and darkness."""
    rows = luma[::_ROWS]
    edges = np.abs(rows[:, 2:] - rows[:, :-2])
    return (
        np.float32(min(max(float(np.percentile(edges, _STEEP)) / _CLEAR, LEAST_CONTRAST), 1.0)) if edges.size else _ONE
    )


def haziness(luma: Levels) -> np.float32:
    """How far haze or darkness blurs the scene (h, w), 0 clear .. 1: by its steepest edges, across or down.

    A clear view of a smooth road has few edges, but those of its marks and kerbs are steep.
    """
    steepest = [
        float(np.percentile(edges, _STEEPEST))
        for edges in (np.abs(luma[::_ROWS, 2:] - luma[::_ROWS, :-2]), np.abs(luma[2:, ::_ROWS] - luma[:-2, ::_ROWS]))
        if edges.size
    ]
    return np.float32(np.clip((_SHARP - max(steepest, default=_SHARP)) / (_SHARP - _BLURRED), 0, 1))


def veil(luma: Image) -> float | None:
    """Luminance that haze adds to black, from the darkest pixels of a picture (h, w), which are black in clear air.

    None if the darkest pixels do not stand out from the rest: the picture then shows nothing black.
    """
    dark, low, median, high = np.percentile(luma[::_ROWS], (_DARKEST, 25, 50, 75))
    if median - dark < _STANDS_OUT * (high - low):
        return None
    return max(float(dark) - _DARK_PAINT, 0.0)


@kernel(error_model="numpy")
def disturbance(
    picture: Picture,
    scene: Scene,
    floor: np.float32,
    noise_factor: np.float32,
    chroma_threshold: np.float32,
    least: np.float32,
    strength: Levels,
    hit: Image,
) -> None:
    """strength = sqrt((dY / TY)^2 + (dCb / TC)^2 + (dCr / TC)^2) and hit = strength > least, both (h, w).

    TY = max(floor, noise_factor * noise), per pixel; TC = chroma_threshold. Four luminance pixels share one of
    chroma. strength is float32, hit uint8 0 or 1.
    """
    h, w = hit.shape
    scale = _ONE / chroma_threshold
    half = np.zeros((w + 1) // 2, np.float32)
    chroma = np.zeros(w, np.float32)
    for y in range(h):
        if len(picture.cb) > 0 and y % 2 == 0:
            for x in range(len(half)):
                blue = (np.float32(picture.cb[y // 2, x]) - scene.cb[y // 2, x]) * scale
                red = (np.float32(picture.cr[y // 2, x]) - scene.cr[y // 2, x]) * scale
                half[x] = blue * blue + red * red
            for x in range(w):
                chroma[x] = half[x // 2]
        for x in range(w):
            threshold = max(floor, noise_factor * scene.noise[y, x])
            d = (np.float32(picture.luma[y, x]) - scene.luma[y, x]) / threshold
            strength[y, x] = np.sqrt(d * d + chroma[x])
            hit[y, x] = np.uint8(strength[y, x] > least)


@kernel
def strong(strength: Levels, weak: Image) -> Image:
    """(h, w) the values of the weak hits where the strength is above 1, or where lamps light the scene; else 0."""
    hit = np.empty_like(weak)
    h, w = weak.shape
    for y in range(h):
        for x in range(w):
            hit[y, x] = weak[y, x] if (strength[y, x] > _ONE) | (weak[y, x] == BEAM) else _NO_HIT
    return hit
