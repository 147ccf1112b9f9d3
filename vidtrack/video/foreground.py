"""The output of a detector: the foreground mask and the strength of the difference from the scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats
from vidtrack.video.frame import Frame, Image


@dataclass(slots=True)
class Foreground:
    """Foreground of one frame at the processed size.

    mask      (h, w) 0 background, 255 foreground
    strength  (h, w) disturbance in units of its threshold (1 is just detected)
    step      source pixels per mask pixel
    weak      (h, w) the mask with lower thresholds, which links pieces of one vehicle; None: not computed
    place     (2, 3) from the mask, enlarged by `step`, to the scene [source px]; None: identity
    motion    (2, 3) from the scene to the picture [source px]; None: identity, the camera has not moved
    warnings  new warnings for the user
    elsewhere whether the camera has changed its view, and the scene has been replaced
    surveyed  (4,) left, top, right, bottom of the area in view [source px of the scene]; None: not known
    dark      whether lamps light the scene, so that vehicles show what is lit
    planes    luminance (h, w) and chroma of half its size, or of zero rows, in which the mask was found; None: not kept
    """

    mask: Image
    strength: NDArray
    step: int
    place: Floats | None = None
    motion: Floats | None = None
    surveyed: Floats | None = None
    weak: Image | None = None
    warnings: tuple[str, ...] = ()
    elsewhere: bool = False
    dark: bool = False
    planes: tuple[NDArray, NDArray, NDArray] | None = None

    def reduced(self, shape: tuple[int, int]) -> Image:
        """(h, w) the mask in the coordinates of a processed picture of this shape."""
        if self.place is None or self.motion is None:
            return self.mask
        to_picture = affine.rescaled(affine.after(self.motion, self.place), 1 / self.step)
        return _warped(self.mask, to_picture, shape)

    def full_size(self, shape: tuple[int, int]) -> Image:
        """(H, W) mask at source size, 0 and 255; rows and columns that the reduction left out repeat the last."""
        if self.place is not None and self.motion is not None:
            to_picture = affine.after(affine.after(self.motion, self.place), enlargement(self.step))
            return _warped(self.mask, to_picture, shape)
        mask = self.mask.repeat(self.step, axis=0).repeat(self.step, axis=1)
        rows, columns = (max(0, size - found) for size, found in zip(shape, mask.shape, strict=True))
        return np.pad(mask, ((0, rows), (0, columns)), mode="edge")[: shape[0], : shape[1]]


def enlargement(step: int) -> Floats:
    """Affine map (2, 3) from processed pixels to source pixels."""
    return np.array([[step, 0, (step - 1) / 2], [0, step, (step - 1) / 2]])


def _warped(mask: Image, to_picture: Floats, shape: tuple[int, int]) -> Image:
    size = (shape[1], shape[0])
    return np.asarray(cv2.warpAffine(mask, to_picture, size, flags=cv2.INTER_NEAREST), np.uint8)


class Background(Protocol):
    """A model of the scene without traffic."""

    def apply(self, frame: Frame, known: Floats) -> Foreground:
        """Foreground of `frame`; pixels in `known` boxes are never absorbed into the scene.

        known (K, 4): left, top, width, height [source px of the scene] of predicted vehicles.
        """

    def keep(self, mask: Image | None) -> None:
        """Find no foreground where a mask (h, w) of any size is dark, from the next frame on; None: find all."""

    def scene(self) -> Image:
        """(H, W, 3) the learnt scene in coordinates of the first picture, in source size, blue-green-red."""
