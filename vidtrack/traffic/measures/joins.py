"""Broken tracks: one that ends between the gates and one that begins there a little later may be one vehicle.

The odds that they are, against a vehicle that is lost for good and another that begins by chance, are

    R = h(gap) t(difference of states; S) exp(-d^2 / 2) / rate

h is the density of the time that a track is lost for, t that of place and velocity in which it is found (Student's t of
four dimensions, 1/(m^2 (m/s)^2)), S the covariance of both states after a motion of nearly constant velocity, and d the
difference of the lengths in standard deviations. For a share _ASTRAY of the pairs another vehicle in the blob has drawn
an end along: then the second one is somewhere near (Student's t of two dimensions), at any velocity. That is so of all
stretches of one track, which was broken since its motion is not that of one vehicle; they are SAME times as likely one
vehicle. A movement that is not allowed is none. `rate` is that at which tracks begin by chance between
the gates, per second and unit of place and velocity: what no join explains.

All ends are decided together: the probability of a pair is its marginal over all ways to join ends one to one, each as
likely as the product of its odds. Belief propagation finds these marginals (Williams and Lau, IEEE Transactions on
Aerospace and Electronic Systems 50(4), 2014). They hold if both ends are of one vehicle, which is so for a share
_SOUND of them, and for fewer where neither stretch has passed an entry or an exit. At most one pair of an end is
likelier than not, and that is joined.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.rows import dot
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.traffic.measures.rows import Rows, off_road
from vidtrack.traffic.measures.stretches import JOLT_PER_M_S, MODEL_M_S, STANDING_JOLT, End, Lives

LONGEST_S = 20.0
_ROUNDS, _PASSES, _SETTLED = 4, 30, 1e-9
"""In which the rate of chance is found, and of belief propagation, at most: until no message changes by more"""
_LOST_S = 2.0
"""s; mean time that a track is lost for"""
OVERLAP_S = 1.0
"""s; a track that is lost may be seen so long after the one began that goes on"""
SAME = 10.0
_FREEDOM = 4.0
"""of Student's t: states of tracks that have just shared a blob are off by more than they say"""
_VELOCITIES = 400.0
"""(m/s)2; over which the velocities of tracks that begin are spread"""
_LENGTH_SIGMA = 0.25
"""Standard deviation of the logarithm of a length, from one track of a vehicle to another"""
_ASTRAY, _ASTRAY_FREEDOM = 0.5, 2.0
"""Share of pairs of two tracks with an end that another vehicle has drawn along; of Student's t then"""
ASTRAY_SCALES = (1.6, 2.6, 7.6)
"""Of how far such ends are apart, m, and m/s times the gap; standard deviation of the second velocity, m/s. As
`tools/fit_joins.py` has all four."""
_SOUND, _SOUND_BETWEEN = 0.95, 0.65
"""Share of joins whose two ends are of one vehicle, where it passed an entry or an exit, and of others: those are often
of blobs that hold several vehicles, or none"""


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

    def likely(self, vehicle: Ints) -> Floats:
        """(T,) that all stretches of the vehicle of each number are its own; vehicle (T,) as `vehicles` has it."""
        sure = np.ones(len(vehicle))
        np.multiply.at(sure, vehicle[self.after], self.probability)
        return sure


def joined(
    lives: Lives, ends: Mask, begins: Mask, passes: Mask, watched_s: float, allowed: Callable[[Ints, Ints], Mask]
) -> Joins:
    """The joins of T stretches.

    ends, begins   (T,) those that end, and that begin, between the gates
    passes         (T,) those that passed an entry or an exit
    watched_s      s; time in which they began
    allowed        which pairs of stretches make a trip that may be
    """
    tail, head = lives.tail, lives.head
    last, first = np.flatnonzero(ends), np.flatnonzero(begins)
    last, first = last[np.argsort(tail.t[last])], first[np.argsort(head.t[first])]
    begin = np.searchsorted(head.t[first], tail.t[last] - OVERLAP_S, side="right")
    count = np.searchsorted(head.t[first], tail.t[last] + LONGEST_S, side="right") - begin
    a = np.repeat(last, count)
    b = first[np.arange(count.sum()) - np.repeat(np.cumsum(count) - count - begin, count)]
    if len(a) == 0:
        return Joins(a, b, np.empty(0))
    area = np.prod(np.ptp(head.xy[first], axis=0) + 1.0)
    size = np.nan_to_num(np.log(lives.length[b] / lives.length[a]) / _LENGTH_SIGMA)
    same = lives.track[a] == lives.track[b]
    density = found_again(tail, head, a, b, np.where(same, 1.0, _ASTRAY)) * np.exp(-(size**2) / 2)
    density *= np.where(same, SAME, 1.0) * allowed(a, b)
    chance = float(len(first))
    for _ in range(_ROUNDS):
        probability = marginals(density / (chance / (watched_s * area * _VELOCITIES)), a, b, len(ends))
        chance = max(len(first) - probability.sum(), 1.0)
    probability = np.where(passes[a] | passes[b], _SOUND, _SOUND_BETWEEN) * probability
    likely = probability > 0.5
    return Joins(a[likely], b[likely], probability[likely])


def marginals(R: Floats, a: Ints, b: Ints, ends: int) -> Floats:
    """(J,) probabilities of pairs (a, b) of odds R, when each end is in one pair at most."""
    back = np.ones(len(R))
    for _ in range(_PASSES):
        going = R * back
        going = R / (1 + np.bincount(a, going, ends)[a] - going)
        before, back = back, 1 / (1 + np.bincount(b, going, ends)[b] - going)
        if np.abs(back - before).max() < _SETTLED:
            break
    going = R * back
    return np.asarray(going / (1 + np.bincount(a, going, ends)[a]))


def found_again(tail: End, head: End, a: Ints, b: Ints, drawn: Floats) -> Floats:
    """(J,) density with which the vehicle of stretch a, driving on, is found as stretch b, 1/(s m2 (m/s)2).

    drawn  (J,) probability that another vehicle has drawn an end along
    """
    lost = np.exp(-gaps(tail, head, a, b) / _LOST_S) / _LOST_S
    return np.asarray(((1 - drawn) * on_course(tail, head, a, b) + drawn * astray(tail, head, a, b)) * lost)


def gaps(tail: End, head: End, a: Ints, b: Ints) -> Floats:
    """(J,) s from the end of stretch a to the beginning of stretch b; 0 where they overlap."""
    return np.asarray(np.maximum(head.t[b] - tail.t[a], 0.0))


def on_course(tail: End, head: End, a: Ints, b: Ints) -> Floats:
    """(J,) density of the place and velocity of stretch b where that of stretch a leads to, 1/(m2 (m/s)2)."""
    gap = gaps(tail, head, a, b)
    place = head.xy[b] - tail.xy[a] - (head.t[b] - tail.t[a])[:, None] * tail.v[a]
    pace = head.v[b] - tail.v[a]
    jolt = STANDING_JOLT + JOLT_PER_M_S * np.linalg.norm(tail.v, axis=1)[a]
    (xx, xv, vv), (x2, xv2, v2) = tail.spread[a].T, head.spread[b].T
    sxx = xx + 2 * gap * xv + gap**2 * vv + jolt * gap**3 / 3 + x2
    sxv = xv + gap * vv + jolt * gap**2 / 2 + xv2
    svv = vv + jolt * gap + v2 + MODEL_M_S**2
    det = sxx * svv - sxv**2
    square = (svv * dot(place, place) - 2 * sxv * dot(place, pace) + sxx * dot(pace, pace)) / det
    peak = (1 + _FREEDOM / 2) / (2 * np.pi**2 * _FREEDOM) / det
    return np.asarray(peak * (1 + square / _FREEDOM) ** -(2 + _FREEDOM / 2))


def astray(tail: End, head: End, a: Ints, b: Ints, scales: Sequence[float] = ASTRAY_SCALES) -> Floats:
    """(J,) the same where another vehicle has drawn an end along."""
    apart_m, apart_m_s, pace_m_s = scales
    apart = head.xy[b] - tail.xy[a]
    near = apart_m**2 + (apart_m_s * gaps(tail, head, a, b)) ** 2
    place = (1 + dot(apart, apart) / near / _ASTRAY_FREEDOM) ** -(1 + _ASTRAY_FREEDOM / 2) / (2 * np.pi * near)
    return np.asarray(place * np.exp(-dot(head.v[b], head.v[b]) / pace_m_s**2 / 2) / (2 * np.pi * pace_m_s**2))


def gap_rows(lives: Lives, joins: Joins) -> Rows:
    """(2 J,) rows that bridge the gaps: the end of the one stretch and the beginning of the other, `track` the join."""
    return step_rows(lives.tail.only(joins.before), lives.head.only(joins.after))


def step_rows(begin: End, end: End) -> Rows:
    """(2 J,) rows of J steps from a state to another, `track` the step. How fast a vehicle went is not known."""

    def both(*columns: Floats) -> Floats:
        return np.stack(columns, axis=1).reshape(2 * len(begin.t), *columns[0].shape[1:])

    rows = 2 * len(begin.t)
    yes = np.ones(rows, bool)
    number = np.repeat(np.arange(len(begin.t)), 2)
    sigma = np.sqrt(both(begin.spread[:, 0], end.spread[:, 0]))
    state = both(begin.xy, end.xy), sigma, np.zeros(rows), np.full((rows, 2), np.nan)
    return Rows(number, both(begin.t, end.t), yes, ~yes, ~yes, *state, *off_road(rows))
