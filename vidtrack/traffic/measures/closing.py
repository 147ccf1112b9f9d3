"""Time to collision: when two vehicles would touch if both went on with the velocities that they have.

Hayward: Near-miss determination through use of a scale of danger, Highway Research Record 384 (1972). Vehicles are
rectangles that do not turn. Along each normal n of an edge of either one, with d between the middles, w the relative
velocity and h(n) how far both together reach, they overlap while |n d + t n w| < h(n). They touch when the last of the
four overlaps begins, at

    t = (|n d| - h(n)) / |n w|

if none of the others has ended by then. Its variance is that of n d - h(n) + t n w, over (n w)^2.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import inlined, kernel
from vidtrack.traffic.measures.bodies import (
    EX,
    EY,
    LENGTH,
    SPEED_SIGMA,
    VX,
    VY,
    WIDTH,
    Bodies,
    Encounters,
    T,
    X,
    Y,
    least_of,
    pairs,
    touching_place,
)

TTC_S = 1.5
"""s; a longer time to collision is no conflict (FHWA-HRT-08-050, the default of SSAM)"""
_SURE = 2.0
"""Standard deviations by which a closing speed must differ from 0: else vehicles that stand would collide"""
_STILL_M_S = 1e-9
"""m/s; of an edge as the other vehicle sees it, below which only rounding moves it"""


def closing(bodies: Bodies) -> Encounters:
    """The least time to collision of each two vehicles, of at most TTC_S, in rows of whole moments.

    Moments at which two rectangles overlap give none: vehicles do not, so it is their error. The vehicle ahead in the
    direction of both together is `first`.
    """
    order = _in_order(bodies.table)
    size = max(len(bodies), 64)
    who, found = np.empty((size, 2), np.int64), np.empty((size, 3))
    row, count = 0, 0
    while row < len(bodies):
        row, count = _look(row, count, order, bodies.table, who, found)
        if row < len(bodies):
            who, found = np.vstack([who, np.empty_like(who)]), np.vstack([found, np.empty_like(found)])
    return _least(bodies, who[:count], found[:count])


def _least(bodies: Bodies, who: Ints, found: Floats) -> Encounters:
    """Of rows (M, 2) with times to collision and normals (M, 3) the least of each two vehicles."""
    first = least_of(pairs(*bodies.track[who].T), found[:, 0])
    who, (ttc, *n) = who[first], found[first].T
    behind = np.sum((bodies.xy[who[:, 1]] - bodies.xy[who[:, 0]]) * bodies.v[who].sum(axis=1), axis=1) > 0
    who[behind] = who[behind, ::-1]
    a, b, normal = bodies.only(who[:, 0]), bodies.only(who[:, 1]), np.column_stack(n)
    rate = np.sum((b.v - a.v) * normal, axis=1)
    drift = (ttc * np.hypot(a.table[:, SPEED_SIGMA], b.table[:, SPEED_SIGMA])) ** 2
    sigma = np.sqrt(a.variance(normal) + b.variance(normal) + drift) / np.abs(rate)
    return Encounters.at(a, b, ttc, sigma, ttc, a.t, touching_place(a.after(ttc), b.after(ttc), normal))


@kernel
def _in_order(table: Floats) -> Ints:
    """(N,) rows in order of time, and those of one moment in order of x: few, so each is put where it belongs."""
    order = np.empty(len(table), np.int64)
    for i in range(len(table)):
        place = i
        while place > 0 and table[order[place - 1], T] == table[i, T] and table[order[place - 1], X] > table[i, X]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = i
    return order


@kernel
def _look(row: int, count: int, order: Ints, table: Floats, who: Ints, found: Floats) -> tuple[int, int]:
    """Look at rows in `order` (of time, then of x) with those after them at the same moment, until all are done or
    the pairs need more room; the next row and pair.

    who, found   the pairs: (M, 2) rows; (M, 3) time to collision and the normal along which they touch
    """
    fastest, longest = 0.0, 0.0
    reach = np.empty(len(table))  # of the circles around the rectangles
    for i in range(len(table)):
        reach[i] = np.sqrt(table[i, LENGTH] ** 2 + table[i, WIDTH] ** 2) / 2
        fastest = max(fastest, table[i, VX] ** 2 + table[i, VY] ** 2)
        longest = max(longest, reach[i])
    fastest = np.sqrt(fastest)
    for first in range(row, len(order)):
        i, begun = order[first], count
        t, x, y, vx, vy = table[i, T], table[i, X], table[i, Y], table[i, VX], table[i, VY]
        widest = TTC_S * (np.sqrt(vx * vx + vy * vy) + fastest) + reach[i] + longest
        for later in range(first + 1, len(order)):
            j = order[later]
            dx = table[j, X] - x
            if table[j, T] != t or dx > widest:
                break
            dy, wx, wy = table[j, Y] - y, table[j, VX] - vx, table[j, VY] - vy
            far, nearing, w2 = dx * dx + dy * dy, -dx * wx - dy * wy, wx * wx + wy * wy
            near = (reach[i] + reach[j]) ** 2
            if far > near and (nearing <= 0 or (far - near) * w2 > nearing * nearing):
                continue  # the circles around them never meet
            if nearing > TTC_S * w2 and far - 2 * TTC_S * nearing + TTC_S**2 * w2 > near:
                continue  # they near each other still after TTC_S, and have not met
            ttc, nx, ny = _touch(dx, dy, wx, wy, table, i, j)
            if ttc > TTC_S or abs(nx * wx + ny * wy) < _SURE * np.hypot(table[i, SPEED_SIGMA], table[j, SPEED_SIGMA]):
                continue
            if count == len(who):
                return first, begun
            who[count, 0], who[count, 1] = i, j
            found[count, 0], found[count, 1], found[count, 2] = ttc, nx, ny
            count += 1
    return len(order), count


@inlined
def _touch(dx: float, dy: float, wx: float, wy: float, table: Floats, i: int, j: int) -> tuple[float, float, float]:
    """Time until rectangles i and j touch, inf if they never do or overlap already, and the normal along which they do.

    Between their middles lies (dx, dy), and j moves with (wx, wy) as i sees it.
    """
    begin, end, nx, ny = -np.inf, np.inf, 0.0, 0.0
    apart = False
    for side in range(4):
        own = i if side < 2 else j
        x, y = (table[own, EX], table[own, EY]) if side % 2 == 0 else (-table[own, EY], table[own, EX])
        half = 0.0
        for its in (i, j):
            ex, ey = table[its, EX], table[its, EY]
            half += abs(ex * x + ey * y) * table[its, LENGTH] / 2 + abs(ex * y - ey * x) * table[its, WIDTH] / 2
        d, rate = dx * x + dy * y, wx * x + wy * y
        apart |= abs(d) > half
        if abs(rate) < _STILL_M_S:
            if abs(d) > half:
                return np.inf, 0.0, 0.0
            continue
        middle, span = -d / rate, half / abs(rate)
        if middle - span > begin:
            begin, nx, ny = middle - span, x, y
        end = min(end, middle + span)
    if not apart or begin > end or begin < 0:
        return np.inf, 0.0, 0.0
    return begin, nx, ny
