"""Fits a cuboid of constant size on a smooth path to the boxes of a track.

The unknowns are the middle of the footprint at each knot p_k, and for the whole track the length, width and height of
the vehicle and by how much its boxes are too wide (px). The sum of squares has, each over its variance,

    edges of the boxes - edges of the cuboid             by `cuboid.box_edges`; weights of Student's t for edges far off
    (p_k+1 - p_k) / h_k - (p_k - p_k-1) / h_k-1          the velocity is a random walk, with variance JOLT per second
    size - what vehicles are like                        wide: classes are told apart afterwards

By Gauss and Newton: the p_k are coupled to two neighbours on either side, so their normal matrix is a band; they
are eliminated first, from the equations of the four numbers of the whole track (`band`). The vehicle heads along its
path.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import inlined, kernel
from vidtrack.traffic.vehicles.band import (
    BAND,
    SIZE,
    eliminate,
    factor,
    invert,
    move_path,
    product,
    solve_back,
    solve_one,
)
from vidtrack.traffic.vehicles.cuboid import box_edges

MEAN, SIGMA = np.array([4.6, 1.9, 1.9, 0.0]), np.array([4.0, 1.0, 1.2, 1.0])
"""The size as it is known beforehand."""
_LEAST = np.array([0.3, 0.3, 0.5, -5.0])
_JOLT = 1.0
"""m2/s3; by how much the variance of a velocity grows in a second"""
_WALK, _WALK_BENDS = 0.3, 0.5
"""Variance of the velocity's walk, in units of _JOLT, that is expected, and how many bends of the path that is worth"""
_NEAR = 4
"""Steps on either side, that of the speed among them, whose bends tell how far the velocity walks there"""
_EDGE_PX, _ROW_PX = 0.4, 1.8
"""px; standard deviation of the edges of a knot, and that of one row which goes down with their number"""
_SHAPE_M = np.array([0.10, 0.30, 0.10, 0.06])
"""m; by which a vehicle's outline is no cuboid's: left, top, right, bottom"""
_FREEDOM = 4.0
"""of Student's t"""
_FAR, _FAR_SHARE = 3.0, 0.2
"""Standard deviations by which an edge is far off; where more than a share are, the track is not of one vehicle."""
_COARSE = (10.0, 3.0, 1.0, 1.0, 1.0)
"""Factors of the standard deviations in the rounds: what is far off loses its weight only when the path is known."""
_STILL_M = 0.01
"""m; once a round moves nothing by more, the next one changes no speed by more than some mm/s"""
_HEADING_M = 4.0
"""m of path that a heading is taken from"""
_DRIFT = 0.006
"""Standard deviation of a speed, as a share, because shadows and corners that come into view move the edges along: the
errors of the vehicles of one site lean to one side by as much"""
_WALKER_M, _GAIT_M_S = 1.2, 0.1
"""m and m/s; who is no longer walks: legs and arms move the edges to and fro"""
_ROUNDING_M = 1.2
"""m; a body is no cuboid. As it turns, the points that its edges rest on move along it by as much in a radian"""
_LEAST_MISFIT = 0.05
"""Of noise as it is stated above: it is not taken to be less, however well a short track fits."""
_LEAST_KNOTS, _LEAST_PATH_M, _SPEED_KNOTS = 3, 2.0, 4
"""For a size; a speed needs more."""


@kernel
def fit(
    first: Ints, t: Floats, edge: Floats, rows: Floats, start: Floats, G: Floats, up: Floats,
    asked_of: Ints, asked: Floats, path: Floats, size: Floats, cov: Floats, quality: Floats, speed: Floats,
) -> None:  # fmt: skip
    """Fit T tracks of K knots.

    first (T + 1,), t (K,), edge (K, 4), rows (K,) as in `Knots`, edges straightened; start (K, 2) m rough places
    G (3, 3), up (3,) as in `cuboid`
    asked_of (T + 1,) where the times of each track begin among those at which speeds are asked for, asked (W,) s

    Writes path (K, 2), size (T, SIZE), cov (T, SIZE, SIZE), NaN for those that are too short; speed (W, 6): metres per
    second and standard deviation, the velocity's direction (2,), the numbers of the two knots around that time.
    """
    most = 0
    for i in range(len(first) - 1):
        most = max(most, first[i + 1] - first[i])
    band, right = np.empty((2 * most, BAND + 1)), np.empty((2 * most, SIZE + 1))
    heading, whole, rest = np.empty((most, 2)), np.empty((SIZE, SIZE)), np.empty(SIZE)
    for i in range(len(first) - 1):
        a, b = first[i], first[i + 1]
        size[i], cov[i], quality[i] = np.nan, np.nan, np.nan
        speed[asked_of[i] : asked_of[i + 1]] = np.nan
        for k in range(a, b):
            path[k, 0], path[k, 1] = start[k, 0], start[k, 1]
        driven = np.hypot(start[b - 1, 0] - start[a, 0], start[b - 1, 1] - start[a, 1]) if b > a else 0.0
        if b - a < _LEAST_KNOTS or not driven > _LEAST_PATH_M:
            continue
        for s in range(SIZE):
            size[i, s] = MEAN[s]
        n = 2 * (b - a)
        misfit = strange = 0.0
        for coarse in _COARSE:
            _headings(path[a:b], heading)
            misfit, strange = _normal(t[a:b], edge[a:b], rows[a:b], path[a:b], heading, size[i], G, up, coarse,
                                      band[:n], right[:n], whole, rest)  # fmt: skip
            factor(band[:n], right[:n])
            eliminate(right[:n], whole, rest)
            invert(whole, cov[i])
            step = np.maximum(product(cov[i], rest), _LEAST - size[i])
            size[i] += step
            moved = max(np.abs(step).max(), move_path(band[:n], right[:n], step, path[a:b]))
            if coarse == 1.0 and moved < _STILL_M:
                break
        quality[i] = max(misfit, _LEAST_MISFIT)
        if strange > _FAR_SHARE:
            size[i], cov[i], quality[i] = np.nan, np.nan, np.nan
            continue
        if b - a < _SPEED_KNOTS or asked_of[i] == asked_of[i + 1]:
            continue
        solve_back(band[:n], right[:n])
        for w in range(asked_of[i], asked_of[i + 1]):
            _speed(t[a:b], path[a:b], asked[w], band[:n], right[:n], size[i], cov[i], quality[i], speed[w])
            speed[w, 4] += a
            speed[w, 5] += a


@kernel
def _headings(path: Floats, heading: Floats) -> None:
    """Write unit vectors (K, 2) along a path (K, 2), over some metres of it."""
    last = len(path) - 1
    for k in range(last + 1):
        i, j = k, k
        while True:
            dx, dy = path[j, 0] - path[i, 0], path[j, 1] - path[i, 1]
            if dx * dx + dy * dy >= _HEADING_M**2 or (i == 0 and j == last):
                break
            i, j = max(i - 1, 0), min(j + 1, last)
        far = max(np.hypot(dx, dy), 1e-9)
        heading[k, 0], heading[k, 1] = dx / far, dy / far


@kernel
def _normal(
    t: Floats, edge: Floats, rows: Floats, path: Floats, heading: Floats, size: Floats, G: Floats, up: Floats,
    coarse: float, band: Floats, right: Floats, whole: Floats, rest: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Write the normal equations: of the path band (2 K, BAND + 1) and, with its coupling to the size and its right
    side, right (2 K, SIZE + 1); of the size whole (SIZE, SIZE) and rest (SIZE,).

    Returns the misfit, 1 where the noise is as stated, and the share of edges that are far off.
    """
    band[:], right[:], whole[:], rest[:] = 0.0, 0.0, 0.0, 0.0
    state, ahead, model, by_state = np.empty(5), np.empty(2), np.empty(4), np.zeros((4, 5))
    # derivatives of each side's residual: by x, by y, by the size; then the residual. And the same, weighted
    by, weighted = np.empty((SIZE + 3, 4)), np.empty((SIZE + 2, 4))
    total, strange, count = 0.0, 0, 0
    for s in range(SIZE):
        whole[s, s] = 1 / SIGMA[s] ** 2
        rest[s] = (MEAN[s] - size[s]) / SIGMA[s] ** 2
    state[2], state[3], state[4] = size[0], size[1], size[2]
    for k in range(len(t)):
        state[0], state[1], ahead[0], ahead[1] = path[k, 0], path[k, 1], heading[k, 0], heading[k, 1]
        scale = box_edges(G, up, state, ahead, model, by_state)
        row, noise = 2 * k, _EDGE_PX**2 + _ROW_PX**2 / rows[k]
        for side in range(4):
            sign = -1.0 if side < 2 else 1.0
            residual = edge[k, side] - model[side] - sign * size[3]
            if np.isnan(residual):
                by[:, side], weighted[:, side] = 0.0, 0.0
                continue
            variance = (noise + (_SHAPE_M[side] * scale) ** 2) * coarse**2
            square = residual * residual
            weight = (_FREEDOM + 1) / (_FREEDOM * variance + square)
            total += weight * square
            strange += square > _FAR**2 * variance
            count += 1
            for i in range(5):
                by[i, side], weighted[i, side] = by_state[side, i], weight * by_state[side, i]
            by[5, side], by[6, side], weighted[5, side] = sign, residual, weight * sign
        band[row, 0] += _dot(weighted, 0, by, 0)
        band[row + 1, 1] += _dot(weighted, 1, by, 0)
        band[row + 1, 0] += _dot(weighted, 1, by, 1)
        for s in range(SIZE + 1):
            right[row, s] += _dot(weighted, 0, by, 2 + s)
            right[row + 1, s] += _dot(weighted, 1, by, 2 + s)
        for s in range(SIZE):
            for r in range(s, SIZE):
                whole[s, r] += _dot(weighted, 2 + s, by, 2 + r)
            rest[s] += _dot(weighted, 2 + s, by, 6)
    for s in range(SIZE):
        for r in range(s):
            whole[s, r] = whole[r, s]
    c = np.empty(3)
    for k in range(1, len(t) - 1):
        _bending(t, k, c)
        for axis in range(2):
            bend = c[0] * path[k - 1, axis] + c[1] * path[k, axis] + c[2] * path[k + 1, axis]
            for i in range(3):
                for j in range(i + 1):
                    band[2 * (k - 1 + i) + axis, 2 * (i - j)] += c[i] * c[j]
                right[2 * (k - 1 + i) + axis, SIZE] -= c[i] * bend
    return total / max(count, 1), strange / max(count, 1)


@inlined
def _dot(a: Floats, i: int, b: Floats, j: int) -> float:
    """Product of two rows (4,)."""
    return a[i, 0] * b[j, 0] + a[i, 1] * b[j, 1] + a[i, 2] * b[j, 2] + a[i, 3] * b[j, 3]


@inlined
def _bending(t: Floats, k: int, c: Floats) -> None:
    """Write the factors (3,) of the places k - 1, k, k + 1 in the change of velocity there, in standard deviations."""
    before, after = t[k] - t[k - 1], t[k + 1] - t[k]
    root = np.sqrt(2 / (_JOLT * (before + after)))
    c[0], c[1], c[2] = root / before, -root / before - root / after, root / after


@kernel
def _respond(band: Floats, right: Floats, cov: Floats, a: Floats) -> None:
    """Solve for one right side a (n,) of the path, together with the size, in place: the path's share."""
    by_size = np.zeros(SIZE)
    for r in range(len(a)):
        for s in range(SIZE):
            by_size[s] -= a[r] * right[r, s]
    solve_one(band, a)
    size = product(cov, by_size)
    for r in range(len(a)):
        for s in range(SIZE):
            a[r] -= right[r, s] * size[s]


@kernel
def _variances(band: Floats, right: Floats, cov: Floats, a: Floats, begin: int) -> Floats:
    """(2 _NEAR,) variances of a' path, for noise and walk as they are stated above; a (n, 2 _NEAR) is 0 before row
    `begin`, and lost."""
    by_size, total = np.zeros((SIZE, 2 * _NEAR)), np.zeros(2 * _NEAR)
    for r in range(begin, len(a)):
        for s in range(SIZE):
            for m in range(2 * _NEAR):
                by_size[s, m] -= a[r, m] * right[r, s]
        for d in range(1, min(r - begin, BAND) + 1):
            for m in range(2 * _NEAR):
                a[r, m] -= band[r, d] * a[r - d, m]
        for m in range(2 * _NEAR):
            a[r, m] *= band[r, 0]
            total[m] += a[r, m] ** 2
    for s in range(SIZE):
        for q in range(SIZE):
            for m in range(2 * _NEAR):
                total[m] += by_size[s, m] * cov[s, q] * by_size[q, m]
    return total


@kernel
def _speed(
    t: Floats, path: Floats, asked: float, band: Floats, right: Floats, size: Floats, cov: Floats, misfit: float,
    speed: Floats,
) -> None:  # fmt: skip
    """Write the slope of the path at a time, and its error (6,)."""
    if not t[0] <= asked <= t[-1]:
        return
    j = 1
    while t[j] < asked:
        j += 1
    i = j - 1
    h = t[j] - t[i]
    vx, vy = (path[j, 0] - path[i, 0]) / h, (path[j, 1] - path[i, 1]) / h
    v = np.hypot(vx, vy)
    ex, ey = vx / max(v, 1e-9), vy / max(v, 1e-9)
    a = np.zeros(len(band))
    a[2 * j], a[2 * j + 1], a[2 * i], a[2 * i + 1] = ex / h, ey / h, -ex / h, -ey / h
    _respond(band, right, cov, a)
    variance = (ex * (a[2 * j] - a[2 * i]) + ey * (a[2 * j + 1] - a[2 * i + 1])) / h
    walked, c = 0.0, np.empty(3)
    for k in range(1, len(t) - 1):
        _bending(t, k, c)
        for axis in range(2):
            r = 2 * k + axis
            walked += (c[0] * a[r - 2] + c[1] * a[r] + c[2] * a[r + 2]) ** 2
    variance = (variance - walked) * misfit + walked * _walk(t, path, i, ex, ey, band, right, cov)
    variance += (_DRIFT * v) ** 2 + (_ROUNDING_M * _turning(t, path, i, j)) ** 2
    if size[0] < _WALKER_M:
        variance += _GAIT_M_S**2
    speed[0], speed[1], speed[2], speed[3], speed[4], speed[5] = v, np.sqrt(variance), ex, ey, i, j


@kernel
def _walk(t: Floats, path: Floats, i: int, ex: float, ey: float, band: Floats, right: Floats, cov: Floats) -> float:
    """Variance of the velocity's walk along (ex, ey) near the step from i, in units of _JOLT, by the bends of the path.

    Of the square of each bend 1 - leverage is left by the fit, and so much of a degree of freedom it is worth. Where
    edges are drawn along by something else for some tenths of a second, the path follows them, and bends.
    """
    c, squares, freedom = np.empty(3), _WALK * _WALK_BENDS, _WALK_BENDS
    a, first, end = np.zeros((len(band), 2 * _NEAR)), max(i + 1 - _NEAR, 1), min(i + _NEAR, len(t) - 2) + 1
    for k in range(first, end):
        _bending(t, k, c)
        bend = 0.0
        for m in range(3):
            at = k - 1 + m
            bend += c[m] * (path[at, 0] * ex + path[at, 1] * ey)
            a[2 * at, k - first], a[2 * at + 1, k - first] = c[m] * ex, c[m] * ey
        squares += bend**2
    leverage = _variances(band, right, cov, a, 2 * first - 2)
    for m in range(end - first):
        freedom += max(1 - leverage[m], 0.0)
    return squares / freedom


@kernel
def _turning(t: Floats, path: Floats, i: int, j: int) -> float:
    """rad/s; by how much the path turns around the step from i to j."""
    a, b = max(i - 1, 0), min(j + 1, len(t) - 1)
    if a == i or b == j:
        return 0.0
    before = np.arctan2(path[i, 1] - path[a, 1], path[i, 0] - path[a, 0])
    after = np.arctan2(path[b, 1] - path[j, 1], path[b, 0] - path[j, 0])
    return ((after - before + np.pi) % (2 * np.pi) - np.pi) / ((t[b] + t[j] - t[i] - t[a]) / 2)
