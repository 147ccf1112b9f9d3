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

Where one vehicle turns into the way of another, the time depends on where their headings begin or cease to differ by
CROSSING_RAD, and so on the errors of the headings: sigma has by how much longer it would be if they had to differ more.
Where they would nowhere differ by one standard deviation more, nobody knows whether their ways cross.
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
"""Standard deviations of a time by which it must be more than 0, and in all less than PET_S: where ways are almost
parallel nobody knows where they cross; and of headings, by which more they may have to differ"""
CHORD_S, _CHORD_M = 0.6, 3.0
"""s, m; the heading is that of the way from so long before to so long after, where that is so long: the velocity of a
filter follows a turn late"""
_CHORD_SIGMA = 0.6
"""Error of such a heading over that of a filter's, root mean squares in turns (roundabouts and junctions 600 to 605)"""
_SLOWEST = 0.5
"""m/s; for when a vehicle that is about to stand leaves or comes, since it does not go on with that speed"""

LEFT, LOW, BEGIN, RIGHT, HIGH, END, AHEAD_X, AHEAD_Y, COS_TURNED, SIN_TURNED = range(10)
"""Columns of legs: box [m] and time [s]; first heading, and cosine and sine of the angle by which later ones differ"""
_HULL = tuple((k, np.minimum) for k in (LEFT, LOW, BEGIN)) + tuple((k, np.maximum) for k in (RIGHT, HIGH, END))


def encroachments(bodies: Bodies, since: float, until: float) -> Encounters:
    """The least post-encroachment time of each two vehicles, of at most PET_S, from `since` on and before `until`.

    bodies  (N,) in order of time; the moment is when the second vehicle comes

    Its value is NaN where they follow each other, nobody knows where their ways cross, or it does not differ from 0, as
    that of two in one place at one time, which vehicles are not: no other one counts for it.
    """
    order = by_number(bodies.track)
    track, rectangle = _sorted(bodies.track, bodies.table, order)
    _head_along(track, rectangle)
    i, j = _met(track, rectangle, since, until)
    late = rectangle[i, T] > rectangle[j, T]
    i, j = np.where(late, j, i), np.where(late, i, j)
    steps = _step(track, rectangle, i, 1) + _step(track, rectangle, j, -1)
    first, second = bodies.only(order[i]), bodies.only(order[j])
    for one, row in ((first, i), (second, j)):
        one.ahead[:] = rectangle[row, EX : EY + 1]
    found = _details(first, second, steps)
    counts = (found.rank > 0) & (found.value > _SURE * found.sigma) & (_SURE * found.sigma < PET_S)
    counts[counts] = ~_follows(i[counts], j[counts], track, rectangle)
    turned = _CHORD_SIGMA * np.hypot(first.heading_sigma, second.heading_sigma)
    counts[counts] = _wait(i[counts], j[counts], turned[counts], track, rectangle) < PET_S
    i, j = i[counts], j[counts]
    longer = _wait(i, j, _SURE * turned[counts], track, rectangle) - (rectangle[j, T] - rectangle[i, T])
    by_heading = np.zeros(len(found))
    by_heading[counts] = np.maximum(longer, 0.0) / _SURE
    return replace(found, value=np.where(counts, found.value, np.nan), sigma=np.hypot(found.sigma, by_heading))


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
def _head_along(track: Ints, rectangle: Floats) -> None:
    """Give each rectangle (N, 7) the heading of the chord of its way, where that is at least _CHORD_M long.

    The chord reaches as far back as ahead, up to CHORD_S and to the ends of the track.
    """
    low = high = begin = end = 0
    for i in range(len(track)):
        if i == end:
            begin = low = high = i
            while end < len(track) and track[end] == track[begin]:
                end += 1
        t = rectangle[i, T]
        reach = min(CHORD_S, t - rectangle[begin, T], rectangle[end - 1, T] - t) + _ROUNDING_S
        while rectangle[low, T] < t - reach:
            low += 1
        while low > begin and rectangle[low - 1, T] >= t - reach:
            low -= 1
        while high + 1 < end and rectangle[high + 1, T] <= t + reach:
            high += 1
        while rectangle[high, T] > t + reach:
            high -= 1
        dx, dy = rectangle[high, X] - rectangle[low, X], rectangle[high, Y] - rectangle[low, Y]
        far = np.sqrt(dx * dx + dy * dy)
        if far >= _CHORD_M:
            rectangle[i, EX], rectangle[i, EY] = dx / far, dy / far


@kernel
def _legs(begin: Ints, rectangle: Floats) -> Floats:
    """(L, 10) boxes, times and headings of legs: columns LEFT..."""
    leg = np.empty((len(begin) - 1, SIN_TURNED + 1))
    for k in range(len(leg)):
        now, first = leg[k], begin[k]
        now[LEFT], now[LOW], now[RIGHT], now[HIGH] = np.inf, np.inf, -np.inf, -np.inf
        now[BEGIN], now[END] = rectangle[first, T], rectangle[begin[k + 1] - 1, T]
        now[AHEAD_X], now[AHEAD_Y] = rectangle[first, EX], rectangle[first, EY]
        least = 1.0
        for i in range(begin[k], begin[k + 1]):
            x, y, across, up = _extent(rectangle, i)
            now[LEFT], now[RIGHT] = min(now[LEFT], x - across), max(now[RIGHT], x + across)
            now[LOW], now[HIGH] = min(now[LOW], y - up), max(now[HIGH], y + up)
            least = min(least, _cosine(rectangle, first, i))
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
            if not _boxes_meet(life, one, life, other):
                continue
            if count == len(rows):
                return a, before
            legs = first[one], first[one + 1], first[other], first[other + 1]
            i, j = _nearest(*legs, life, one, leg, begin, rectangle, since, until)
            if i >= 0:
                rows[count, 0], rows[count, 1] = i, j
                count += 1
    return len(order), count


@kernel
def _nearest(
    one: int, one_end: int, other: int, other_end: int, life: Floats, whole: int, leg: Floats, begin: Ints,
    rectangle: Floats, since: float, until: float,
) -> tuple[int, int]:  # fmt: skip
    """Of the legs of two tracks the rows, nearest in time, whose rectangles overlap; -1 where there are none.

    The later row is not before `since`, and before `until`. Row `whole` of life is the first track.
    """
    best, first, second = PET_S, -1, -1
    for b in range(other, other_end):
        if not _boxes_meet(life, whole, leg, b):
            continue
        while one < one_end and leg[one, END] < leg[b, BEGIN] - best:
            one += 1
        for a in range(one, one_end):
            if leg[a, BEGIN] > leg[b, END] + best:
                break
            if max(leg[a, END], leg[b, END]) < since or max(leg[a, BEGIN], leg[b, BEGIN]) >= until:
                continue
            if not _boxes_meet(leg, a, leg, b) or not _crossing(leg, a, b):
                continue
            low = begin[a]
            for j in range(begin[b], begin[b + 1]):
                t = rectangle[j, T]
                while low < begin[a + 1] and rectangle[low, T] < t - best:
                    low += 1
                if not _in_box(rectangle, j, leg, a):
                    continue
                for i in range(low, begin[a + 1]):
                    if rectangle[i, T] > t + best:
                        break
                    wait = abs(t - rectangle[i, T])
                    if first >= 0 and wait > best - _ROUNDING_S:
                        continue
                    if not since <= max(t, rectangle[i, T]) < until:
                        continue
                    if not _aligned(rectangle, i, j) and _overlap(rectangle, i, j):
                        best, first, second = wait, i, j
    return first, second


@kernel
def _wait(first: Ints, second: Ints, turned: Floats, track: Ints, rectangle: Floats) -> Floats:
    """(E,) s; the wait between rows `first` and `second`, over all places, if headings must differ by `turned` (E,) rad
    more; PET_S where they nowhere do."""
    wait = np.empty(len(first))
    for k in range(len(first)):
        i, j = first[k], second[k]
        most = np.cos(min(CROSSING_RAD + turned[k], np.pi / 2))
        if not _cosine(rectangle, i, j) > most:
            wait[k] = rectangle[j, T] - rectangle[i, T]
            continue
        low, high = _around(track, rectangle, i)
        begin, end = _around(track, rectangle, j)
        wait[k] = PET_S
        for b in range(begin, end):
            for a in range(low, high):
                later = abs(rectangle[b, T] - rectangle[a, T])
                if later < wait[k] and not _cosine(rectangle, a, b) > most and _overlap(rectangle, a, b):
                    wait[k] = later
    return wait


@inlined
def _around(track: Ints, rectangle: Floats, row: int) -> tuple[int, int]:
    """The first row of the same track within PET_S of a row, and the one after the last."""
    low = high = row
    while low > 0 and track[low - 1] == track[row] and rectangle[low - 1, T] > rectangle[row, T] - PET_S:
        low -= 1
    while high < len(track) and track[high] == track[row] and rectangle[high, T] < rectangle[row, T] + PET_S:
        high += 1
    return low, high


@kernel
def _follows(first: Ints, second: Ints, track: Ints, rectangle: Floats) -> Mask:
    """(E,) whether the vehicle of row `second`, a length or PET_S earlier, is on the way of that of `first` already."""
    follows = np.zeros(len(first), np.bool_)
    for k in range(len(first)):
        i, at = first[k], second[k]
        x, y, length, since = rectangle[at, X], rectangle[at, Y], rectangle[at, LENGTH], rectangle[at, T] - PET_S
        while at > 0 and track[at - 1] == track[at] and rectangle[at - 1, T] > since:
            if np.sqrt((rectangle[at, X] - x) ** 2 + (rectangle[at, Y] - y) ** 2) >= length:
                break
            at -= 1
        since, until = rectangle[at, T] - PET_S, rectangle[at, T] + PET_S
        while i > 0 and track[i - 1] == track[i] and rectangle[i - 1, T] > since:
            i -= 1
        while i < len(track) and track[i] == track[first[k]] and rectangle[i, T] < until:
            if _aligned(rectangle, i, at) and _overlap(rectangle, i, at):
                follows[k] = True
                break
            i += 1
    return follows


@inlined
def _boxes_meet(one: Floats, a: int, other: Floats, b: int) -> bool:
    across = one[a, LEFT] <= other[b, RIGHT] and other[b, LEFT] <= one[a, RIGHT]
    return across and one[a, LOW] <= other[b, HIGH] and other[b, LOW] <= one[a, HIGH]


@inlined
def _in_box(rectangle: Floats, i: int, leg: Floats, a: int) -> bool:
    """Whether rectangle i may meet those of leg a."""
    x, y, across, up = _extent(rectangle, i)
    beside = leg[a, LEFT] <= x + across and x - across <= leg[a, RIGHT]
    return beside and leg[a, LOW] <= y + up and y - up <= leg[a, HIGH]


@inlined
def _crossing(leg: Floats, a: int, b: int) -> bool:
    """Whether the headings of two legs may differ by CROSSING_RAD."""
    cos_a, sin_a, cos_b, sin_b = leg[a, COS_TURNED], leg[a, SIN_TURNED], leg[b, COS_TURNED], leg[b, SIN_TURNED]
    cos, sin = cos_a * cos_b - sin_a * sin_b, sin_a * cos_b + cos_a * sin_b
    if min(cos_a, cos_b, cos) <= _FOLLOWS:
        return True  # both together turn so much
    cosine = leg[a, AHEAD_X] * leg[b, AHEAD_X] + leg[a, AHEAD_Y] * leg[b, AHEAD_Y]
    return cosine <= _FOLLOWS * cos + _ACROSS * sin


@inlined
def _extent(rectangle: Floats, i: int) -> tuple[float, float, float, float]:
    """The middle of a rectangle, and how far it reaches from there along x and y."""
    along, across = abs(rectangle[i, EX]), abs(rectangle[i, EY])
    length, width = rectangle[i, LENGTH], rectangle[i, WIDTH]
    return (
        *(rectangle[i, X], rectangle[i, Y]),
        (length * along + width * across) / 2,
        (length * across + width * along) / 2,
    )


@inlined
def _cosine(rectangle: Floats, i: int, j: int) -> float:
    """Of the angle between two headings."""
    return rectangle[i, EX] * rectangle[j, EX] + rectangle[i, EY] * rectangle[j, EY]


@inlined
def _aligned(rectangle: Floats, i: int, j: int) -> bool:
    return _cosine(rectangle, i, j) > _FOLLOWS


@inlined
def _overlap(rectangle: Floats, i: int, j: int) -> bool:
    """Whether two rectangles overlap: along the normal of every edge."""
    dx, dy = rectangle[j, X] - rectangle[i, X], rectangle[j, Y] - rectangle[i, Y]
    cos = abs(_cosine(rectangle, i, j))
    sin = abs(rectangle[i, EX] * rectangle[j, EY] - rectangle[i, EY] * rectangle[j, EX])
    for own, its in ((i, j), (j, i)):
        ex, ey, length, width = rectangle[own, EX], rectangle[own, EY], rectangle[its, LENGTH], rectangle[its, WIDTH]
        along, across = abs(dx * ex + dy * ey), abs(dx * ey - dy * ex)
        if 2 * along > rectangle[own, LENGTH] + length * cos + width * sin:
            return False
        if 2 * across > rectangle[own, WIDTH] + length * sin + width * cos:
            return False
    return True
