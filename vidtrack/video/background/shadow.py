"""Soft shadow: the scene seen darker by one factor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vidtrack.compiled import kernel
from vidtrack.video.frame import Image
from vidtrack.video.runs import connect, find_runs

if TYPE_CHECKING:  # the scene needs SHADOW
    from vidtrack.video.background.picture import Picture
    from vidtrack.video.background.scene import Levels, Scene

SHADOW = np.uint8(2)  # value of a hit that is shadow
_DARKEST, _LIGHTEST = np.float32(0.5), np.float32(0.97)  # share of the scene's light
_CHROMA = np.float32(4)  # grey levels by which each chroma plane may miss the factor
_TEXTURE, _TEXTURE_SHARE = np.float32(2), np.float32(0.22)  # grey levels, and share of the scene's light: soft edges
_GREY_SHARE = np.float32(0.05)  # the same where no colour helps to tell shadow from dark paint
_REACH = 1  # px to either side over which luminance differences are taken; farther, they reach out of small shadows
_LEFT, _ABOVE, _RIGHT, _BELOW = np.uint8(1), np.uint8(2), np.uint8(4), np.uint8(8)
_SIDES = np.array([bin(sides).count("1") for sides in range(16)])
_AMID = 3  # sides on which the vehicle is seen from amid it
_LIT = 0.3  # share of a region that is no shadow if there is a vehicle in it
_NEUTRAL = np.float32(128)  # chroma of grey


@kernel(error_model="numpy")
def mark_shadow(picture: Picture, scene: Scene, black: np.float32, hit: Image) -> None:
    """Set hit (h, w) uint8 from 1 to SHADOW where luminance, colour and texture are the scene's, times one factor r.

    r = (Y - black) / (B - black); texture is the luminance differences over +-1 px, across and down.
    """
    row, start, stop = find_runs(hit, False)
    coloured = len(picture.cb) > 0
    share = _TEXTURE_SHARE if coloured else _GREY_SHARE
    for k in range(len(row)):
        y = row[k]
        for x in range(start[k], stop[k]):
            light = scene.luma[y, x] - black
            r = (np.float32(picture.luma[y, x]) - black) / light
            if not _DARKEST <= r < _LIGHTEST or (coloured and not _same_colour(picture, scene, y // 2, x // 2, r)):
                continue
            if _texture_error(picture.luma, scene.luma, y, x, r) < _TEXTURE + share * light:
                hit[y, x] = SHADOW


@kernel(inline="always")
def _same_colour(picture: Picture, scene: Scene, y: int, x: int, r: np.float32) -> bool:
    blue = np.float32(picture.cb[y, x]) - _NEUTRAL - r * (scene.cb[y, x] - _NEUTRAL)
    red = np.float32(picture.cr[y, x]) - _NEUTRAL - r * (scene.cr[y, x] - _NEUTRAL)
    return max(abs(blue), abs(red)) < _CHROMA


@kernel(inline="always")
def _texture_error(luma: Image, scene: Levels, y: int, x: int, r: np.float32) -> np.float32:
    h, w = luma.shape
    up, down, left, right = max(y - _REACH, 0), min(y + _REACH, h - 1), max(x - _REACH, 0), min(x + _REACH, w - 1)
    across = np.float32(luma[y, right]) - np.float32(luma[y, left]) - r * (scene[y, right] - scene[y, left])
    along = np.float32(luma[down, x]) - np.float32(luma[up, x]) - r * (scene[down, x] - scene[up, x])
    return abs(across) + abs(along)


@kernel
def reclaim(hit: Image) -> None:
    """Set hit (h, w) uint8 from SHADOW back to 1 where the vehicle is seen on at least three of four sides.

    Dark paint passes for shadow, but shadow lies beside a vehicle and not amid it. A side shows the vehicle if a line
    of hits leads to a pixel that is not shadow. A region that is nearly all shadow is one: its rest are soft edges.
    """
    row, start, stop = find_runs(hit, False)
    label, count = connect(row, start, stop, 1)
    whole, lit = np.zeros(count), np.zeros(count)
    h = len(hit)
    side = np.zeros(hit.shape, np.uint8)
    for k in range(len(row)):
        y, seen = row[k], False
        whole[label[k]] += stop[k] - start[k]
        for x in range(start[k], stop[k]):
            above = y > 0 and hit[y - 1, x] != 0 and (hit[y - 1, x] == 1 or side[y - 1, x] & _ABOVE != 0)
            side[y, x] = np.uint8(seen) * _LEFT | np.uint8(above) * _ABOVE
            lit[label[k]] += hit[y, x] == 1
            seen |= hit[y, x] == 1
    for k in range(len(row) - 1, -1, -1):
        y, seen = row[k], False
        for x in range(stop[k] - 1, start[k] - 1, -1):
            below = y < h - 1 and hit[y + 1, x] != 0 and (hit[y + 1, x] == 1 or side[y + 1, x] & _BELOW != 0)
            side[y, x] |= np.uint8(seen) * _RIGHT | np.uint8(below) * _BELOW
            seen |= hit[y, x] == 1
    for k in range(len(row)):
        if lit[label[k]] < _LIT * whole[label[k]]:
            continue
        for x in range(start[k], stop[k]):
            if hit[row[k], x] == SHADOW and _SIDES[side[row[k], x]] >= _AMID:
                hit[row[k], x] = 1
