"""Tracks are broken into stretches where their motion on the road cannot be that of one vehicle.

Where vehicles meet in one blob, or one hides the other, a track may go on as the other vehicle. A Kalman filter of
nearly constant velocity follows each track through the rows in which the picture shows it alone. Again and again
another filter begins, also after rows that the track shared, and where a row is far from the prediction. If its state
after _CHECK_S is not where the first one led to when it began, the rest of the track is another stretch: of which
vehicle is decided by `joins`.

The noise of the two axes is the same and independent, so a filter has six numbers beside its time: position,
velocity, and for each axis the variances of both and their covariance. Errors of footprints last, so the variance of
the last row is added where two states are compared.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vidtrack.arrays.rows import make_room
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import inlined, kernel
from vidtrack.traffic.lengths import add_lengths, mean_length
from vidtrack.traffic.measures.rows import Rows

_PLACE_M = 0.3
"""m; standard deviation of a position beside its stated one"""
_FIRST_M_S = 15.0
"""m/s; of a velocity before the second row"""
STANDING_JOLT, JOLT_PER_M_S = 1.0, 0.3
"""m2/s3 and m/s2; by how much the variance of a velocity grows in a second, at rest and with the speed"""
_PAUSE_S = 0.15
"""s; after so long in a shared blob all checks begin anew"""
_CHECKS, _CHECK_S, _CHECK_ROWS = 3, 0.6, 4
"""Checks that go on at a time, one begun after the other; s and rows that each takes"""
_FAR = 25.0
"""Squared distance beyond which a row is of something else"""
_OTHER = 30.0
"""Squared distance of two states, beyond which they are of two vehicles: of one, one in 200,000"""
MODEL_M_S = 1.0
"""m/s; standard deviation of the difference of two velocities beside what they say"""
T, X, Y, VX, VY, PXX, PXV, PVV, LASTING = range(9)
_STATES = 1 + 2 * _CHECKS
"""of a track"""


@dataclass(frozen=True, slots=True, eq=False)
class End:
    """The first or the last state of T stretches; NaN where there was none.

    t (T,) s; xy (T, 2), v (T, 2) in the unit of positions, and of it per second
    spread (T, 3) of each axis: variance of position, covariance with velocity, variance of velocity
    """

    t: Floats
    xy: Floats
    v: Floats
    spread: Floats

    def only(self, who: Ints) -> End:
        """The states of some stretches."""
        return End(self.t[who], self.xy[who], self.v[who], self.spread[who])

    def after(self, seconds: Floats) -> End:
        """The state (T,) s later, or earlier where negative, at the same velocity."""
        xx, xv, vv = self.spread.T
        spread = np.column_stack([xx + 2 * seconds * xv + seconds**2 * vv, xv + seconds * vv, vv])
        return replace(self, t=self.t + seconds, xy=self.xy + seconds[:, None] * self.v, spread=spread)


@dataclass(frozen=True, slots=True, eq=False)
class Lives:
    """What is left of T stretches when their rows have gone by.

    head, tail   where they began and ended, seen alone
    length, length_sigma   (T,) m; the mean of the rows, as `mean_length` has it, NaN where it is not known
    track        (T,) number of the track
    until        (T,) s; what the track did afterwards is of nobody; inf: it was not broken
    """

    head: End
    tail: End
    length: Floats
    length_sigma: Floats
    track: Ints
    until: Floats


class Stretches:
    """Takes blocks of rows in order of time. `metres`: positions are on the road; else tracks stay whole."""

    def __init__(self, metres: bool) -> None:
        self._metres = metres
        self._state = np.full((0, 9), np.nan)
        self._since = np.full((0, 2 + 2 * _CHECKS), np.nan)
        self._current = np.empty(0, np.int64)
        self._head, self._tail = np.empty((0, 9)), np.empty((0, 9))
        self._track, self._until = np.empty(0, np.int64), np.empty(0)
        self._sums = np.zeros((0, 4))
        self._count = 0

    def add(self, rows: Rows) -> Rows:
        """The same rows, with the numbers of stretches as those of tracks."""
        if len(rows) == 0:
            return rows
        self._make_room(int(rows.track.max()) + 1, len(rows))
        number = np.empty(len(rows), np.int64)
        self._count = _follow(
            rows.track, rows.t, rows.xy, rows.sigma, rows.seen, rows.merged, self._metres, self._state,
            self._since, self._current, self._head, self._tail, self._track, self._until, number, self._count,
        )  # fmt: skip
        add_lengths(self._sums, number, rows.length, rows.length_sigma, rows.hidden)
        return replace(rows, track=number)

    def lives(self) -> Lives:
        """Of all stretches so far."""
        n = self._count
        ends = _end(self._head[:n]), _end(self._tail[:n])
        return Lives(*ends, *mean_length(self._sums[:n]), self._track[:n].copy(), self._until[:n].copy())

    def _make_room(self, tracks: int, rows: int) -> None:
        """For tracks (K), and for as many stretches as these rows can begin."""
        make_room(self._state, tracks * _STATES, np.nan)
        make_room(self._since, tracks, np.nan)
        make_room(self._current, tracks, -1)
        stretches = self._count + rows
        make_room(self._head, stretches, np.nan)
        make_room(self._tail, stretches, np.nan)
        make_room(self._track, stretches, -1)
        make_room(self._until, stretches, np.inf)
        make_room(self._sums, stretches, 0.0)


def _end(states: Floats) -> End:
    spread = np.column_stack([states[:, PXX] + states[:, LASTING], states[:, PXV : PVV + 1]])
    return End(states[:, T].copy(), states[:, X : Y + 1].copy(), states[:, VX : VY + 1].copy(), spread)


@kernel
def _follow(
    track: Ints, t: Floats, xy: Floats, sigma: Floats, seen: Mask, merged: Mask, metres: bool, state: Floats,
    since: Floats, current: Ints, head: Floats, tail: Floats, of_track: Ints, until: Floats, number: Ints, count: int,
) -> int:  # fmt: skip
    """Number rows by stretches; returns how many there are.

    t, xy, sigma, seen, merged   (N, ...) as in `Rows`
    state   (K * _STATES, 9) of each track the long filter, then for each check what this was when the check began, and
            the filter that began with it
    since   (K, 2 + 2 _CHECKS) when the long filter began, and 1 after rows in which the track was not alone; then of
            each check when it began (NaN: it has not) and how many rows it has

    States are passed on as a table and a row in it: an array of each would be made anew for every row.
    """
    begun = np.empty((1, 9))
    for i in range(len(track)):
        k, now = track[i], t[i]
        if current[k] < 0:
            current[k] = count
            of_track[count] = k
            count += 1
        mine = current[k]
        number[i] = mine
        x, y, first = xy[i, 0], xy[i, 1], k * _STATES
        if not seen[i] or (metres and merged[i]) or np.isnan(x):
            since[k, 1] = 1
            continue
        spread = sigma[i] * sigma[i] + _PLACE_M**2
        new = np.isnan(state[first, T])
        if new or not metres:
            _begin(state, first, now, x, y, spread)
            _copy(state, first, tail, mine)
            if new:
                _copy(state, first, head, mine)
                since[k, 0], since[k, 1] = now, 0
            continue
        shared = since[k, 1] == 1 and now - state[first, T] > _PAUSE_S
        since[k, 1] = 0
        latest = -np.inf
        for c in range(_CHECKS):
            if shared:
                since[k, 2 + 2 * c] = np.nan
            elif since[k, 2 + 2 * c] > latest:
                latest = since[k, 2 + 2 * c]
        broken = -1
        for c in range(_CHECKS):
            before, after, began = first + 1 + 2 * c, first + 2 + 2 * c, since[k, 2 + 2 * c]
            if np.isnan(began):
                if now - latest < _CHECK_S / _CHECKS:
                    continue
                latest = now
            elif _step(state, after, now, x, y, spread) <= _FAR:
                since[k, 3 + 2 * c] += 1
                if now - began < _CHECK_S or since[k, 3 + 2 * c] < _CHECK_ROWS:
                    continue
                _write_back(state, after, began, begun, 0)
                if _apart(state, before, begun, 0) > _OTHER:
                    broken = c
                    break
                if state[first, T] <= began:
                    _copy(state, after, state, first)  # which all these rows were far from, until now
                since[k, 2 + 2 * c] = np.nan
                continue
            _copy(state, first, state, before)
            _begin(state, after, now, x, y, spread)
            since[k, 2 + 2 * c], since[k, 3 + 2 * c] = now, 1
        if broken >= 0:
            begin = since[k, 2 + 2 * broken]
            _copy(state, first + 1 + 2 * broken, tail, mine)
            _copy(state, first + 2 + 2 * broken, state, first)
            until[mine] = tail[mine, T]
            _renumber(track, t, number, i, k, begin, count)
            current[k] = count
            of_track[count] = k
            _copy(begun, 0, head, count)
            _copy(state, first, tail, count)
            count += 1
            since[k, 0] = begin
            since[k, 2:] = np.nan
        elif state[first, T] == now or _step(state, first, now, x, y, spread) <= _FAR:
            _copy(state, first, tail, mine)
            if now - since[k, 0] <= _CHECK_S:
                _write_back(state, first, since[k, 0], head, mine)
    return count


@inlined
def _copy(source: Floats, i: int, to: Floats, j: int) -> None:
    """Write the state in a row of one table into a row of another."""
    for column in range(9):
        to[j, column] = source[i, column]


@inlined
def _begin(state: Floats, i: int, t: float, x: float, y: float, variance: float) -> None:
    """Write the state of a vehicle of which one row is known."""
    state[i, T], state[i, X], state[i, Y], state[i, VX], state[i, VY] = t, x, y, 0.0, 0.0
    state[i, PXX], state[i, PXV], state[i, PVV], state[i, LASTING] = variance, 0.0, _FIRST_M_S**2, variance


@inlined
def _ahead(state: Floats, i: int, t: float) -> tuple[float, float, float, float, float]:
    """Position, and the variances of each axis, at a later time."""
    dt, vx, vy = t - state[i, T], state[i, VX], state[i, VY]
    jolt = STANDING_JOLT + JOLT_PER_M_S * np.sqrt(vx * vx + vy * vy)
    xx = state[i, PXX] + 2 * dt * state[i, PXV] + dt * dt * state[i, PVV] + jolt * dt**3 / 3
    xv = state[i, PXV] + dt * state[i, PVV] + jolt * dt**2 / 2
    return state[i, X] + dt * vx, state[i, Y] + dt * vy, xx, xv, state[i, PVV] + jolt * dt


@inlined
def _step(state: Floats, i: int, t: float, x: float, y: float, variance: float) -> float:
    """Predict and update with a row, unless it is far off; returns its squared distance."""
    px, py, xx, xv, vv = _ahead(state, i, t)
    dx, dy, weight = x - px, y - py, 1 / (xx + variance)
    distance = (dx * dx + dy * dy) * weight
    if distance <= _FAR:
        place, pace = xx * weight, xv * weight
        state[i, T], state[i, X], state[i, Y] = t, px + place * dx, py + place * dy
        state[i, VX] += pace * dx
        state[i, VY] += pace * dy
        state[i, PXX], state[i, PXV], state[i, PVV] = (1 - place) * xx, (1 - place) * xv, vv - pace * xv
        state[i, LASTING] = variance
    return distance


@inlined
def _write_back(state: Floats, i: int, t: float, begun: Floats, j: int) -> None:
    """Write the state at an earlier time, at the same velocity, into a row of another table."""
    dt = t - state[i, T]
    _copy(state, i, begun, j)
    begun[j, T] = t
    begun[j, X] += dt * state[i, VX]
    begun[j, Y] += dt * state[i, VY]
    begun[j, PXX] += 2 * dt * state[i, PXV] + dt * dt * state[i, PVV]
    begun[j, PXV] += dt * state[i, PVV]


@inlined
def _apart(state: Floats, i: int, second: Floats, j: int) -> float:
    """Squared distance of the second state from where the first one leads to."""
    px, py, xx, xv, vv = _ahead(state, i, second[j, T])
    xx += second[j, PXX] + state[i, LASTING] + second[j, LASTING]
    xv, vv = xv + second[j, PXV], vv + second[j, PVV] + MODEL_M_S**2
    dx, dy = second[j, X] - px, second[j, Y] - py
    dvx, dvy = second[j, VX] - state[i, VX], second[j, VY] - state[i, VY]
    return (vv * (dx * dx + dy * dy) - 2 * xv * (dx * dvx + dy * dvy) + xx * (dvx * dvx + dvy * dvy)) / (
        xx * vv - xv * xv
    )


@kernel
def _renumber(track: Ints, t: Floats, number: Ints, row: int, k: int, begin: float, stretch: int) -> None:
    """Give the rows of a track from a time on, to this one, the number of another stretch."""
    for j in range(row, -1, -1):
        if t[j] < begin:
            break
        if track[j] == k:
            number[j] = stretch
