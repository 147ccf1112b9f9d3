"""Sizes at which so many things appear that they are no traffic: flakes, drops, insects."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.tracking.births import NEAR, pieces
from vidtrack.tracking.boxes import longer
from vidtrack.tracks import TENTATIVE, Tracks

_SWARM_PER_S = 30.0  # its births in the whole picture, more than traffic has anywhere
_FEW_PER_S = 1.0  # births of one size (a bin); sizes with fewer are not the swarm's
_FALLEN = 0.25  # share of the most frequent pair of sizes, below which the swarm has begun to end
_WIDEST = 2 * 4  # bins above the most frequent pair, at most: lamps and pieces of vehicles at night have all sizes
_STEEP = 0.7  # most that is left of a pair half an octave on; traffic begins where the swarm no longer ends so fast
_FORGET_S = 10.0
_SOON_S = 3.0  # shortest time that births are taken to have come in: few scans are no swarm
_AT_ONCE = 30  # births of one scan that count: the picture may change all at once
_LASTING = 0.25  # share of the remembered time in whose windows there are so many; damaged pictures are over sooner
_WINDOW_S = 0.2
_LEAST_PX, _STEPS, _BINS = 1.0, 4, 48  # sizes from 1 px to 4096 px, four bins to a factor of two


class Swarm:
    """Births of tracks by size, forgotten within ten seconds.

    births  (48,) remembered births, by the logarithm of the longer side
    """

    STATE = ("births", "_time_s", "_watched_s", "_busy_s", "_window")
    ADDED: ClassVar = {
        "_watched_s": lambda swarm: _FORGET_S,
        "_busy_s": lambda swarm: swarm._watched_s,
        "_window": lambda swarm: (0.0, 0.0),
    }

    def __init__(self) -> None:
        self.births: Floats = np.zeros(_BINS)
        self._time_s = 0.0
        self._watched_s = 0.0  # remembered time
        self._busy_s = 0.0  # that of windows in which so many began
        self._window = 0.0, 0.0  # the last one: its length so far [s], and births

    @property
    def size(self) -> float:
        """Longer side [px] up to which objects are of the swarm; larger ones begin seldom. Zero without a swarm."""
        seconds = max(self._watched_s, _SOON_S)
        if self.births.sum() <= _SWARM_PER_S * seconds or self._busy_s < _LASTING * self._watched_s:
            return 0.0
        rate = self.births / seconds
        pair = rate[:-1] + rate[1:]  # of half an octave
        most = int(pair.argmax())
        rare, flat = pair[:-2] < 2 * _FEW_PER_S, pair[2:] > _STEEP * pair[:-2]
        ends = rare | (flat & (pair[:-2] < _FALLEN * pair[most]))
        ends[most + _WIDEST :] = True
        end = most + int(ends[most:].argmax()) + 1  # what is seen a little larger than the others is of it as well
        return float(_LEAST_PX * 2 ** (end / _STEPS)) if rate[:end].sum() > _SWARM_PER_S else 0.0

    def learn(self, tracks: Tracks) -> None:
        """Count the tracks that began in this scan, other than beside known vehicles."""
        dt = max(tracks.t - self._time_s, 0.0)
        kept = math.exp(-dt / _FORGET_S)
        self.births *= kept
        self._watched_s, self._busy_s = kept * self._watched_s + dt, kept * self._busy_s
        self._time_s = tracks.t
        new = (tracks.age_s <= 0).nonzero()[0]
        if len(new):
            new = new[pieces(tracks.box[new], tracks.box[tracks.status != TENTATIVE], NEAR) < 0]
        length_s, births = self._window[0] + dt, self._window[1] + len(new)
        if length_s >= _WINDOW_S:
            self._busy_s += length_s * (births >= _SWARM_PER_S * length_s)
            length_s, births = 0.0, 0.0
        self._window = length_s, births
        if len(new):
            bins = _STEPS * np.log2(np.maximum(longer(tracks.box[new]), _LEAST_PX) / _LEAST_PX)
            share = min(1.0, _AT_ONCE / len(bins))
            np.add.at(self.births, np.minimum(bins.astype(np.int64), _BINS - 1), share)
