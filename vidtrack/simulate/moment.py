"""One frame while it is drawn: when it is, and where everything is in the picture."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats
from vidtrack.simulate import draw
from vidtrack.simulate.draw import Image, Sprite
from vidtrack.simulate.scene import Actor

Canvas = Image


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """An actor in the picture: its sprite, the affine map (2, 3) from body to picture, its outline (V, 2)."""

    actor: Actor
    sprite: Sprite
    to_picture: Floats
    corners: Floats

    def to_body(self, points: Floats) -> Floats:
        """Points (..., 2) of the picture in the actor's own frame."""
        return draw.apply(np.asarray(cv2.invertAffineTransform(self.to_picture), float), points)


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """A frame at its time, for a camera with `scale` (picture px per scene px) and displacement `shake` (2,) [px].

    placed  from the farthest to the nearest
    """

    frame: int
    time_s: float
    scale: float
    shake: Floats
    placed: tuple[Placed, ...]


def pixel_centres(rows: slice, cols: slice) -> Floats:
    """(h, w, 2) x and y of the pixels of a window."""
    x, y = np.arange(cols.start, cols.stop) + 0.5, np.arange(rows.start, rows.stop) + 0.5
    return np.stack(np.meshgrid(x, y), axis=-1)


def rounded(light: NDArray) -> Canvas:
    """Light levels as a picture."""
    return np.clip(np.rint(light), 0, 255).astype(np.uint8)
