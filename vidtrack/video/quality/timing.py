"""Regularity of the picture times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Mask
from vidtrack.video.clock import stamp_rate

_GAP = 1.5  # usual intervals; a longer one lacks a picture
_STILL_S = 0.3  # pictures that are all alike for longer show a scene in which nothing moves


@dataclass(frozen=True, slots=True)
class Timing:
    """Statistics of the pictures' times.

    pictures       number of pictures
    rate           pictures per second, without gaps
    jitter         standard deviation of the intervals without gaps, relative to the usual interval
    missing_share  share of pictures missing in gaps
    longest_gap_s  longest interval
    repeated_share share of pictures that repeat the one before
    """

    pictures: int
    rate: float
    jitter: float
    missing_share: float
    longest_gap_s: float
    repeated_share: float


def timing(times: Floats, repeats: Mask) -> Timing:
    """Timing of pictures at times (K,) [s], K >= 2; repeats (J,) of some of them, in order."""
    intervals = np.diff(times)
    rate = stamp_rate(times) or 0.0
    whole = np.maximum(1, np.rint(intervals * rate))
    usual = intervals[intervals * rate < _GAP]
    missing = float((whole - 1)[intervals * rate >= _GAP].sum())
    return Timing(
        pictures=len(times),
        rate=rate,
        jitter=float(usual.std() * rate) if usual.size else 0.0,
        missing_share=missing / (len(times) + missing),
        longest_gap_s=float(intervals.max()),
        repeated_share=_repeated_share(repeats, rate),
    )


def _repeated_share(repeats: Mask, rate: float) -> float:
    """Share of the repeats (J,), without long runs of repeats, which show a still scene."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], repeats, [False]]).astype(int)))
    length = edges[1::2] - edges[::2]
    still = length > max(1.0, _STILL_S * rate)
    moving = len(repeats) - length[still].sum()
    return float(length[~still].sum() / moving) if moving else 0.0
