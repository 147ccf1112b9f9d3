"""Tracks are broken into stretches where their motion on the road cannot be that of one vehicle.

Where vehicles meet in one blob, or one hides the other, a track may go on as the other vehicle. A Kalman filter of
nearly constant velocity follows each track through the rows in which the picture shows it alone. Again and again
another filter begins, also after rows that the track shared, and where a row is far from the prediction. If its state
after _CHECK_S is not where the first one led to when it began, the rest of the track is another stretch: of which
vehicle is decided by `joins`. So it is where a track drives back the way that it came, without room to turn.

The noise of the two axes is the same and independent, so a filter has six numbers beside its time: position,
velocity, and for each axis the variances of both and their covariance. Errors of footprints last, so the variance of
the last row is added where two states are compared.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import kernel
from vidtrack.traffic.lengths import length_sums, mean_length
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
_DRIVES_M_S, _KNOWN_M_S = 3.0, 1.5
"""m/s; from which on a vehicle has a direction, if its velocity is known so well"""
_BACK, _ROOM_M = -0.7, 6.0
"""Cosine of directions that are opposite; m to the side that a vehicle needs to turn round"""
MODEL_M_S = 1.0
"""m/s; standard deviation of the difference of two velocities beside what they say"""
T, X, Y, VX, VY, PXX, PXV, PVV, LASTING = range(9)


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

    def after(self, seconds: Floats) -> End:
        """The state (T,) s later, or earlier where negative, at the same velocity."""
        xx, xv, vv = self.spread.T
        spread = np.column_stack([xx + 2 * seconds * xv + seconds**2 * vv, xv + seconds * vv, vv])
        return replace(self, t=self.t + seconds, xy=self.xy + seconds[:, None] * self.v, spread=spread)


@dataclass(frozen=True, slots=True, eq=False)
class Lives:
    """What is left of T stretches when their rows have gone by.

    head, tail   where they began and ended, seen alone
    length       (T,) m; the mean weighted by the variances, NaN where it is not known
    track        (T,) number of the track
    until        (T,) s; what the track did afterwards is of nobody; inf: it was not broken
    """

    head: End
    tail: End
    length: Floats
    track: Ints
    until: Floats


class Stretches:
    """Takes blocks of rows in order of time. `metres`: positions are on the road; else tracks stay whole."""

    def __init__(self, metres: bool) -> None:
        self._metres = metres
        self._state = np.full((0, 1 + 2 * _CHECKS, 9), np.nan)
        self._since = np.full((0, 2 + 2 * _CHECKS), np.nan)
        self._onward = np.full((0, 4), np.nan)
        self._turned = np.full((0, 9), np.nan)
        self._current = np.empty(0, np.int64)
        self._head, self._tail = np.full((2, 0, 9), np.nan)
        self._track, self._until = np.empty(0, np.int64), np.empty(0)
        self._sums = np.zeros((0, 2))
        self._count = 0

    def add(self, rows: Rows) -> Rows:
        """The same rows, with the numbers of stretches as those of tracks."""
        if len(rows) == 0:
            return rows
        self._make_room(int(rows.track.max()) + 1, len(rows))
        alone = rows.seen & ~rows.merged & np.isfinite(rows.xy[:, 0]) if self._metres else np.isfinite(rows.xy[:, 0])
        number = np.empty(len(rows), np.int64)
        values = np.column_stack([rows.t, rows.xy, rows.sigma**2 + _PLACE_M**2])
        self._count = _follow(
            rows.track, values, alone & rows.seen, self._metres, self._state, self._since, self._onward,
            self._turned, self._current, self._head, self._tail, self._track, self._until, number, self._count,
        )  # fmt: skip
        self._sums[: self._count] += length_sums(number, rows.length, rows.length_sigma, self._count)
        return replace(rows, track=number)

    def lives(self) -> Lives:
        """Of all stretches so far."""
        n = self._count
        ends = _end(self._head[:n]), _end(self._tail[:n])
        return Lives(*ends, mean_length(self._sums[:n]), self._track[:n], self._until[:n])

    def _make_room(self, tracks: int, rows: int) -> None:
        """For tracks (K), and for as many stretches as these rows can have: one begins with some rows of its own."""
        if tracks > len(self._current):
            more = max(tracks, 2 * len(self._current)) - len(self._current)
            self._state = np.concatenate([self._state, np.full((more, *self._state.shape[1:]), np.nan)])
            self._since = np.concatenate([self._since, np.full((more, self._since.shape[1]), np.nan)])
            self._onward = np.concatenate([self._onward, np.full((more, 4), np.nan)])
            self._turned = np.concatenate([self._turned, np.full((more, 9), np.nan)])
            self._current = np.concatenate([self._current, np.full(more, -1)])
        stretches = self._count + tracks + rows // _CHECK_ROWS
        if stretches > len(self._track):
            more = max(stretches, 2 * len(self._track)) - len(self._track)
            unknown = np.full((more, 9), np.nan)
            self._head, self._tail = np.vstack([self._head, unknown]), np.vstack([self._tail, unknown])
            self._track = np.concatenate([self._track, np.full(more, -1)])
            self._until = np.concatenate([self._until, np.full(more, np.inf)])
            self._sums = np.concatenate([self._sums, np.zeros((more, 2))])


def _end(states: Floats) -> End:
    spread = np.column_stack([states[:, PXX] + states[:, LASTING], states[:, PXV : PVV + 1]])
    return End(states[:, T], states[:, X : Y + 1], states[:, VX : VY + 1], spread)


@kernel
def _follow(
    track: Ints, values: Floats, alone: Mask, metres: bool, state: Floats, since: Floats, onward: Floats,
    turned: Floats, current: Ints, head: Floats, tail: Floats, of_track: Ints, until: Floats, number: Ints, count: int,
) -> int:  # fmt: skip
    """Number rows by stretches; returns how many there are.

    values  (N, 4) t, x, y and the variance of a position
    state   (K, 1 + 2 _CHECKS, 9) of each track the long filter, then for each check what this was when the check began,
            and the filter that began with it
    onward, turned   (K, 4), (K, 9) as in `_backs`
    since   (K, 2 + 2 _CHECKS) when the long filter began, and 1 after rows in which the track was not alone; then of
            each check when it began (NaN: it has not) and how many rows it has
    """
    begun = np.empty(9)
    for i in range(len(track)):
        k, t = track[i], values[i, 0]
        if current[k] < 0:
            current[k] = count
            of_track[count] = k
            count += 1
        number[i] = current[k]
        if not alone[i]:
            since[k, 1] = 1
            continue
        first = state[k, 0]
        if np.isnan(first[T]) or not metres:
            new = np.isnan(first[T])
            _begin(first, values[i])
            tail[current[k]] = first
            if new:
                head[current[k]] = first
                since[k, 0], since[k, 1] = t, 0
            continue
        shared = since[k, 1] == 1 and t - first[T] > _PAUSE_S
        since[k, 1] = 0
        latest = -np.inf
        for c in range(_CHECKS):
            if shared:
                since[k, 2 + 2 * c] = np.nan
            elif since[k, 2 + 2 * c] > latest:
                latest = since[k, 2 + 2 * c]
        broken = -1
        for c in range(_CHECKS):
            before, after = state[k, 1 + 2 * c], state[k, 2 + 2 * c]
            if np.isnan(since[k, 2 + 2 * c]):
                if t - latest >= _CHECK_S / _CHECKS:
                    latest = t
                    before[:] = first
                    _begin(after, values[i])
                    since[k, 2 + 2 * c], since[k, 3 + 2 * c] = t, 1
                continue
            if _step(after, values[i]) > _FAR:
                before[:] = first
                _begin(after, values[i])
                since[k, 2 + 2 * c], since[k, 3 + 2 * c] = t, 1
                continue
            since[k, 3 + 2 * c] += 1
            if t - since[k, 2 + 2 * c] < _CHECK_S or since[k, 3 + 2 * c] < _CHECK_ROWS:
                continue
            _write_back(after, since[k, 2 + 2 * c], begun)
            if _apart(before, begun) > _OTHER:
                broken = c
                break
            if first[T] <= since[k, 2 + 2 * c]:
                first[:] = after  # which all these rows were far from, until now
            since[k, 2 + 2 * c] = np.nan
        begin = np.nan
        if broken >= 0:
            begin, tail[current[k]] = since[k, 2 + 2 * broken], state[k, 1 + 2 * broken]
            first[:] = state[k, 2 + 2 * broken]
        elif first[T] == t or _step(first, values[i]) <= _FAR:
            tail[current[k]] = first
            if t - since[k, 0] <= _CHECK_S:
                _write_back(first, since[k, 0], head[current[k]])
            if _backs(first, onward[k], turned[k]):
                begin, tail[current[k]] = turned[k, T], turned[k]
                _write_back(first, begin, begun)
        if not np.isnan(begin):
            until[current[k]] = tail[current[k], T]
            _renumber(track, values, number, i, k, begin, count)
            current[k] = count
            of_track[count] = k
            head[count], tail[count] = begun, first
            count += 1
            since[k, 0] = begin
            since[k, 2:] = np.nan
            onward[k], turned[k] = np.nan, np.nan
    return count


@kernel
def _backs(state: Floats, onward: Floats, turned: Floats) -> bool:
    """Whether a track drives back the way that it came, without room to turn: then it is of another vehicle.

    onward  (4,) place and unit vector of its last driving
    turned  (9,) its last state before it began to drive back; both are kept up here
    """
    speed = np.hypot(state[VX], state[VY])
    along = (state[VX] * onward[2] + state[VY] * onward[3]) / max(speed, 1e-9)
    if not along < 0:
        turned[:] = np.nan
    elif np.isnan(turned[T]):
        turned[:] = state
    if speed < _DRIVES_M_S or state[PVV] > _KNOWN_M_S**2:
        return False
    if along < _BACK:
        sideways = abs((state[X] - onward[0]) * onward[3] - (state[Y] - onward[1]) * onward[2])
        if sideways < _ROOM_M:
            return True
    onward[0], onward[1], onward[2], onward[3] = state[X], state[Y], state[VX] / speed, state[VY] / speed
    turned[:] = np.nan
    return False


@kernel
def _begin(state: Floats, row: Floats) -> None:
    """Write the state of a vehicle of which one row (4,) is known."""
    state[T], state[X], state[Y], state[VX], state[VY] = row[0], row[1], row[2], 0.0, 0.0
    state[PXX], state[PXV], state[PVV], state[LASTING] = row[3], 0.0, _FIRST_M_S**2, row[3]


@kernel
def _predict(state: Floats, dt: float, to: Floats) -> None:
    """Write the state dt [s] later."""
    jolt = STANDING_JOLT + JOLT_PER_M_S * np.hypot(state[VX], state[VY])
    to[T], to[VX], to[VY], to[LASTING] = state[T] + dt, state[VX], state[VY], state[LASTING]
    to[X], to[Y] = state[X] + dt * state[VX], state[Y] + dt * state[VY]
    to[PXX] = state[PXX] + 2 * dt * state[PXV] + dt * dt * state[PVV] + jolt * dt**3 / 3
    to[PXV] = state[PXV] + dt * state[PVV] + jolt * dt**2 / 2
    to[PVV] = state[PVV] + jolt * dt


@kernel
def _step(state: Floats, row: Floats) -> float:
    """Predict and update with a row (4,), unless it is far off; returns its squared distance.

    Several are made of each row: the prediction of `_predict` is written out, so that no array is made for it.
    """
    dt, vx, vy = row[0] - state[T], state[VX], state[VY]
    jolt = STANDING_JOLT + JOLT_PER_M_S * np.hypot(vx, vy)
    x, y = state[X] + dt * vx, state[Y] + dt * vy
    xx = state[PXX] + 2 * dt * state[PXV] + dt * dt * state[PVV] + jolt * dt**3 / 3
    xv = state[PXV] + dt * state[PVV] + jolt * dt**2 / 2
    vv = state[PVV] + jolt * dt
    dx, dy, s = row[1] - x, row[2] - y, xx + row[3]
    distance = (dx * dx + dy * dy) / s
    if distance > _FAR:
        return distance
    place, pace = xx / s, xv / s
    state[T], state[X], state[Y], state[VX], state[VY] = (
        row[0],
        x + place * dx,
        y + place * dy,
        vx + pace * dx,
        vy + pace * dy,
    )
    state[PXX], state[PXV], state[PVV], state[LASTING] = (1 - place) * xx, (1 - place) * xv, vv - pace * xv, row[3]
    return distance


@kernel
def _write_back(state: Floats, t: float, begun: Floats) -> None:
    """Write the state at an earlier time, at the same velocity."""
    dt = t - state[T]
    begun[:] = state
    begun[T], begun[X], begun[Y] = t, state[X] + dt * state[VX], state[Y] + dt * state[VY]
    begun[PXX] = state[PXX] + 2 * dt * state[PXV] + dt * dt * state[PVV]
    begun[PXV] = state[PXV] + dt * state[PVV]


@kernel
def _apart(first: Floats, second: Floats) -> float:
    """Squared distance of the second state from where the first one leads to."""
    then = np.empty(9)
    _predict(first, second[T] - first[T], then)
    xx, xv = then[PXX] + second[PXX] + then[LASTING] + second[LASTING], then[PXV] + second[PXV]
    vv = then[PVV] + second[PVV] + MODEL_M_S**2
    total = 0.0
    for place, pace in ((X, VX), (Y, VY)):
        dx, dv = second[place] - then[place], second[pace] - then[pace]
        total += (vv * dx * dx - 2 * xv * dx * dv + xx * dv * dv) / (xx * vv - xv * xv)
    return total


@kernel
def _renumber(track: Ints, values: Floats, number: Ints, row: int, k: int, begin: float, stretch: int) -> None:
    """Give the rows of a track from a time on, to this one, the number of another stretch."""
    for j in range(row, -1, -1):
        if values[j, 0] < begin:
            break
        if track[j] == k:
            number[j] = stretch
