"""What a detector hands on: where the picture differs from the scene, and by how much."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

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


class Background(Protocol):
    """A model of the scene without traffic."""

    def apply(self, frame: Frame, known: Floats) -> Foreground:
        """Foreground of `frame`; the scene is not learnt inside the `known` boxes.

        known (K, 4): left, top, width, height [source px] of vehicles the tracker predicts here.
        """

    def scene(self) -> Image:
        """(H, W, 3) the learnt scene in source size, blue-green-red."""
