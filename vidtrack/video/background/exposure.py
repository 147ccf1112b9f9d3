"""The camera's automatic exposure and white balance, for the whole picture, from a sparse grid of points."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.median import median
from vidtrack.arrays.types import Floats
from vidtrack.compiled import inlined, kernel
from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import Levels, Scene
from vidtrack.video.frame import Image

_POINTS = 1500  # wanted on the grid
_DARK, _BRIGHT = np.float32(24), np.float32(235)  # grey levels between which a ratio means something
_CLIPPED = np.float32(250)
_STEP = np.float32(0.02)  # a smaller change is left to learning
_SEEN = np.float32(0.1)  # a smaller change leaves pictures alike
_LARGEST = np.float32(4)  # no exposure changes more at once: the lens is covered, or the picture is missing
_TINT_STEP = np.float32(0.01)  # share of the light; a smaller change of the white balance is left to learning
_LARGEST_TINT = np.float32(0.5)
_LIT = np.float32(64)  # grey levels of points that tell the white balance; of darker ones chroma is coarse


@kernel
def follow_gain(picture: Picture, scene: Scene, black: np.float32) -> None:
    """Multiply the scene's luminance by the camera's gain relative to it, if learning is too slow for that gain."""
    g = gain(picture.luma, scene, black)
    if abs(g - np.float32(1)) > _STEP:
        for plane in (scene.luma, scene.former):
            for y in range(len(plane)):
                _amplify(plane[y], g, black)


def relit(picture: Picture, scene: Scene, black: np.float32) -> Picture:
    """The picture in the light of the scene, of which no pixel is covered."""
    lit = scene._replace(luma=scene.luma.copy(), former=scene.former[:0])
    follow_gain(picture, lit, black)
    if np.array_equal(lit.luma, scene.luma):
        return picture
    light, shown = ((plane - black).sum() for plane in (scene.luma, lit.luma))
    if light <= 0 or abs(shown / light - 1) < _SEEN:
        return picture
    back, zeros = light / shown, (black, 128, 128)
    planes = (zero + back * (plane - zero) for plane, zero in zip(picture, zeros, strict=True))
    return Picture(*(np.clip(np.rint(plane), 0, 255).astype(np.uint8) for plane in planes))


@inlined
def _amplify(row: Levels, g: np.float32, black: np.float32) -> None:
    for x in range(len(row)):
        row[x] = min(black + g * (row[x] - black), np.float32(255))


@inlined
def gain(luma: Image, scene: Scene, black: np.float32) -> np.float32:
    """Median of (Y - black) / (B - black) over points that were not covered in the last picture; 1 if too few.

    luma (h, w) uint8. The median is robust to new traffic on less than half of the points.
    """
    h, w = luma.shape
    stride = max(1, int(np.sqrt(h * w / _POINTS)))
    ratio = np.empty((h // stride + 1) * (w // stride + 1))
    n = 0
    for y in range(0, h, stride):
        for x in range(0, w, stride):
            B = scene.luma[y, x]
            if scene.covered_s[y, x] == 0 and _DARK < B < _BRIGHT and luma[y, x] <= _CLIPPED:
                ratio[n] = (np.float32(luma[y, x]) - black) / (B - black)
                n += 1
    if 10 * n < len(ratio) or _mostly_near(ratio[:n], np.float32(1), _STEP):
        return np.float32(1)
    g = np.float32(median(ratio[:n]))
    return g if 1 / _LARGEST < g < _LARGEST else np.float32(1)


@inlined
def _mostly_near(values: Floats, middle: np.float32, step: np.float32) -> bool:
    """Whether the median of values (N,) is within a step of the middle."""
    above = below = 0
    for value in values:
        above += value > middle + step
        below += value < middle - step
    return 2 * max(above, below) < len(values)


@kernel
def follow_tint(picture: Picture, scene: Scene, black: np.float32) -> None:
    """Shift the scene's chroma by the camera's white balance relative to it, if learning is too slow for that.

    A camera that amplifies red or blue more shifts the chroma of what is grey in proportion to its light.
    """
    for plane, levels in ((picture.cb, scene.cb), (picture.cr, scene.cr)):
        shift = tint(plane, levels, picture.luma, scene, black)
        if abs(shift) > _TINT_STEP:
            for y in range(len(levels)):
                for x in range(levels.shape[1]):
                    levels[y, x] += shift * (scene.luma[2 * y, 2 * x] - black)


@inlined
def tint(chroma: Image, learnt: Levels, luma: Image, scene: Scene, black: np.float32) -> np.float32:
    """Median of (C - learnt) / (B - black) over points that were not covered in the last picture; 0 if too few.

    chroma, learnt  (h / 2, w / 2) the same plane of the picture and of the scene
    """
    h, w = chroma.shape
    stride = max(1, int(np.sqrt(h * w / _POINTS)))
    shift = np.empty((h // stride + 1) * (w // stride + 1))
    n = 0
    for y in range(0, h, stride):
        for x in range(0, w, stride):
            B = scene.luma[2 * y, 2 * x]
            if scene.covered_s[2 * y, 2 * x] == 0 and _LIT < B < _BRIGHT and luma[2 * y, 2 * x] <= _CLIPPED:
                shift[n] = (np.float32(chroma[y, x]) - learnt[y, x]) / (B - black)
                n += 1
    if 10 * n < len(shift) or _mostly_near(shift[:n], np.float32(0), _TINT_STEP):
        return np.float32(0)
    t = np.float32(median(shift[:n]))
    return t if abs(t) < _LARGEST_TINT else np.float32(0)
