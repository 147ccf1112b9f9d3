"""Light that returns, as when a cloud moves on: the scene is seen in more light in a large part of the picture.

The reverse of a shadow. A pale vehicle is brighter than the scene, too, but it hides the scene's structure.
"""

from __future__ import annotations

import numpy as np

from vidtrack.compiled import inlined, kernel
from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import Levels, Scene
from vidtrack.video.background.shadow import HARD
from vidtrack.video.background.structure import CHROMA, SEEN, STRUCTURE, chroma, texture
from vidtrack.video.frame import Image
from vidtrack.video.runs import CORNERS, OBJECTS, connect, find_runs

_LARGE, _SMALL = 0.02, 0.001  # shares of the picture: of a region with which light returns, and while it does
_RETURNING_S = 10.0  # after the last large region; the edge of a cloud's shadow crosses the scene within seconds
_LEAST = np.float32(1.03)  # times the scene's light, from which on it is more
_BRIGHTER = 0.5  # share of a region that has more light
_FEW, _SHARE = 30, 0.5  # pixels with structure and more light; share of them in which the structure is seen
_MOST = 1.6  # times the mean light of these; what is brighter is a body


class Relight:
    """Follows returning light: it begins with a large region, and small ones are left over."""

    STATE = ("_since_s",)

    def __init__(self) -> None:
        self._since_s = np.inf

    def follow(self, picture: Picture, scene: Scene, black: Levels, hit: Image, weak: Image, dt: float) -> None:
        """Bring the scene to the light of a picture, dt [s] after the last one, as `relight` does."""
        self._since_s += dt
        least = (_SMALL if self._since_s < _RETURNING_S else _LARGE) * hit.size
        if np.count_nonzero(hit) >= least and relight(picture, scene, black, hit, weak, least) >= _LARGE * hit.size:
            self._since_s = 0.0


@kernel
def relight(picture: Picture, scene: Scene, black: Levels, hit: Image, weak: Image, least: float) -> int:
    """Where regions of `least` pixels are in more light, replace the scene by the picture and set hit and weak (h, w)
    from 1 to 0. Returns the pixels of the largest.

    What is no brighter scene in such a region is a vehicle: the scene behind it becomes brighter by the mean factor of
    the region's pixels in its row, or of all.
    """
    row, start, stop = find_runs(hit, OBJECTS)
    label, count = connect(row, start, stop, CORNERS)
    whole, brighter, structured, seen, mean = np.zeros((5, count))
    for k in range(len(row)):
        y, region = row[k], label[k]
        for x in range(start[k], stop[k]):
            if hit[y, x] != 1:
                continue
            whole[region] += 1
            r = _factor(picture, scene, black, y, x)
            if not r > _LEAST:
                continue
            brighter[region] += 1
            missed, structure = texture(picture.luma, scene.luma, y, x, r)
            if structure > STRUCTURE:
                structured[region] += 1
                if missed < SEEN * structure:
                    seen[region] += 1
                    mean[region] += r
    lit, largest = np.zeros(count, np.bool_), 0
    for i in range(count):
        wide = whole[i] >= least and brighter[i] >= _BRIGHTER * whole[i]
        lit[i] = wide and structured[i] >= _FEW and seen[i] >= _SHARE * structured[i]
        if lit[i]:
            largest = max(largest, int(whole[i]))
            mean[i] /= seen[i]
    if largest == 0:
        return largest
    factor = np.zeros(hit.shape, np.float32)  # of brighter scene
    for k in range(len(row)):
        y, region = row[k], label[k]
        if lit[region]:
            for x in range(start[k], stop[k]):
                r = _factor(picture, scene, black, y, x)
                if hit[y, x] == 1 and r < _MOST * mean[region] and _is_scene(picture, scene, y, x, r, black[y, x]):
                    factor[y, x] = r
    for k in range(len(row)):
        y, region = row[k], label[k]
        if not lit[region]:
            continue
        total, pixels = np.float32(0), 0
        for x in range(start[k], stop[k]):
            total += factor[y, x]
            pixels += factor[y, x] > 0
        usual = total / np.float32(pixels) if pixels > 0 else np.float32(mean[region])
        for x in range(start[k], stop[k]):
            if factor[y, x] > 0:
                scene.luma[y, x] = picture.luma[y, x]
                scene.covered_s[y, x] = np.float32(0)
                hit[y, x] = weak[y, x] = 0
                if len(picture.cb) > 0:
                    scene.cb[y // 2, x // 2] = picture.cb[y // 2, x // 2]
                    scene.cr[y // 2, x // 2] = picture.cr[y // 2, x // 2]
            elif hit[y, x] == 1:
                scene.luma[y, x] = black[y, x] + usual * (scene.luma[y, x] - black[y, x])
    return largest


@inlined
def _factor(picture: Picture, scene: Scene, black: Levels, y: int, x: int) -> np.float32:
    """The light, in that of the scene, above black."""
    light = scene.luma[y, x] - black[y, x]
    return (np.float32(picture.luma[y, x]) - black[y, x]) / max(light, np.float32(1))


@inlined
def _is_scene(picture: Picture, scene: Scene, y: int, x: int, r: np.float32, black: np.float32) -> bool:
    """Whether luminance, colour and texture are the scene's in r times as much light, which is more."""
    missed, _ = texture(picture.luma, scene.luma, y, x, r)
    off, tint = np.float32(0), np.float32(0)
    if len(picture.cb) > 0:
        off, tint = chroma(picture, scene, y // 2, x // 2, r)
    light = r * (scene.luma[y, x] - black)
    coloured_alike = off < CHROMA + HARD.chroma_share * r * tint
    return bool(r > _LEAST and coloured_alike and missed < HARD.texture + HARD.texture_share * light)
