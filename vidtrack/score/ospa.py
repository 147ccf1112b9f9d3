"""OSPA and GOSPA: the distance between two sets of objects, errors of place and of number in one unit.

D. Schuhmacher, B.-T. Vo, B.-N. Vo, "A Consistent Metric for Performance Evaluation of Multi-Object
Filters", IEEE Trans. Signal Processing, 2008.
A. S. Rahmathullah, A. F. Garcia-Fernandez, L. Svensson, "Generalized Optimal Sub-Pattern Assignment
Metric", FUSION 2017.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.errors import ConfigError
from vidtrack.scan import Floats, Ints
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
    """OSPA of each frame: the mean over the larger set, an object without partner costing the cutoff.

    `cutoff` is in the unit of the matchup's distance (1 - IoU, pixels or metres), at most its reach.
    Raises ConfigError for a cutoff beyond it or an order below 1.
    """
    power, pairs = _assigned(matchup, cutoff, order)
    truth, result = matchup.truth_count, matchup.result_count
    larger, smaller = np.maximum(truth, result), np.minimum(truth, result)
    localisation = (power + cutoff**order * (smaller - pairs)) / larger
    cardinality = cutoff**order * (larger - smaller) / larger
    distance = localisation + cardinality
    return Ospa(*(part ** (1 / order) for part in (distance, localisation, cardinality)))


def gospa(matchup: Matchup, cutoff: float, order: float = 2.0) -> Gospa:
    """GOSPA of each frame with alpha = 2: the sum over pairs, a missed or false object costing cutoff^p / 2.

    Units and errors as for `ospa`.
    """
    power, pairs = _assigned(matchup, cutoff, order)
    missed = cutoff**order / 2 * (matchup.truth_count - pairs)
    false = cutoff**order / 2 * (matchup.result_count - pairs)
    return Gospa(*(part ** (1 / order) for part in (power + missed + false, power, missed, false)))


def _assigned(matchup: Matchup, cutoff: float, order: float) -> tuple[Floats, Ints]:
    """Sum of distance^p over the optimal pairs nearer than the cutoff, and their number, by frame (F,).

    A pair saves cutoff^p - distance^p against leaving both alone, in OSPA as in GOSPA, so that
    one assignment is optimal for either.
    """
    if not 0 < cutoff <= matchup.reach:
        raise ConfigError(f"cutoff is {cutoff}; it must be above 0 and at most {matchup.reach}, the reach of the pairs")
    if order < 1:
        raise ConfigError(f"order is {order}; it must be at least 1")
    near = matchup.distance < cutoff
    frame, power = matchup.pair_frame[near], matchup.distance[near] ** order
    chosen = assign(frame, matchup.truth[near], matchup.result[near], cutoff**order - power)
    frame, frames = frame[chosen], len(matchup.truth_count)
    pairs = np.bincount(frame, minlength=frames)
    return np.bincount(frame, power[chosen], minlength=frames).astype(float), pairs.astype(np.int64)
