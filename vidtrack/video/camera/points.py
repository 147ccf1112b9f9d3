"""Points for registration: places of steep gradient, spread over the scene."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from vidtrack.arrays.types import Ints
from vidtrack.compiled import kernel
from vidtrack.video.background.scene import UNKNOWN, Levels, Scene
from vidtrack.video.frame import Image

CELLS = ((32, 24), (24, 18), (16, 12))
"""Columns and rows of cells at full, half and quarter size; each cell gives two points."""
_STEEP = np.float32(1.5)  # grey levels per pixel; flatter cells give none
_SMALLEST = 32  # px; smaller pictures have no cells
_REACH = 2  # px around a point that must be known


class Points(NamedTuple):
    """N points of the canvas; places and gradients are in pixels of full size at all levels.

    x, y    (N,)
    value   (N,) luminance of the scene
    gx, gy  (N,) its gradient
    start   (L + 1,) the points of level k are start[k]..start[k + 1], full size first
    """

    x: Levels
    y: Levels
    value: Levels
    gx: Levels
    gy: Levels
    start: Ints


def no_points() -> Points:
    """No points."""
    x, y, value, gx, gy = np.empty((5, 0), np.float32)
    return Points(x, y, value, gx, gy, np.zeros(len(CELLS) + 1, np.int64))


def choose(scene: Scene) -> Points:
    """The steepest places of a scene that are known and free of traffic."""
    if min(scene.luma.shape) < _SMALLEST:
        return no_points()
    luma, usable = scene.luma, ((scene.noise < UNKNOWN) & (scene.covered_s == 0)).astype(np.uint8)
    found, start = [], [0]
    for level, (columns, rows) in enumerate(CELLS):
        if level:
            size = (luma.shape[1] // 2, luma.shape[0] // 2)
            inside = (slice(2 * size[1]), slice(2 * size[0]))
            luma = np.asarray(cv2.resize(luma[inside], size, interpolation=cv2.INTER_AREA), np.float32)
            usable = np.asarray(cv2.erode(usable[inside], np.ones((2, 2), np.uint8), anchor=(0, 0)))[::2, ::2]
        near = np.ones(2 * (2 * _REACH + 1,), np.uint8)
        known = np.asarray(cv2.erode(usable, near, borderType=cv2.BORDER_CONSTANT, borderValue=0), np.uint8)
        found.append(_steepest(luma, known, columns, rows, np.float32(2**level)))
        start.append(start[-1] + found[-1].shape[1])
    x, y, value, gx, gy = np.concatenate(found, axis=1)
    return Points(x, y, value, gx, gy, np.array(start, np.int64))


def shifted(points: Points, x: float, y: float) -> Points:
    """The points after a shift of the canvas's origin by (x, y)."""
    return points._replace(x=points.x + np.float32(x), y=points.y + np.float32(y))


@kernel
def _steepest(luma: Levels, usable: Image, columns: int, rows: int, size: np.float32) -> Levels:
    """(5, N) x, y, value, gx, gy in pixels of full size: the steepest pixel of each cell, horizontally and vertically.

    luma, usable (h, w); size: pixels of full size per pixel.
    """
    h, w = luma.shape
    found = np.empty((5, 2 * columns * rows), np.float32)
    n = 0
    half = np.float32(0.5)
    for j in range(rows):
        for i in range(columns):
            best = np.full(2, _STEEP)
            place = np.full((2, 2), -1)
            for y in range(max(j * h // rows, 1), min((j + 1) * h // rows, h - 1)):
                for x in range(max(i * w // columns, 1), min((i + 1) * w // columns, w - 1)):
                    if not usable[y, x]:
                        continue
                    across = abs(luma[y, x + 1] - luma[y, x - 1]) * half
                    down = abs(luma[y + 1, x] - luma[y - 1, x]) * half
                    if across > best[0]:
                        best[0], place[0, 0], place[0, 1] = across, x, y
                    if down > best[1]:
                        best[1], place[1, 0], place[1, 1] = down, x, y
            for k in range(2):
                x, y = place[k]
                if x < 0:
                    continue
                found[0, n], found[1, n] = (x + half) * size - half, (y + half) * size - half
                found[2, n] = luma[y, x]
                found[3, n] = (luma[y, x + 1] - luma[y, x - 1]) * half / size
                found[4, n] = (luma[y + 1, x] - luma[y - 1, x]) * half / size
                n += 1
    return found[:, :n]
