"""Queues: vehicles that stand on the approach of a leg, from when the first stands until none does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.traffic.measures.staying import STANDING_PAUSE_S, Stays

_UNKNOWN_M = 4.5
"""m; length of vehicles whose length is not known"""

_LEAST_S = 0.2
"""s; who stands for less only seems to: a row or two of a vehicle that drives are below the speed of one that stands"""


@dataclass(frozen=True, slots=True, eq=False)
class Queues:
    """Q queues in order of time.

    leg         (Q,) number of the leg
    begin, end  (Q,) s
    vehicles    (Q,) largest number that stood at a time
    length      (Q,) m; largest distance from the front of the first one, where it came to stand, to the rear of
                another, of those whose places are sure; NaN without any
    """

    leg: Ints
    begin: Floats
    end: Floats
    vehicles: Ints
    length: Floats


def queues_of(standing: Stays, leg: Ints, length: Floats) -> Queues:
    """Queues of vehicles that stand.

    leg     (E,) number of the leg on whose approach each stands; -1: on none, and in no queue
    length  (E,) m
    """
    order = np.lexsort((standing.begin, leg))
    order = order[(leg[order] >= 0) & ((standing.end - standing.begin)[order] >= _LEAST_S)]
    leg, begin, end = leg[order], standing.begin[order], standing.end[order]
    xy, half = standing.xy[order], np.nan_to_num(length[order], nan=_UNKNOWN_M) / 2
    if len(leg) == 0:
        return Queues(leg, begin, end, leg, begin)
    apart = leg * (end.max() - begin.min() + 10 * STANDING_PAUSE_S)  # one axis for all legs
    latest = np.maximum.accumulate(end + apart)
    first = np.flatnonzero(np.append(True, begin[1:] + apart[1:] - latest[:-1] > STANDING_PAUSE_S))
    queue = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(leg))))
    placed = np.where(np.isfinite(xy[:, 0]), np.arange(len(leg)), len(leg) - 1)
    head = np.minimum.reduceat(placed, first)[queue]
    extent = np.linalg.norm(xy - xy[head], axis=1) + half + half[head]
    gone = np.searchsorted(np.sort(end + apart), begin + apart, side="right")
    standing_then = np.arange(len(leg)) + 1 - gone
    by_time = np.argsort(begin[first], kind="stable")
    return Queues(
        leg=leg[first][by_time],
        begin=begin[first][by_time],
        end=np.maximum.reduceat(end, first)[by_time],
        vehicles=np.maximum.reduceat(standing_then, first)[by_time],
        length=np.fmax.reduceat(extent, first)[by_time],
    )
