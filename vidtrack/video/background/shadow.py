"""Soft shadow: the scene seen darker by one factor."""

from __future__ import annotations

import numba
import numpy as np

SHADOW = 2  # value of a hit that is shadow
_DARKEST, _LIGHTEST = np.float32(0.5), np.float32(0.97)  # share of the scene's light
_CHROMA = np.float32(6)  # grey levels by which each chroma plane may miss the factor
_TEXTURE, _TEXTURE_SHARE = np.float32(2), np.float32(0.08)  # grey levels, and share of the scene's light
_REACH = 2  # px to either side over which luminance differences are taken
_NEUTRAL = np.float32(128)  # chroma of grey


@numba.njit(cache=True, nogil=True, error_model="numpy")
def mark_shadow(picture, scene, black, hit):  # type: ignore[no-untyped-def]
    """Set hit (h, w) uint8 from 1 to SHADOW where luminance, chroma and texture are the scene's, times one factor.

    The factor is r = (Y - black) / (B - black). Texture is the luminance differences over +-2 px, across and down.
    """
    h, w = hit.shape
    coloured = len(picture.cb) > 0
    luma = picture.luma
    for y in range(h):
        up, down = max(y - _REACH, 0), min(y + _REACH, h - 1)
        for x in range(w):
            if hit[y, x] == 0:
                continue
            light = scene.luma[y, x] - black
            r = (np.float32(luma[y, x]) - black) / light
            if not _DARKEST <= r < _LIGHTEST:
                continue
            if coloured and not _same_colour(picture, scene, y // 2, x // 2, r):
                continue
            left, right = max(x - _REACH, 0), min(x + _REACH, w - 1)
            across = np.float32(luma[y, right]) - np.float32(luma[y, left])
            across -= r * (scene.luma[y, right] - scene.luma[y, left])
            along = np.float32(luma[down, x]) - np.float32(luma[up, x])
            along -= r * (scene.luma[down, x] - scene.luma[up, x])
            if abs(across) + abs(along) < _TEXTURE + _TEXTURE_SHARE * light:
                hit[y, x] = SHADOW


@numba.njit(cache=True, nogil=True)
def _same_colour(picture, scene, y, x, r):  # type: ignore[no-untyped-def]
    blue = np.float32(picture.cb[y, x]) - _NEUTRAL - r * (scene.cb[y, x] - _NEUTRAL)
    red = np.float32(picture.cr[y, x]) - _NEUTRAL - r * (scene.cr[y, x] - _NEUTRAL)
    return max(abs(blue), abs(red)) < _CHROMA
