"""Sizes at which so many things appear that they are no traffic: flakes, drops, insects."""

from __future__ import annotations

import math

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.tracking.boxes import longer
from vidtrack.tracks import Tracks

_SWARM_PER_S = 30.0  # births in the whole picture, more than traffic has anywhere
_FEW_PER_S = 12.0  # with a swarm, larger ones that may be traffic
_FORGET_S = 10.0
_AT_ONCE = 30  # births of one scan that count: the picture may change all at once
_LEAST_PX, _STEPS, _BINS = 1.0, 4, 48  # sizes from 1 px to 4096 px, four bins to a factor of two


class Swarm:
    """Births of tracks by size, forgotten within ten seconds.

    births  (48,) remembered births, by the logarithm of the longer side
    """

    STATE = ("births", "_time_s")

    def __init__(self) -> None:
        self.births: Floats = np.zeros(_BINS)
        self._time_s = 0.0

    @property
    def size(self) -> float:
        """Longer side [px] up to which objects are of the swarm; larger ones begin seldom. Zero without a swarm."""
        if self.births.sum() < _SWARM_PER_S * _FORGET_S:
            return 0.0
        rate = self.births[::-1].cumsum()[::-1] / _FORGET_S
        return float(_LEAST_PX * 2 ** (np.count_nonzero(rate > _FEW_PER_S) / _STEPS))

    def learn(self, tracks: Tracks) -> None:
        """Count the tracks that began in this scan."""
        self.births *= math.exp(-max(tracks.t - self._time_s, 0.0) / _FORGET_S)
        self._time_s = tracks.t
        new = tracks.age_s <= 0
        if np.count_nonzero(new):
            bins = _STEPS * np.log2(np.maximum(longer(tracks.box[new]), _LEAST_PX) / _LEAST_PX)
            share = min(1.0, _AT_ONCE / len(bins))
            np.add.at(self.births, np.minimum(bins.astype(np.int64), _BINS - 1), share)
