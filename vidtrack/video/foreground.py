"""The output of a detector: where the picture differs from the scene, and by how much."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vidtrack.scan import Floats
from vidtrack.video.frame import Frame, Image


@dataclass(frozen=True, slots=True)
class Foreground:
    """Foreground of one frame at the processed size.

    mask      (h, w) 0 background, 255 foreground
    strength  (h, w) disturbance in units of its threshold (1 is just detected)
    step      source pixels per mask pixel
    """

    mask: Image
    strength: NDArray
    step: int

    def full_size(self, shape: tuple[int, int]) -> Image:
        """(H, W) mask of the source, 0 and 255; where the reduction left out rows or columns the last is repeated."""
        mask = self.mask.repeat(self.step, axis=0).repeat(self.step, axis=1)
        rows, columns = (max(0, size - found) for size, found in zip(shape, mask.shape, strict=True))
        return np.pad(mask, ((0, rows), (0, columns)), mode="edge")[: shape[0], : shape[1]]


class Background(Protocol):
    """A model of the scene without traffic."""

    def apply(self, frame: Frame, known: Floats) -> Foreground:
        """Foreground of `frame`; what covers a `known` box is never absorbed into the scene, however long it stands.

        known (K, 4): left, top, width, height [source px] of vehicles the tracker predicts here.
        """

    def scene(self) -> Image:
        """(H, W, 3) the learnt scene in source size, blue-green-red."""
