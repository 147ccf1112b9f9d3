"""The processed picture: luminance and half-size chroma, reduced by an integer factor if large."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats
from vidtrack.errors import Error
from vidtrack.video.background.filters import LARGEST_STEP, area_average, smoothed
from vidtrack.video.foreground import Foreground
from vidtrack.video.frame import Frame, Image

FULL_SIZE_ROWS = 500  # taller pictures are reduced to at most this many rows
_FAINT = 2.0  # grey levels of chroma that a codec adds to a picture without colour
_SPOTS = 0.01  # share of a picture without colour that has some: captions
_VIDEO_BLACK = 16  # luminance of black where it does not span the full range


class Picture(NamedTuple):
    """luma (h, w); cb, cr (ceil(h/2), ceil(w/2)), of zero rows for a grey source."""

    luma: NDArray
    cb: NDArray
    cr: NDArray

    def grey(self) -> Picture:
        """The luminance alone."""
        return Picture(self.luma, self.cb[:0], self.cr[:0])


def is_coloured(picture: Picture) -> bool:
    """Whether the picture has colour: a camera without colour, or at night, sends the same chroma everywhere."""
    planes = [plane for plane in (picture.cb, picture.cr) if plane.size]
    return any((np.abs(plane - np.median(plane)) > _FAINT).mean() > _SPOTS for plane in planes)


class View:
    """The reduction of a source for a detector, set by the first frame.

    step   source pixels per processed pixel; small pictures keep at least 2 x 2
    black  luminance of black
    keep   where traffic is looked for; None: everywhere
    """

    STATE = ("_shape", "step", "black")

    def __init__(self, scale: float | None, keep: NDArray | None) -> None:
        """scale: processed over source size, None: by the rows; keep (any size): dark pixels have no foreground."""
        self._scale = scale
        self.keep = keep
        self._shape: tuple[int, int] | None = None
        self.step = 1
        self.black = 0

    @property
    def shape(self) -> tuple[int, int]:
        """(H, W) of the source. Raises Error before the first frame."""
        if self._shape is None:
            raise Error("there is no scene before the first frame; call apply first")
        return self._shape

    @property
    def reduced(self) -> tuple[int, int]:
        """(h, w) of the processed picture. Raises Error before the first frame."""
        return reduced_shape(self.shape, self.step)

    def reduce(self, frame: Frame) -> Picture:
        """The frame's planes as area averages of step x step pixels."""
        if self._shape is None:
            self._shape = frame.shape
            step = reduction(frame.shape[0], self._scale)
            self.step = max(1, min(step, min(frame.shape) // 2, LARGEST_STEP))
            self.black = 0 if frame.full_range else _VIDEO_BLACK
        return reduce(frame, self.step)

    def reduced_frame(self, frame: Frame) -> Frame:
        """The frame with the planes that `reduce` makes of it; itself, if they are its own."""
        picture = self.reduce(frame)
        if self.step == 1 or frame.whole is not None:
            return frame
        u, v = (None if plane is None else small for plane, small in zip((frame.u, frame.v), picture[1:], strict=True))
        return replace(frame, y=picture.luma, u=u, v=v, whole=frame.shape)

    def foreground(
        self, mask: Image, strength: NDArray, place: Floats = affine.IDENTITY, motion: Floats = affine.IDENTITY,
        weak: Image | None = None, warnings: tuple[str, ...] = (), elsewhere: bool = False,
        planes: Picture | None = None, dark: bool = False,
    ) -> Foreground:  # fmt: skip
        """The Foreground of a mask (h, w), 0 and 255, cleared where `keep` is dark, and its strength (h, w).

        place, motion  (2, 3) from the mask to the scene and to the picture [processed px]
        weak, warnings, elsewhere, planes, dark  of the Foreground
        """
        if self.keep is not None:
            h, w = self.reduced
            keep = cv2.resize(self.keep, (w, h), interpolation=cv2.INTER_NEAREST)
            if keep.shape != mask.shape or not affine.is_identity(place):
                back, size = cv2.WARP_INVERSE_MAP | cv2.INTER_NEAREST, (mask.shape[1], mask.shape[0])
                keep = cv2.warpAffine(keep, place, size, flags=back, borderMode=cv2.BORDER_REPLICATE)
            mask = np.where(keep > 127, mask, np.uint8(0))
        views = self._views(place, motion)
        return Foreground(mask, strength, self.step, *views, weak, warnings, elsewhere, dark, planes)

    def _views(self, place: Floats, motion: Floats) -> tuple[Floats | None, Floats | None, Floats]:
        """Maps from mask to scene and from scene to picture, None for the identity, and the picture's left, top, right,
        bottom (4,) in the scene; all in source px.
        """
        h, w = (side * self.step for side in self.reduced)
        if affine.is_identity(place) and affine.is_identity(motion):
            return None, None, np.array([0.0, 0.0, w, h])
        to_scene = affine.rescaled(place, float(self.step))
        to_picture = affine.after(affine.rescaled(motion, float(self.step)), affine.inverse(to_scene))
        upper_left, upper_right, lower_left, lower_right = (
            affine.points(affine.inverse(to_picture), np.array([[0, 0], [w, 0], [0, h], [w, h]]) - 0.5) + 0.5
        )
        inside = (
            max(upper_left[0], lower_left[0]), max(upper_left[1], upper_right[1]),
            min(upper_right[0], lower_right[0]), min(lower_left[1], lower_right[1]),
        )  # fmt: skip
        return to_scene, to_picture, np.array(inside)

    def enlarge(self, picture: Picture) -> Image:
        """(H, W, 3) the picture in blue, green, red at source size. Raises Error before the first frame."""
        h, w = self.shape
        half = ((h + 1) // 2, (w + 1) // 2)
        y = _enlarge(picture.luma, (h, w), self.step)
        u, v = (_enlarge(plane, half, self.step) if plane.size else None for plane in (picture.cb, picture.cr))
        return Frame(0, 0.0, y, u, v, full_range=self.black == 0).bgr()


def reduction(rows: int, scale: float | None) -> int:
    """Source pixels per processed pixel: 1/scale rounded, or the smallest factor for at most 500 rows."""
    if scale is not None:
        return max(1, round(1 / scale))
    return max(1, math.ceil(rows / FULL_SIZE_ROWS))


def reduced_shape(shape: tuple[int, int], step: int) -> tuple[int, int]:
    """(h, w) of a picture (H, W) after a reduction by step; even if step > 1."""
    if step == 1:
        return shape
    return 2 * (shape[0] // (2 * step)), 2 * (shape[1] // (2 * step))


def reduce(frame: Frame, step: int) -> Picture:
    """The frame's planes as area averages of step x step pixels.

    Rows and columns that do not fill a window at the lower and right edge are left out; h and w are then even,
    so that chroma still covers the picture. The frame has at least 2 step rows and columns, or is reduced already.
    """
    cb, cr = (np.empty((0, 0), np.uint8) if plane is None else plane for plane in (frame.u, frame.v))
    if step == 1 or frame.whole is not None:
        return Picture(frame.y, cb, cr)
    h, w = reduced_shape(frame.shape, step)
    half = (h // 2, w // 2)
    cb, cr = (area_average(plane, half, step) if plane.size else plane for plane in (cb, cr))
    return Picture(area_average(frame.y, (h, w), step), cb, cr)


def smooth(picture: Picture) -> Picture:
    """Each plane weighted 1-2-1 in both directions, against sensor noise."""
    return Picture(*(smoothed(plane) if plane.size else plane for plane in picture))


def _enlarge(plane: NDArray, shape: tuple[int, int], step: int) -> Image:
    """Bilinear enlargement by step; the last row and column repeat where the reduction left out pixels."""
    h, w = plane.shape[0] * step, plane.shape[1] * step
    grown = cv2.resize(plane.astype(np.float32), (w, h), interpolation=cv2.INTER_LINEAR)
    missing = max(0, shape[0] - h), max(0, shape[1] - w)
    grown = cv2.copyMakeBorder(grown, 0, missing[0], 0, missing[1], cv2.BORDER_REPLICATE)[: shape[0], : shape[1]]
    return np.clip(np.rint(grown), 0, 255).astype(np.uint8)
