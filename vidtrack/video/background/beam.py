"""Beams of headlamps at night: the scene brightened by a factor that changes slowly from place to place."""

from __future__ import annotations

import numpy as np

from vidtrack.compiled import inlined, kernel
from vidtrack.video.background.scene import BEAM, Levels
from vidtrack.video.frame import Image
from vidtrack.video.runs import OBJECTS, SIDES, connect, find_runs

_DARK = 45.0  # grey levels above black of half the scene; by day lamps do not light it
_LAMP = 100.0  # grey levels above black; a brighter pixel of a dark scene is a lamp
_EVERY = 4  # px; so many are looked at, across and down
_LIFT = np.float32(6)  # grey levels; added to both luminances, for the noise of dark pixels
_SOFT = np.float32(0.2)  # change of the logarithm of the factor over two pixels; at edges of bodies it is larger
_OPEN = 4  # least number of pixels over which a beam fades into the scene


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
def mark_beams(luma: Image, scene: Levels, black: np.float32, hit: Image) -> None:
    """Set hit (h, w) uint8 from 1 to BEAM where lamps light the scene.

    There the luminance is more than the scene's, the factor log((Y - black) / (B - black)) changes slowly, and this
    region is open to pixels with hit 0: a beam fades, but a body ends at an edge.
    """
    h, w = hit.shape
    factor = np.log(
        np.maximum(luma.astype(np.float32) - black, np.float32(0)) + _LIFT
    ) - np.log(np.maximum(scene - black, np.float32(0)) + _LIFT)  # fmt: skip
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
            soft[y, x] = hit[y, x] == 1 and factor[y, x] > 0 and max(abs(across), abs(along)) < _SOFT
    row, start, stop = find_runs(soft, OBJECTS)
    label, count = connect(row, start, stop, SIDES)
    fading = np.zeros(count, np.int64)
    for k in range(len(row)):
        y = row[k]
        up, down = max(y - 1, 0), min(y + 1, h - 1)
        for x in range(start[k], stop[k]):
            left, right = max(x - 1, 0), min(x + 1, w - 1)
            fading[label[k]] += hit[up, x] == 0 or hit[down, x] == 0 or hit[y, left] == 0 or hit[y, right] == 0
    for k in range(len(row)):
        if fading[label[k]] >= _OPEN:
            hit[row[k], start[k] : stop[k]] = BEAM


@inlined
def _blur(before: np.float32, middle: np.float32, after: np.float32) -> np.float32:
    return np.float32(0.25) * before + np.float32(0.5) * middle + np.float32(0.25) * after
