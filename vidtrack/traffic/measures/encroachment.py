"""Post-encroachment time: from when the first vehicle leaves a place until the second one comes to it.

Allen, Shin, Cooper: Analysis of traffic conflicts and collisions, Transportation Research Record 667 (1978). It is the
least time between two moments at which the rectangle of the one and that of the other overlap, with headings that
differ. Only ways that meet there count: who drove along the way of the other before has a headway, also when one of
them turns off or the road bends.

Which moments to compare is found by boxes: each track is cut into legs of _LEG rows, and only legs whose boxes meet,
soon after each other and with headings that differ, are looked at row by row. Between two rows vehicles are taken to go
straight on. With d between the middles of the first at t_a and the second at t_b, and g the vector with
g v_a = g v_b = -1,

    PET = t_b - t_a + g d - h(g)

where h(g) is how far both together reach along g: their swept ways meet in a parallelogram, and this is the least of
arriving less leaving over its corners.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vidtrack.arrays.rows import by_number
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import inlined, kernel
from vidtrack.traffic.measures.bodies import EX, EY, LENGTH, WIDTH, Bodies, Encounters, T, X, Y, touching_place

PET_S = 5.0
"""s; a longer post-encroachment time is no conflict (FHWA-HRT-08-050, the default of SSAM)"""
CROSSING_RAD = np.radians(30)
"""Vehicles whose headings differ less follow each other (SSAM: rear-end)"""
_FOLLOWS, _ACROSS = float(np.cos(CROSSING_RAD)), float(np.sin(CROSSING_RAD))
_LEG = 16
"""Rows; with fewer there are more boxes to compare, with more the boxes hold more road where the vehicle is not"""
_ROUNDING_S = 1e-6
_SURE = 2.0
"""Standard deviations of a time that must be less than PET_S: where ways are almost parallel nobody knows where they
cross"""
_SLOWEST = 0.5
"""m/s; for when a vehicle that is about to stand leaves or comes, since it does not go on with that speed"""

LEFT, LOW, BEGIN, RIGHT, HIGH, END, AHEAD_X, AHEAD_Y, COS_TURNED, SIN_TURNED = range(10)
"""Columns of legs: box [m] and time [s]; first heading, and cosine and sine of the angle by which later ones differ"""
_HULL = tuple((k, np.minimum) for k in (LEFT, LOW, BEGIN)) + tuple((k, np.maximum) for k in (RIGHT, HIGH, END))


def encroachments(bodies: Bodies, since: float, until: float) -> Encounters:
    """The least post-encroachment time of each two vehicles, of at most PET_S, from `since` on and before `until`.

    bodies  (N,) in order of time; the moment is when the second vehicle comes

    Its value is NaN where they follow each other, or nobody knows where their ways cross: no other one counts for it.
    """
    order = by_number(bodies.track)
    track, rectangle = _sorted(bodies.track, bodies.table, order)
    i, j = _met(track, rectangle, since, until)
    late = rectangle[i, T] > rectangle[j, T]
    i, j = np.where(late, j, i), np.where(late, i, j)
    steps = _step(track, rectangle, i, 1) + _step(track, rectangle, j, -1)
    found = _details(bodies.only(order[i]), bodies.only(order[j]), steps)
    counts = _SURE * found.sigma < PET_S
    counts[counts] = ~_follows(i[counts], j[counts], track, rectangle)
    return replace(found, value=np.where(counts, found.value, np.nan))


def _met(track: Ints, rectangle: Floats, since: float, until: float) -> tuple[Ints, Ints]:
    """The rows, nearest in time, in which each two vehicles have been in one place with headings that differ.

    track, rectangle   (N,) and (N, 7) in order of tracks and time
    """
    begin, first = _legs_begin(track)
    leg = _legs(begin, rectangle)
    life = np.column_stack([reduced.reduceat(leg[:, column], first[:-1]) for column, reduced in _HULL])
    rows = np.empty((8 * len(life) + 64, 2), np.int64)
    order = np.argsort(life[:, BEGIN], kind="stable")
    row, count = 0, 0
    while row < len(order):
        row, count = look(row, count, order, life, first, leg, begin, rectangle, since, until, rows)
        if row < len(order):
            rows = np.vstack([rows, np.empty_like(rows)])
    return rows[:count, 0], rows[:count, 1]


@kernel
def _legs_begin(track: Ints) -> tuple[Ints, Ints]:
    """(L + 1,) rows at which the legs of tracks begin, and (K + 1,) the legs at which those of the next track do."""
    begin, first, legs, tracks = np.empty(len(track) + 1, np.int64), np.empty(len(track) + 1, np.int64), 0, 0
    for i in range(len(track)):
        if i == 0 or track[i] != track[i - 1]:
            first[tracks] = legs
            tracks += 1
        elif i - begin[legs - 1] < _LEG:
            continue
        begin[legs] = i
        legs += 1
    begin[legs], first[tracks] = len(track), legs
    return begin[: legs + 1].copy(), first[: tracks + 1].copy()


def _details(a: Bodies, b: Bodies, steps: Floats) -> Encounters:
    """Encounters (E,) of overlapping rectangles, b the later ones; `steps` (E,) s between the rows of both together."""
    later = b.t - a.t
    g = _slowness(a, b)
    straight = later + np.sum(g * (b.xy - a.xy), axis=1) - a.half(g) - b.half(g)
    pet = np.clip(straight, np.maximum(later - steps, 0), later)
    sigma = np.sqrt(a.variance(g) + b.variance(g))
    return Encounters.at(a, b, pet, sigma, later, b.t, touching_place(a, b, a.ahead))


def _slowness(a: Bodies, b: Bodies) -> Floats:
    """(E, 2) g [s/m] with g v_a = g v_b = -1, for speeds of at least _SLOWEST."""
    va, vb = (np.maximum(np.linalg.norm(one.v, axis=1), _SLOWEST)[:, None] * one.ahead for one in (a, b))
    cross = va[:, 0] * vb[:, 1] - va[:, 1] * vb[:, 0]
    change = va - vb
    return np.column_stack([change[:, 1], -change[:, 0]]) / np.where(cross == 0, 1e-9, cross)[:, None]


def _step(track: Ints, rectangle: Floats, row: Ints, way: int) -> Floats:
    """(E,) s to the next row of the same track, or from the one before; 0 where there is none."""
    other = np.clip(row + way, 0, len(track) - 1)
    return np.where(track[other] == track[row], np.abs(rectangle[other, T] - rectangle[row, T]), 0.0)


@kernel
def _sorted(track: Ints, table: Floats, order: Ints) -> tuple[Ints, Floats]:
    """(N,) tracks and (N, 7) rectangles, columns T to WIDTH, in an order."""
    tracks, rectangle = np.empty(len(order), np.int64), np.empty((len(order), WIDTH + 1))
    for k in range(len(order)):
        tracks[k] = track[order[k]]
        for column in range(WIDTH + 1):
            rectangle[k, column] = table[order[k], column]
    return tracks, rectangle


@kernel
def _legs(begin: Ints, rectangle: Floats) -> Floats:
    """(L, 10) boxes, times and headings of legs: columns LEFT..."""
    leg = np.empty((len(begin) - 1, SIN_TURNED + 1))
    for k in range(len(leg)):
        now, first = leg[k], rectangle[begin[k]]
        now[LEFT], now[LOW], now[RIGHT], now[HIGH] = np.inf, np.inf, -np.inf, -np.inf
        now[BEGIN], now[END] = first[T], rectangle[begin[k + 1] - 1, T]
        now[AHEAD_X], now[AHEAD_Y] = first[EX], first[EY]
        least = 1.0
        for i in range(begin[k], begin[k + 1]):
            x, y, across, up = _extent(rectangle[i])
            now[LEFT], now[RIGHT] = min(now[LEFT], x - across), max(now[RIGHT], x + across)
            now[LOW], now[HIGH] = min(now[LOW], y - up), max(now[HIGH], y + up)
            least = min(least, _cosine(first, rectangle[i]))
        now[COS_TURNED], now[SIN_TURNED] = least, np.sqrt(max(1 - least * least, 0.0))
    return leg


@kernel
def look(
    row: int, count: int, order: Ints, life: Floats, first: Ints, leg: Floats, begin: Ints, rectangle: Floats,
    since: float, until: float, rows: Ints,
) -> tuple[int, int]:  # fmt: skip
    """Compare tracks in `order` of their beginnings with those that begin at most PET_S after their ends, until all are
    done or the rows need more room; the next track and the number of rows.

    life    (K, 6) as `leg`, of whole tracks
    first, begin   as of `_legs_begin`
    rows    (M, 2) what is found
    """
    for a in range(row, len(order)):
        one, before = order[a], count
        for b in range(a + 1, len(order)):
            other = order[b]
            if life[other, BEGIN] > life[one, END] + PET_S:
                break
            if not _boxes_meet(life[one], life[other]):
                continue
            if count == len(rows):
                return a, before
            legs = first[one], first[one + 1], first[other], first[other + 1]
            i, j = _nearest(*legs, life[one], leg, begin, rectangle, since, until)
            if i >= 0:
                rows[count, 0], rows[count, 1] = i, j
                count += 1
    return len(order), count


@kernel
def _nearest(
    one: int, one_end: int, other: int, other_end: int, hull: Floats, leg: Floats, begin: Ints, rectangle: Floats,
    since: float, until: float,
) -> tuple[int, int]:  # fmt: skip
    """Of the legs of two tracks the rows, nearest in time, whose rectangles overlap; -1 where there are none.

    The later row is not before `since`, and before `until`. `hull` is the box around all legs of the first track.
    """
    best, first, second = PET_S, -1, -1
    for b in range(other, other_end):
        if not _boxes_meet(hull, leg[b]):
            continue
        while one < one_end and leg[one, END] < leg[b, BEGIN] - best:
            one += 1
        for a in range(one, one_end):
            if leg[a, BEGIN] > leg[b, END] + best:
                break
            if max(leg[a, END], leg[b, END]) < since or max(leg[a, BEGIN], leg[b, BEGIN]) >= until:
                continue
            if not _boxes_meet(leg[a], leg[b]) or not _crossing(leg[a], leg[b]):
                continue
            low = begin[a]
            for j in range(begin[b], begin[b + 1]):
                t = rectangle[j, T]
                while low < begin[a + 1] and rectangle[low, T] < t - best:
                    low += 1
                if not _in_box(rectangle[j], leg[a]):
                    continue
                for i in range(low, begin[a + 1]):
                    if rectangle[i, T] > t + best:
                        break
                    wait = abs(t - rectangle[i, T])
                    if first >= 0 and wait > best - _ROUNDING_S:
                        continue
                    if not since <= max(t, rectangle[i, T]) < until:
                        continue
                    if not _aligned(rectangle[i], rectangle[j]) and _overlap(rectangle[i], rectangle[j]):
                        best, first, second = wait, i, j
    return first, second


@kernel
def _follows(first: Ints, second: Ints, track: Ints, rectangle: Floats) -> Mask:
    """(E,) whether the vehicle of row `second`, a length or PET_S earlier, is on the way of that of `first` already."""
    follows = np.zeros(len(first), np.bool_)
    for k in range(len(first)):
        i, at, then = first[k], second[k], rectangle[second[k]]
        while _distance(rectangle[at], then) < then[LENGTH] and _before(at, track, rectangle, then[T] - PET_S):
            at -= 1
        while _before(i, track, rectangle, rectangle[at, T] - PET_S):
            i -= 1
        while i < len(track) and track[i] == track[first[k]] and rectangle[i, T] < rectangle[at, T] + PET_S:
            if _aligned(rectangle[i], rectangle[at]) and _overlap(rectangle[i], rectangle[at]):
                follows[k] = True
                break
            i += 1
    return follows


@inlined
def _before(row: int, track: Ints, rectangle: Floats, since: float) -> bool:
    """Whether there is a row of the same track before it, and after a time."""
    return row > 0 and track[row - 1] == track[row] and rectangle[row - 1, T] > since


@inlined
def _boxes_meet(one: Floats, other: Floats) -> bool:
    across = one[LEFT] <= other[RIGHT] and other[LEFT] <= one[RIGHT]
    return across and one[LOW] <= other[HIGH] and other[LOW] <= one[HIGH]


@inlined
def _in_box(one: Floats, leg: Floats) -> bool:
    """Whether a rectangle may meet those of a leg."""
    x, y, across, up = _extent(one)
    beside = leg[LEFT] <= x + across and x - across <= leg[RIGHT]
    return beside and leg[LOW] <= y + up and y - up <= leg[HIGH]


@inlined
def _crossing(one: Floats, other: Floats) -> bool:
    """Whether the headings of two legs may differ by CROSSING_RAD."""
    cos = one[COS_TURNED] * other[COS_TURNED] - one[SIN_TURNED] * other[SIN_TURNED]
    sin = one[SIN_TURNED] * other[COS_TURNED] + one[COS_TURNED] * other[SIN_TURNED]
    if min(one[COS_TURNED], other[COS_TURNED], cos) <= _FOLLOWS:
        return True  # both together turn so much
    cosine = one[AHEAD_X] * other[AHEAD_X] + one[AHEAD_Y] * other[AHEAD_Y]
    return cosine <= _FOLLOWS * cos + _ACROSS * sin


@inlined
def _extent(one: Floats) -> tuple[float, float, float, float]:
    """The middle of a rectangle, and how far it reaches from there along x and y."""
    along, across = abs(one[EX]), abs(one[EY])
    return (
        *(one[X], one[Y]),
        (one[LENGTH] * along + one[WIDTH] * across) / 2,
        (one[LENGTH] * across + one[WIDTH] * along) / 2,
    )


@inlined
def _distance(one: Floats, other: Floats) -> float:
    return np.sqrt((one[X] - other[X]) ** 2 + (one[Y] - other[Y]) ** 2)


@inlined
def _cosine(one: Floats, other: Floats) -> float:
    """Of the angle between two headings."""
    return one[EX] * other[EX] + one[EY] * other[EY]


@inlined
def _aligned(one: Floats, other: Floats) -> bool:
    return _cosine(one, other) > _FOLLOWS


@inlined
def _overlap(one: Floats, other: Floats) -> bool:
    """Whether two rectangles overlap: along the normal of every edge."""
    dx, dy = other[X] - one[X], other[Y] - one[Y]
    cos, sin = abs(_cosine(one, other)), abs(one[EX] * other[EY] - one[EY] * other[EX])
    for own, its in ((one, other), (other, one)):
        along, across = abs(dx * own[EX] + dy * own[EY]), abs(dx * own[EY] - dy * own[EX])
        if 2 * along > own[LENGTH] + its[LENGTH] * cos + its[WIDTH] * sin:
            return False
        if 2 * across > own[WIDTH] + its[LENGTH] * sin + its[WIDTH] * cos:
            return False
    return True
