"""Broken tracks: one that ends between the gates and one that begins there a little later may be one vehicle.

The odds that they are, against a vehicle that is lost for good and another that begins by chance, are

    R = 1/2 h(gap) N(difference of positions; 0, S) exp(-d^2 / 2) / rate

with h the density of the time that a track is lost for, N that of where it is found (m^-2), d the difference of the
lengths in standard deviations, and the rate at which tracks begin between the gates (s^-1 m^-2). With other tracks
that compete for the same ends, the probability of a pair is R over 1 + the sum of all R that share an end with it. At
most one pair of an end is likelier than not, so it is joined.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.traffic.measures.lives import End
from vidtrack.traffic.measures.rows import Rows, off_road

LONGEST_S = 4.0
_LOST_S = 1.0
"""s; mean time that a track is lost for"""
_SPEED_SIGMA = 1.0
"""m/s; of the velocity with which a track ends"""
_ACCELERATION = 2.0
"""m/s2; standard deviation of what a driver does meanwhile"""
_LENGTH_SIGMA = 0.25
"""Standard deviation of the logarithm of a length, from one track of a vehicle to another"""


@dataclass(frozen=True, slots=True, eq=False)
class Joins:
    """J joins: track `before` goes on as track `after`, with a probability above 1/2; all (J,)."""

    before: Ints
    after: Ints
    probability: Floats

    def vehicles(self, tracks: int) -> Ints:
        """(T,) number of the first track of the vehicle that each track is of."""
        first = np.arange(tracks)
        first[self.after] = self.before
        while (first[first] != first).any():
            first = first[first]
        return first


def joined(tail: End, head: End, length: Floats, ends: Mask, begins: Mask, watched_s: float) -> Joins:
    """The joins of T tracks.

    length         (T,) m
    ends, begins   (T,) tracks that end, and that begin, between the gates
    watched_s      s; time in which they began
    """
    last, first = np.flatnonzero(ends), np.flatnonzero(begins)
    last, first = last[np.argsort(tail.t[last])], first[np.argsort(head.t[first])]
    begin = np.searchsorted(head.t[first], tail.t[last], side="right")
    count = np.searchsorted(head.t[first], tail.t[last] + LONGEST_S, side="right") - begin
    a = np.repeat(last, count)
    b = first[np.arange(count.sum()) - np.repeat(np.cumsum(count) - count - begin, count)]
    if len(a) == 0:
        return Joins(a, b, np.empty(0))
    area = np.prod(np.ptp(head.xy[first], axis=0) + 1.0)
    rate = len(first) / (watched_s * area)
    R = odds(tail, head, length, a, b) / rate
    shared = np.bincount(a, R, len(ends))[a] + np.bincount(b, R, len(ends))[b] - R
    probability = R / (1 + shared)
    likely = probability > 0.5
    return Joins(a[likely], b[likely], probability[likely])


def odds(tail: End, head: End, length: Floats, a: Ints, b: Ints) -> Floats:
    """(J,) density with which the vehicle of track a is found again as track b, 1/(s m2)."""
    gap = head.t[b] - tail.t[a]
    off = head.xy[b] - tail.xy[a] - gap[:, None] * np.nan_to_num(tail.v[a])
    variance = tail.sigma[a] ** 2 + head.sigma[b] ** 2
    variance += (_SPEED_SIGMA * gap) ** 2 + (_ACCELERATION * gap**2 / 2) ** 2
    place = np.exp(-np.sum(off**2, axis=1) / (2 * variance)) / (2 * np.pi * variance)
    size = np.nan_to_num(np.log(length[b] / length[a]) / _LENGTH_SIGMA)
    return np.asarray(0.5 * np.exp(-gap / _LOST_S) / _LOST_S * place * np.exp(-(size**2) / 2))


def gap_rows(tail: End, head: End, joins: Joins) -> Rows:
    """(2 J,) rows that bridge the gaps: the end of the one track and the beginning of the other, `track` the join.

    How fast a vehicle went meanwhile is not known.
    """
    last, first = joins.before, joins.after

    def both(name: str) -> Floats:
        return np.stack([getattr(tail, name)[last], getattr(head, name)[first]], axis=1).reshape(
            2 * len(last), *getattr(tail, name).shape[1:]
        )

    rows = 2 * len(last)
    yes = np.ones(rows, bool)
    number = np.repeat(np.arange(len(last)), 2)
    state = both("xy"), both("sigma"), np.zeros(rows), np.full((rows, 2), np.nan)
    return Rows(number, both("t"), yes, ~yes, *state, *off_road(rows))
