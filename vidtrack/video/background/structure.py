"""What the picture shows of the scene in another light: its structure (marks, kerbs, grass) and its colour, times r."""

from __future__ import annotations

import numpy as np

from vidtrack.compiled import inlined
from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import Levels, Scene
from vidtrack.video.frame import Image

CHROMA = np.float32(4)  # grey levels by which each chroma plane may miss the factor
STRUCTURE = np.float32(6)  # luminance differences that light and shadow leave and a body hides; fewer tell nothing
SEEN = np.float32(0.5)  # share of the structure by which it may be missed
_REACH = 1  # px to either side over which luminance differences are taken; farther, they reach out of small shadows
_NEUTRAL = np.float32(128)  # chroma of grey


@inlined
def chroma(picture: Picture, scene: Scene, y: int, x: int, r: np.float32) -> tuple[np.float32, np.float32]:
    """Deviation [grey levels] of the colour from the scene's colour times r, and the scene's colour."""
    blue, red = scene.cb[y, x] - _NEUTRAL, scene.cr[y, x] - _NEUTRAL
    off_blue = np.float32(picture.cb[y, x]) - _NEUTRAL - r * blue
    off_red = np.float32(picture.cr[y, x]) - _NEUTRAL - r * red
    return max(abs(off_blue), abs(off_red)), max(abs(blue), abs(red))


@inlined
def texture(luma: Image, scene: Levels, y: int, x: int, r: np.float32) -> tuple[np.float32, np.float32]:
    """Deviation of the luminance differences from the scene's times r, and the scene's differences."""
    h, w = luma.shape
    up, down, left, right = max(y - _REACH, 0), min(y + _REACH, h - 1), max(x - _REACH, 0), min(x + _REACH, w - 1)
    across, along = r * (scene[y, right] - scene[y, left]), r * (scene[down, x] - scene[up, x])
    off_across = np.float32(luma[y, right]) - np.float32(luma[y, left]) - across
    off_along = np.float32(luma[down, x]) - np.float32(luma[up, x]) - along
    return abs(off_across) + abs(off_along), abs(across) + abs(along)
