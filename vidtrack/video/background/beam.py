"""Beams of headlamps at night: the scene brightened by a factor that changes slowly from place to place."""

from __future__ import annotations

import numpy as np

from vidtrack.compiled import inlined, kernel
from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import BEAM, Levels, Scene
from vidtrack.video.frame import Image
from vidtrack.video.runs import OBJECTS, SIDES, connect, find_runs

_DARK = 35.0  # grey levels above black of half the scene; at dusk, at 40, a grey roof rises as softly as a beam
_LAMP = 100.0  # grey levels above black; a brighter pixel of a dark scene is a lamp
_EVERY = 4  # px; so many are looked at, across and down
_LIFT = np.float32(6)  # grey levels; added to both luminances, for the noise of dark pixels
_SOFT = np.float32(0.2)  # change of the logarithm of the factor over two pixels; at edges of bodies it is larger
_TINT = np.float32(6)  # grey levels by which the colour may differ from the scene's
_HUE = np.float32(0.2)  # the same as a share of the light: 0.13 is that of a halogen lamp by daylight
_OPEN, _SHARE = 4, 0.1  # pixels, and share of its rim, over which a beam fades into the scene, at least


def is_dark(scene: Levels, black: np.float32) -> bool:
    """Whether the scene (h, w) is so dark that lamps light it."""
    return bool(_mostly_below(scene, black + np.float32(_DARK)))


def shows_lamps(luma: Image, black: np.float32) -> bool:
    """Whether lamps are seen in the picture (h, w) of a dark scene."""
    return bool(luma.max() > black + _LAMP)


@kernel
def _mostly_below(scene: Levels, limit: np.float32) -> bool:
    """Whether most of the scene (h, w) is below a limit."""
    h, w = scene.shape
    dark = looked_at = 0
    for y in range(0, h, _EVERY):
        for x in range(0, w, _EVERY):
            looked_at += 1
            dark += scene[y, x] < limit
    return 2 * dark > looked_at


@kernel
def mark_beams(picture: Picture, scene: Scene, black: np.float32, hit: Image) -> None:
    """Set hit (h, w) uint8 from 1 to BEAM where lamps light the scene.

    There the luminance is more than the scene's, the factor log((Y - black) / (B - black)) changes slowly, the colour
    is nearly the scene's, and a part of the rim is open to pixels with hit 0: a beam fades, a body ends at an edge.
    """
    h, w = hit.shape
    coloured = len(picture.cb) > 0
    light = np.maximum(picture.luma.astype(np.float32) - black, np.float32(0))
    factor = np.log(light + _LIFT) - np.log(np.maximum(scene.luma - black, np.float32(0)) + _LIFT)
    soft = np.zeros(hit.shape, np.uint8)
    row, start, stop = find_runs(hit, OBJECTS)
    for k in range(len(row)):
        y = row[k]
        up, down = max(y - 1, 0), min(y + 1, h - 1)
        for x in range(start[k], stop[k]):
            left, right = max(x - 1, 0), min(x + 1, w - 1)
            across = _blur(factor[up, right], factor[y, right], factor[down, right]) - _blur(
                factor[up, left], factor[y, left], factor[down, left]
            )
            along = _blur(factor[down, left], factor[down, x], factor[down, right]) - _blur(
                factor[up, left], factor[up, x], factor[up, right]
            )
            if hit[y, x] == 1 and factor[y, x] > 0 and max(abs(across), abs(along)) < _SOFT:
                limit = max(_TINT, _HUE * light[y, x])
                soft[y, x] = not coloured or _colour(picture, scene, y // 2, x // 2) < limit
    row, start, stop = find_runs(soft, OBJECTS)
    label, count = connect(row, start, stop, SIDES)
    fading, rim = np.zeros(count, np.int64), np.zeros(count, np.int64)
    for k in range(len(row)):
        y = row[k]
        up, down = max(y - 1, 0), min(y + 1, h - 1)
        for x in range(start[k], stop[k]):
            left, right = max(x - 1, 0), min(x + 1, w - 1)
            rim[label[k]] += not (soft[up, x] and soft[down, x] and soft[y, left] and soft[y, right])
            fading[label[k]] += hit[up, x] == 0 or hit[down, x] == 0 or hit[y, left] == 0 or hit[y, right] == 0
    for k in range(len(row)):
        if fading[label[k]] >= max(_OPEN, _SHARE * rim[label[k]]):
            hit[row[k], start[k] : stop[k]] = BEAM


@inlined
def _colour(picture: Picture, scene: Scene, y: int, x: int) -> np.float32:
    """Deviation [grey levels] of the colour from the scene's."""
    blue, red = np.float32(picture.cb[y, x]) - scene.cb[y, x], np.float32(picture.cr[y, x]) - scene.cr[y, x]
    return max(abs(blue), abs(red))


@inlined
def _blur(before: np.float32, middle: np.float32, after: np.float32) -> np.float32:
    return np.float32(0.25) * before + np.float32(0.5) * middle + np.float32(0.25) * after
