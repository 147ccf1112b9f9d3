"""Post-encroachment time: from when the first vehicle leaves a place until the second one comes to it.

Allen, Shin, Cooper: Analysis of traffic conflicts and collisions, Transportation Research Record 667 (1978). It is the
least time between two moments at which the rectangle of the one and that of the other overlap, with headings that
differ. Only ways that meet there count: who drove along the way of the other before has a headway, also when one of
them turns off or the road bends.

Which moments to compare is found by a grid: two rectangles that overlap have a cell in common. Each stay of a vehicle
in a cell is compared with those in the same cell soon after, if their headings differ. Between two rows vehicles are
taken to go straight on. With d between the middles of the first at t_a and the second at t_b, and g the vector with
g v_a = g v_b = -1,

    PET = t_b - t_a + g d - h(g)

where h(g) is how far both together reach along g: their swept ways meet in a parallelogram, and this is the least of
arriving less leaving over its corners.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import kernel
from vidtrack.traffic.measures.bodies import Bodies, Encounters, touching_place

PET_S = 5.0
"""s; a longer post-encroachment time is no conflict (FHWA-HRT-08-050, the default of SSAM)"""
CROSSING_RAD = np.radians(30)
"""Vehicles whose headings differ less follow each other (SSAM: rear-end)"""
_FOLLOWS = float(np.cos(CROSSING_RAD))
_CELL_M = 4.0
_ROUNDING_S = 1e-6
_SURE = 2.0
"""Standard deviations of a time that must be less than PET_S: where ways are almost parallel nobody knows where they
cross"""
_SLOWEST = 0.5
"""m/s; for when a vehicle that is about to stand leaves or comes, since it does not go on with that speed"""


def encroachments(bodies: Bodies) -> Encounters:
    """The least post-encroachment time of each two vehicles, of at most PET_S.

    bodies  (N,) in order of time; the moment is when the second vehicle comes
    """
    bodies = bodies.only(_by_track(bodies.track))
    stay, turned = _stays(bodies)
    one, other = _soon_after(bodies, stay, turned)
    i, j = _nearest(stay[one], stay[other], bodies.t, bodies.xy, bodies.ahead, bodies.sides)
    i, j = i[i >= 0], j[i >= 0]
    late = bodies.t[i] > bodies.t[j]
    i, j = np.where(late, j, i), np.where(late, i, j)
    found = _details(bodies, i, j)
    least = found.least()
    least = least[_SURE * found.sigma[least] < PET_S]
    follows = _follows(i[least], j[least], bodies.track, bodies.t, bodies.xy, bodies.ahead, bodies.sides)
    return found.only(least[~follows])


def _stays(bodies: Bodies) -> tuple[Ints, Floats]:
    """(S, 3) cell, first and last row of each stay of a vehicle in a cell, in order of cells and time, and (S,) by
    how much it turned there [rad].

    bodies  in order of tracks and time
    """
    cells = _cells(bodies.xy, bodies.ahead, bodies.sides)
    size = max(2 * len(bodies), 64)
    stay, turned = np.empty((size, 3), np.int64), np.empty(size)
    row, count = 0, 0
    while row < len(bodies):
        row, count = _enter(row, count, bodies.track, bodies.ahead, cells, stay, turned)
        if row < len(bodies):
            stay, turned = np.vstack([stay, np.empty_like(stay)]), np.append(turned, np.empty_like(turned))
    stay, turned = stay[:count], turned[:count]
    order = np.lexsort((bodies.t[stay[:, 1]], stay[:, 0]))
    return stay[order], np.arccos(np.clip(turned[order], -1, 1))


def _soon_after(bodies: Bodies, stay: Ints, turned: Floats) -> tuple[Ints, Ints]:
    """Pairs of stays in one cell of vehicles with other headings: the later one begins at most PET_S after the end of
    the other."""
    if len(stay) == 0:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    begin, end = bodies.t[stay[:, 1]], bodies.t[stay[:, 2]]
    apart = end.max() - begin.min() + 2 * PET_S
    axis = np.cumsum(np.diff(stay[:, 0], prepend=stay[0, 0]) != 0) * apart  # one axis for all cells
    count = np.searchsorted(axis + begin, axis + end + PET_S, side="right") - np.arange(len(stay)) - 1
    one = np.repeat(np.arange(len(stay)), count)
    other = np.arange(len(one)) - np.repeat(np.cumsum(count) - count, count) + one + 1
    a, b = stay[one, 1], stay[other, 1]
    between = np.arccos(np.clip(np.sum(bodies.ahead[a] * bodies.ahead[b], axis=1), -1, 1))
    crossing = (bodies.track[a] != bodies.track[b]) & (between + turned[one] + turned[other] >= CROSSING_RAD)
    return one[crossing], other[crossing]


def _details(bodies: Bodies, i: Ints, j: Ints) -> Encounters:
    """Encounters of overlapping rectangles, rows i and later j (E,)."""
    a, b = bodies.only(i), bodies.only(j)
    later = b.t - a.t
    g = _slowness(a, b)
    straight = later + np.sum(g * (b.xy - a.xy), axis=1) - a.half(g) - b.half(g)
    steps = _step(bodies, i, 1) + _step(bodies, j, -1)
    pet = np.clip(straight, np.maximum(later - steps, 0), later)
    sigma = np.sqrt(a.variance(g) + b.variance(g))
    return Encounters.at(a, b, pet, sigma, later, b.t, touching_place(a, b, a.ahead))


def _slowness(a: Bodies, b: Bodies) -> Floats:
    """(E, 2) g [s/m] with g v_a = g v_b = -1, for speeds of at least _SLOWEST."""
    va, vb = (np.maximum(np.linalg.norm(one.v, axis=1), _SLOWEST)[:, None] * one.ahead for one in (a, b))
    cross = va[:, 0] * vb[:, 1] - va[:, 1] * vb[:, 0]
    change = va - vb
    return np.column_stack([change[:, 1], -change[:, 0]]) / np.where(cross == 0, 1e-9, cross)[:, None]


def _step(bodies: Bodies, row: Ints, way: int) -> Floats:
    """(E,) s to the next row of the same track, or from the one before; 0 where there is none."""
    other = np.clip(row + way, 0, len(bodies) - 1)
    same = bodies.track[other] == bodies.track[row]
    return np.where(same, np.abs(bodies.t[other] - bodies.t[row]), 0.0)


@kernel
def _by_track(track: Ints) -> Ints:
    """(N,) rows in order of tracks, those of each as they come."""
    low = track.min() if len(track) else 0
    begin = np.zeros(track.max() - low + 2 if len(track) else 1, np.int64)
    for i in range(len(track)):
        begin[track[i] - low + 1] += 1
    begin = np.cumsum(begin)
    order = np.empty(len(track), np.int64)
    for i in range(len(track)):
        order[begin[track[i] - low]] = i
        begin[track[i] - low] += 1
    return order


@kernel
def _cells(xy: Floats, ahead: Floats, sides: Floats) -> Ints:
    """(N, 4) first and last cells, in x and y, that rectangles reach into: x0, y0, x1, y1."""
    cells = np.empty((len(xy), 4), np.int64)
    for i in range(len(xy)):
        along, across = abs(ahead[i, 0]), abs(ahead[i, 1])
        for axis in range(2):
            half = (sides[i, axis] * along + sides[i, 1 - axis] * across) / 2
            cells[i, axis] = np.floor((xy[i, axis] - half) / _CELL_M)
            cells[i, axis + 2] = np.floor((xy[i, axis] + half) / _CELL_M)
    return cells


@kernel
def _enter(
    row: int, count: int, track: Ints, ahead: Floats, cells: Ints, stay: Ints, turned: Floats
) -> tuple[int, int]:
    """Note the stays that begin at rows from `row` on until all are done or they need more room; the next row and stay.

    cells   (N, 4) as in `_cells`
    turned  the least cosine between the first heading in the cell and a later one
    """
    for i in range(row, len(track)):
        x0, y0, x1, y1 = cells[i, 0], cells[i, 1], cells[i, 2], cells[i, 3]
        if count + (x1 - x0 + 1) * (y1 - y0 + 1) > len(stay):
            return i, count
        old = i > 0 and track[i - 1] == track[i]
        for x in range(x0, x1 + 1):
            for y in range(y0, y1 + 1):
                if old and _in(x, y, cells, i - 1):
                    continue
                last, least = i, 1.0
                while last + 1 < len(track) and track[last + 1] == track[i] and _in(x, y, cells, last + 1):
                    last += 1
                    least = min(least, ahead[i, 0] * ahead[last, 0] + ahead[i, 1] * ahead[last, 1])
                stay[count, 0], stay[count, 1], stay[count, 2] = (x << 32) + y, i, last
                turned[count] = least
                count += 1
    return len(track), count


@kernel
def _in(x: int, y: int, cells: Ints, row: int) -> bool:
    return cells[row, 0] <= x <= cells[row, 2] and cells[row, 1] <= y <= cells[row, 3]


@kernel
def _nearest(one: Ints, other: Ints, t: Floats, xy: Floats, ahead: Floats, sides: Floats) -> tuple[Ints, Ints]:
    """For each pair of stays the two rows, nearest in time, whose rectangles overlap; -1 where there are none."""
    rows = np.full((2, len(one)), -1)
    for k in range(len(one)):
        best, low = PET_S, one[k, 1]
        for j in range(other[k, 1], other[k, 2] + 1):
            while low <= one[k, 2] and t[low] < t[j] - best:
                low += 1
            for i in range(low, one[k, 2] + 1):
                if t[i] > t[j] + best:
                    break
                if rows[0, k] >= 0 and abs(t[j] - t[i]) > best - _ROUNDING_S:
                    continue
                if _aligned(ahead[i], ahead[j]):
                    continue
                if _overlap(xy[j, 0] - xy[i, 0], xy[j, 1] - xy[i, 1], ahead[i], ahead[j], sides[i], sides[j]):
                    best = abs(t[j] - t[i])
                    rows[0, k], rows[1, k] = i, j
    return rows[0], rows[1]


@kernel
def _follows(first: Ints, second: Ints, track: Ints, t: Floats, xy: Floats, ahead: Floats, sides: Floats) -> Mask:
    """(E,) whether the vehicle of row `second`, a length earlier, is on the way of that of row `first` already."""
    follows = np.zeros(len(first), np.bool_)
    for k in range(len(first)):
        i, j = first[k], second[k]
        at, length = j, sides[j, 0]
        while at > 0 and track[at - 1] == track[j] and np.hypot(xy[at, 0] - xy[j, 0], xy[at, 1] - xy[j, 1]) < length:
            at -= 1
        while i > 0 and track[i - 1] == track[i] and t[i - 1] > t[at] - PET_S:
            i -= 1
        while i < len(t) and track[i] == track[first[k]] and t[i] < t[at] + PET_S and not follows[k]:
            if _aligned(ahead[i], ahead[at]):
                dx, dy = xy[at, 0] - xy[i, 0], xy[at, 1] - xy[i, 1]
                follows[k] = _overlap(dx, dy, ahead[i], ahead[at], sides[i], sides[at])
            i += 1
    return follows


@kernel
def _aligned(e: Floats, other: Floats) -> bool:
    return e[0] * other[0] + e[1] * other[1] > _FOLLOWS


@kernel
def _overlap(dx: float, dy: float, ahead_i: Floats, ahead_j: Floats, sides_i: Floats, sides_j: Floats) -> bool:
    """Whether two rectangles overlap: along the normal of every edge."""
    cos = abs(ahead_i[0] * ahead_j[0] + ahead_i[1] * ahead_j[1])
    sin = abs(ahead_i[0] * ahead_j[1] - ahead_i[1] * ahead_j[0])
    for e, own, others in ((ahead_i, sides_i, sides_j), (ahead_j, sides_j, sides_i)):
        along, across = abs(dx * e[0] + dy * e[1]), abs(dx * e[1] - dy * e[0])
        if 2 * along > own[0] + others[0] * cos + others[1] * sin:
            return False
        if 2 * across > own[1] + others[0] * sin + others[1] * cos:
            return False
    return True
