"""The picture a detector works on: luminance and half-size chroma, reduced by a whole factor where it is large."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.video.frame import Frame, Image

FULL_SIZE_ROWS = 580  # taller pictures are reduced to at most this many rows
VIDEO_BLACK = 16  # luminance of black where it does not span the full range


class Picture(NamedTuple):
    """luma (h, w); cb, cr (ceil(h/2), ceil(w/2)), of zero rows for a grey source."""

    luma: NDArray
    cb: NDArray
    cr: NDArray


NO_CHROMA: Image = np.zeros((0, 0), np.uint8)


def reduction(rows: int, scale: float | None) -> int:
    """Source pixels per processed pixel: 1/scale rounded, or the smallest factor that gets to 580 rows."""
    if scale is not None:
        return max(1, round(1 / scale))
    return max(1, math.ceil(rows / FULL_SIZE_ROWS))


def reduce(frame: Frame, step: int) -> Picture:
    """The frame's planes as area averages of step x step pixels.

    Rows and columns that do not fill a window at the lower and right edge are left out; h and w are then even,
    so that chroma still covers the picture.
    """
    chroma = [NO_CHROMA if plane is None else plane for plane in (frame.u, frame.v)]
    if step == 1:
        return Picture(frame.y, *chroma)
    h, w = (2 * max(1, size // (2 * step)) for size in frame.shape)
    cb, cr = (_area_average(plane, h // 2, w // 2, step) if plane.size else plane for plane in chroma)
    return Picture(_area_average(frame.y, h, w, step), cb, cr)


def smooth(picture: Picture) -> Picture:
    """Each plane weighted 1-2-1 in both directions: sensor noise halves, edges stay."""
    return Picture(*(cv2.GaussianBlur(plane, (3, 3), 0) if plane.size else plane for plane in picture))


def kept(keep: Image | None, shape: tuple[int, ...]) -> Image | None:
    """255 where the picture `keep` (any size) is bright, else 0, at `shape` (h, w)."""
    if keep is None:
        return None
    resized = cv2.resize(keep, (shape[1], shape[0]), interpolation=cv2.INTER_NEAREST)
    return np.where(resized > 127, np.uint8(255), np.uint8(0))


def to_bgr(picture: Picture, shape: tuple[int, int], step: int, full_range: bool) -> Image:
    """The picture in blue, green, red, enlarged to the source size `shape` (H, W)."""
    half = ((shape[0] + 1) // 2, (shape[1] + 1) // 2)
    y, u, v = (
        _enlarge(plane, size, step) if plane.size else None
        for plane, size in zip(picture, (shape, half, half), strict=True)
    )
    assert y is not None
    return Frame(0, 0.0, y, u, v, full_range).bgr()


def _enlarge(plane: NDArray, shape: tuple[int, int], step: int) -> Image:
    """Bilinear enlargement by step; what the reduction left out repeats the last row and column."""
    h, w = plane.shape[0] * step, plane.shape[1] * step
    grown = cv2.resize(plane.astype(np.float32), (w, h), interpolation=cv2.INTER_LINEAR)
    grown = cv2.copyMakeBorder(grown, 0, shape[0] - h, 0, shape[1] - w, cv2.BORDER_REPLICATE)
    return np.clip(np.rint(grown), 0, 255).astype(np.uint8)


def _area_average(plane: Image, h: int, w: int, step: int) -> Image:
    return np.asarray(cv2.resize(plane[: h * step, : w * step], (w, h), interpolation=cv2.INTER_AREA))
