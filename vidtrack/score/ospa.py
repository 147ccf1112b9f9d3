"""OSPA and GOSPA: distances between two sets of objects, with errors of position and number in one unit.

D. Schuhmacher, B.-T. Vo, B.-N. Vo, "A Consistent Metric for Performance Evaluation of Multi-Object
Filters", IEEE Trans. Signal Processing, 2008.
A. S. Rahmathullah, A. F. Garcia-Fernandez, L. Svensson, "Generalized Optimal Sub-Pattern Assignment
Metric", FUSION 2017.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import ConfigError
from vidtrack.score.matching import Matchup, assign


@dataclass(frozen=True, slots=True)
class Ospa:
    """OSPA of each frame (F,) and its parts: distance^p = localisation^p + cardinality^p."""

    distance: Floats
    localisation: Floats
    cardinality: Floats


@dataclass(frozen=True, slots=True)
class Gospa:
    """GOSPA (alpha = 2) of each frame (F,) and its parts: distance^p = localisation^p + missed^p + false^p."""

    distance: Floats
    localisation: Floats
    missed: Floats
    false: Floats


def ospa(matchup: Matchup, cutoff: float, order: float = 2.0) -> Ospa:
    """OSPA of each frame: the mean over the larger set, where an unpaired object costs the cutoff.

    `cutoff` is in the unit of the matchup's distance (1 - IoU, pixels or metres), at most its reach.
    Raises ConfigError for a cutoff beyond it or an order below 1.
    """
    power, pairs = _assigned(matchup, cutoff, order)
    truth, result = matchup.truth_count, matchup.result_count
    larger, smaller = np.maximum(truth, result), np.minimum(truth, result)
    localisation = (power + (smaller - pairs)) / larger
    cardinality = (larger - smaller) / larger
    parts = (localisation + cardinality, localisation, cardinality)
    return Ospa(*(cutoff * part ** (1 / order) for part in parts))


def gospa(matchup: Matchup, cutoff: float, order: float = 2.0) -> Gospa:
    """GOSPA of each frame with alpha = 2: the sum over pairs, where a missed or false object costs cutoff^p / 2.

    Units and errors as for `ospa`.
    """
    power, pairs = _assigned(matchup, cutoff, order)
    missed, false = (matchup.truth_count - pairs) / 2, (matchup.result_count - pairs) / 2
    return Gospa(*(cutoff * part ** (1 / order) for part in (power + missed + false, power, missed, false)))


def _assigned(matchup: Matchup, cutoff: float, order: float) -> tuple[Floats, Ints]:
    """Sum of (distance / cutoff)^p over the optimal pairs nearer than the cutoff, and their number, by frame (F,).

    In OSPA and GOSPA a pair costs cutoff^p - distance^p less than two unpaired objects, so one
    assignment is optimal for both. In units of the cutoff no power overflows.
    """
    if not (0 < cutoff <= matchup.reach and cutoff < math.inf):
        raise ConfigError(f"cutoff is {cutoff}; it must be above 0, finite, and at most {matchup.reach:g} here")
    if not 1 <= order < math.inf:
        raise ConfigError(f"order is {order}; it must be at least 1 and finite")
    near = matchup.distance < cutoff
    frame, power = matchup.pair_frame[near], (matchup.distance[near] / cutoff) ** order
    chosen = assign(frame, matchup.truth[near], matchup.result[near], 1 - power)
    frame, frames = frame[chosen], len(matchup.truth_count)
    pairs = np.bincount(frame, minlength=frames)
    return np.bincount(frame, power[chosen], minlength=frames).astype(float), pairs.astype(np.int64)
