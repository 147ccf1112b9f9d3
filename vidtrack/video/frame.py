"""One picture of a video: luminance and half-size chroma planes, as decoded."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]


@dataclass(slots=True)
class Frame:
    """A picture and its time.

    index   number of the frame in its source, from 0
    time_s  seconds since the source's first frame, never decreasing
    y       (H, W) luminance
    u, v    ((H+1)//2, (W+1)//2) chroma planes (Cb, Cr), None for a grey source
    full_range  luminance spans 0..255 (JPEG), else 16..235 (video)
    whole   (H, W) of the picture where the planes are the detector's reduction of it; None: they are whole
    """

    index: int
    time_s: float
    y: Image
    u: Image | None = None
    v: Image | None = None
    full_range: bool = False
    whole: tuple[int, int] | None = None

    @classmethod
    def blank(cls, shape: tuple[int, int], coloured: bool) -> Frame:
        """A black frame of shape (H, W)."""
        half = ((shape[0] + 1) // 2, (shape[1] + 1) // 2)
        chroma = np.zeros(half, np.uint8) if coloured else None
        return cls(0, 0.0, np.zeros(shape, np.uint8), chroma, chroma)

    @property
    def shape(self) -> tuple[int, int]:
        """(H, W) of the picture."""
        return self.whole or (self.y.shape[0], self.y.shape[1])

    @property
    def nbytes(self) -> int:
        """Size of the planes; those that are views keep more in memory."""
        return sum(plane.nbytes for plane in (self.y, self.u, self.v) if plane is not None)

    def copy(self) -> Frame:
        """The frame with planes of its own, which keep no decoder's memory."""
        u, v = (None if plane is None else plane.copy() for plane in (self.u, self.v))
        return replace(self, y=self.y.copy(), u=u, v=v)

    def bgr(self) -> Image:
        """(H, W, 3) picture in OpenCV's channel order."""
        luma = self.y if self.full_range else cv2.convertScaleAbs(self.y, alpha=255 / 219, beta=-16 * 255 / 219)
        if self.u is None or self.v is None:
            return np.asarray(cv2.cvtColor(luma, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
        size = (self.y.shape[1], self.y.shape[0])
        gain = 1.0 if self.full_range else 255 / 224
        large = (cv2.resize(plane, size, interpolation=cv2.INTER_LINEAR) for plane in (self.v, self.u))
        chroma = [cv2.convertScaleAbs(plane, alpha=gain, beta=128 - 128 * gain) for plane in large]
        return np.asarray(cv2.cvtColor(cv2.merge([luma, *chroma]), cv2.COLOR_YCrCb2BGR), dtype=np.uint8)
