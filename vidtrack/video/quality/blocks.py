"""Compression blocks: steps at every eighth row and column."""

from __future__ import annotations

import numpy as np

from vidtrack.video.frame import Image

_BLOCK = 8  # of JPEG, MPEG and the smallest common transform of their followers


def blockiness(luma: Image) -> float:
    """Mean step across the borders of 8x8 blocks over the mean step elsewhere: 1 without blocks. luma (H, W)."""
    steps = [np.abs(np.diff(plane.astype(np.int16), axis=1)).mean(axis=0) for plane in (luma, luma.T)]
    border = np.concatenate([step[_BLOCK - 1 :: _BLOCK] for step in steps])
    inside = np.concatenate([np.delete(step, slice(_BLOCK - 1, None, _BLOCK)) for step in steps])
    return float((border.mean() + 1.0) / (inside.mean() + 1.0)) if border.size else 1.0
