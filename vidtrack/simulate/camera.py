"""The camera: scale, shake, exposure and sensor noise."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints

NOISE_MARGIN = 64


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """How scene coordinates become a picture.

    size    (width, height) px of the picture
    scale   (2,) picture pixels per scene pixel in x and y
    shake   (K, 2) displacement of each frame, picture px
    gain    (K,) exposure of each frame
    noise   (H + margin, W + margin, 3) grey levels; each frame adds a window of it
    window  (K, 2) row and column of that window
    """

    size: tuple[int, int]
    scale: Floats
    shake: Floats
    gain: Floats
    noise: NDArray[np.int16]
    window: Ints

    @property
    def margin(self) -> int:
        """px that a background must have beyond every edge of the picture."""
        return int(np.ceil(np.abs(self.shake).max()))

    def framed(self, ground: NDArray[np.uint8], k: int) -> NDArray[np.uint8]:
        """What frame k shows of a background that is larger by `margin` on every side; a copy."""
        if self.margin == 0:
            return ground.copy()
        dx, dy = self.shake[k] - self.margin
        shift = np.array([[1, 0, dx], [0, 1, dy]])
        return np.asarray(cv2.warpAffine(ground, shift, self.size, borderMode=cv2.BORDER_REPLICATE))

    def exposed(self, picture: NDArray[np.uint8], k: int) -> NDArray[np.uint8]:
        """The picture as frame k's exposure and the sensor's noise leave it."""
        if self.gain[k] != 1:
            picture = np.asarray(cv2.convertScaleAbs(picture, alpha=self.gain[k]), dtype=np.uint8)
        row, col = self.window[k]
        noise = self.noise[row : row + self.size[1], col : col + self.size[0]]
        return np.asarray(cv2.add(picture, noise, dtype=cv2.CV_8U), dtype=np.uint8)


def camera(
    scene_size: tuple[int, int],
    size: tuple[int, int],
    times: Floats,
    rng: Generator,
    *,
    noise: float,
    shake: float,
    light_steps: int,
) -> Camera:
    """A camera for frames at `times` (K,) [s].

    noise        standard deviation of each channel of each pixel, grey levels
    shake        standard deviation of the displacement in x and in y, picture px
    light_steps  sudden changes of the exposure in the whole clip
    """
    shake_rng, light_rng, noise_rng = rng.spawn(3)
    shape = (size[1] + NOISE_MARGIN, size[0] + NOISE_MARGIN, 3)
    grain = np.rint(noise * noise_rng.standard_normal(shape, dtype=np.float32)).astype(np.int16)
    return Camera(
        size=size,
        scale=np.array(size) / np.array(scene_size),
        shake=shake * _tremor(times, shake_rng),
        gain=_exposure(times, light_steps, light_rng),
        noise=grain,
        window=noise_rng.integers(0, NOISE_MARGIN + 1, (len(times), 2)),
    )


def _tremor(times: Floats, rng: Generator, waves: int = 8) -> Floats:
    """(K, 2) displacement of a mast in the wind with unit standard deviation: sines of 0.4 to 5 Hz."""
    f, phase = rng.uniform(0.4, 5, (waves, 2)), rng.uniform(0, 2 * np.pi, (waves, 2))
    return np.sqrt(2 / waves) * np.sin(2 * np.pi * f * times[:, None, None] + phase).sum(axis=1)


def _exposure(times: Floats, steps: int, rng: Generator) -> Floats:
    """(K,) gain: one at first, then darker or brighter by 15 to 30 %, then back, at times spread over the clip."""
    span = times[-1] - times[0]
    at = times[0] + span * (np.arange(steps) + rng.uniform(0.35, 0.65, steps)) / max(steps, 1)
    changed = 1 + rng.choice([-1.0, 1.0], steps) * rng.uniform(0.15, 0.30, steps)
    levels = np.concatenate([[1.0], np.where(np.arange(steps) % 2 == 0, changed, 1.0)])
    return levels[np.searchsorted(at, times, side="right")]
