"""Brightness, clipping and noise of a fixed view."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vidtrack.video.quality.samples import Samples

_NEAR = 2  # grey levels; as close to black or white is clipped
_LEVELS = 255.0


@dataclass(frozen=True, slots=True)
class Light:
    """Brightness and noise; levels are scaled from 0 (black) to 255 (white).

    brightness    mean level
    bright        95th percentile of the level
    black_share, white_share   shares of the picture that are clipped
    noise         standard deviation of a still pixel from picture to picture, in levels of the source
    """

    brightness: float
    bright: float
    black_share: float
    white_share: float
    noise: float


def light(samples: Samples) -> Light:
    """Light of pictures with a fixed view."""
    luma, black, white = samples.luma, samples.black, samples.white
    level = np.clip((luma.astype(np.float32) - black) * (_LEVELS / (white - black)), 0, _LEVELS)
    return Light(
        brightness=float(level.mean()),
        bright=float(np.percentile(level, 95)),
        black_share=float((luma <= black + _NEAR).mean()),
        white_share=float((luma >= white - _NEAR).mean()),
        noise=_noise(samples),
    )


def _noise(samples: Samples) -> float:
    """Median over the pixels of sqrt(pi)/2 E|difference|, which is sigma if the noise is Gaussian.

    A row's median difference counts as light. Repeated pictures and clipped pixels are left out.
    """
    luma = samples.luma.astype(np.int16)
    change = np.diff(luma, axis=0)[~samples.repeats[1:]]
    mean = luma.mean(axis=0)
    free = (mean > samples.black + 2 * _NEAR) & (mean < samples.white - 2 * _NEAR)
    if not len(change) or not free.any():
        return 0.0
    change = change - np.median(change, axis=2, keepdims=True)
    return float(math.sqrt(math.pi) / 2 * np.median(np.abs(change).mean(axis=0)[free]))
