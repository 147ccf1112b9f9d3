"""When tracks pass gates: one look at each row, in order of time, whatever the rows before it were stored in.

A track passes a gate when the step between two of its positions meets the gate's line. If it then comes back before it
was away from the gate by its margin, neither passing counts: it jitters or stands on the line. One that is last seen
beyond the gate has passed, however near. Gates may be looked at as if they were longer at both ends: what passes beside
them, `beside`, has a place on the gate below 0 or beyond its length.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from vidtrack.arrays.rows import make_room
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import inlined, kernel
from vidtrack.traffic.measures.gates import Gates
from vidtrack.traffic.measures.rows import Rows

REACH_M, REACH_PX = 10.0, 100.0
"""How far from a gate distances are looked at: many times what positions are off."""
BESIDE_M = 3.0
"""m; how far beside a gate a vehicle may have been that is known to have passed there: positions are off by as much"""

_BACK_S = 2.0
"""s; who passes a gate and comes back so soon jitters, or others hide a part of it"""
_CORNER = 2.0
"""Distance of the corners along which ways are measured: jitter of positions lengthens them by little."""

TIME, ALONG, SIGMA, SPEED, SPEED_SIGMA, SPEED_SHARED, BEFORE, AFTER, WAY = range(9)
GATE, TRACK, SIDE, LAST, SEEN, SHOWN, MERGED = range(7)
_T, _X, _Y, _SIGMA, _SPEED, _SPEED_SIGMA, _SPEED_SHARED = range(7)


@dataclass(frozen=True, slots=True, eq=False)
class Passed:
    """P passings of gates, in order of time.

    t             (P,) s
    gate, track   (P,) numbers
    side          (P,) 1: to the side where `polyline.turn` is positive; 0: to the other one
    along         (P,) place on the gate, from its first end, in the unit of positions
    sigma         (P,) standard deviation of the track's position there
    before, after (P,) largest distances from the gate that the track was seen at before and after
    shown, merged (P,) the picture shows the track just then; it shares a blob
    speed, speed_sigma, speed_shared   (P,) in the unit of positions per second
    way           (P,) what the track had driven since it began; NaN where that is not known
    beside        (P,) it passed beyond an end of the gate
    """

    t: Floats
    gate: Ints
    track: Ints
    side: Ints
    along: Floats
    sigma: Floats
    before: Floats
    after: Floats
    shown: Mask
    merged: Mask
    speed: Floats
    speed_sigma: Floats
    speed_shared: Floats
    way: Floats
    beside: Mask

    def __len__(self) -> int:
        return len(self.t)

    def only(self, chosen: Mask | Ints) -> Passed:
        """The passings of a mask or of indices."""
        return Passed(*(getattr(self, column.name)[chosen] for column in fields(self)))

    def and_also(self, other: Passed) -> Passed:
        """Both, these first."""
        names = [column.name for column in fields(self)]
        return Passed(*(np.concatenate([getattr(self, name), getattr(other, name)]) for name in names))

    def at_gate(self, gate: int) -> Passed:
        """The same passings, of a gate of this number."""
        return replace(self, gate=np.full(len(self), gate))

    def of(self, track: Ints) -> Passed:
        """The same passings of other tracks (P,)."""
        return replace(self, track=track)

    def nowhere(self) -> Passed:
        """The same passings, outside of what the tracks drove."""
        return replace(self, way=np.full(len(self), np.nan))

    def with_speeds(self, speed: Floats, own: Floats, shared: Floats) -> Passed:
        """The same passings with other speeds (P,) and standard deviations."""
        return replace(self, speed=speed, speed_sigma=own, speed_shared=shared)


def reaches(metres: bool) -> tuple[float, float]:
    """`reach` and `beside` of Passing, where positions are in metres or in pixels: those have no beside."""
    return (REACH_M, BESIDE_M) if metres else (REACH_PX, 0.0)


class Passing:
    """Takes blocks of rows in order of time; remembers each track's last position and its side of each gate.

    reach   distances from a gate beyond it are taken for this, in the unit of positions
    beside  by how much gates are longer at both ends
    """

    def __init__(self, gates: Gates, reach: float, beside: float = 0.0) -> None:
        self._gates, self._reach = gates, reach
        self._segment, self._begin, self._first = (
            gates.with_beside(beside) if beside else (gates.segment, gates.begin, gates.first)
        )
        segment, first = self._segment, self._first
        lines = len(first) - 1
        low = np.minimum(segment[:, :2], segment[:, 2:])
        high = np.maximum(segment[:, :2], segment[:, 2:])
        self._frame = np.column_stack(
            [
                np.minimum.reduceat(low, first[:-1]) - reach,
                np.maximum.reduceat(high, first[:-1]) + reach,
            ]
        )
        self._state = np.full((0, 7), np.nan)
        self._far = np.zeros((0, lines))
        self._last = np.full((0, lines), -1)
        self._way = np.full((0, 3), np.nan)
        self._real = np.zeros((0, 9))
        self._whole = np.zeros((0, 7), np.int64)
        self._count = 0

    def add(self, rows: Rows) -> None:
        """Look at some rows."""
        if len(rows) == 0:
            return
        self._make_room(int(rows.track.max()) + 1)
        row = 0
        while row < len(rows):
            make_room(self._real, self._count + 64 * len(self._frame), 0.0)
            make_room(self._whole, self._count + 64 * len(self._frame), 0)
            row, self._count = _look(
                row, self._count, rows.t, rows.xy, rows.sigma, rows.v, rows.speed_sigma, rows.speed_shared,
                rows.track, rows.margin, rows.seen, rows.merged,
                self._segment, self._begin, self._first, self._frame, self._reach,
                self._state, self._way, self._far, self._last, self._real, self._whole,
            )  # fmt: skip

    def _make_room(self, tracks: int) -> None:
        make_room(self._state, tracks, np.nan)
        make_room(self._far, tracks, 0.0)
        make_room(self._last, tracks, -1)
        make_room(self._way, tracks, np.nan)

    def passed(self) -> Passed:
        """All passings so far, each track once per gate and side.

        What is not seen beyond the gate does not count, nor does what is taken back within _BACK_S.
        """
        real, whole = self._real[: self._count], self._whole[: self._count]
        kept = np.flatnonzero((whole[:, GATE] >= 0) & (whole[:, SEEN] > 0))
        kept = kept[np.lexsort((kept, real[kept, TIME]))]
        kept = kept[lasting(whole[kept, TRACK], whole[kept, GATE], whole[kept, SIDE], real[kept, TIME])]
        _, first = np.unique(whole[kept][:, [TRACK, GATE, SIDE]], axis=0, return_index=True)
        kept = kept[np.sort(first)]
        real, whole = real[kept], whole[kept]
        return Passed(
            t=real[:, TIME],
            gate=whole[:, GATE] % max(len(self._gates), 1),
            track=whole[:, TRACK],
            side=whole[:, SIDE],
            along=real[:, ALONG],
            sigma=real[:, SIGMA],
            before=real[:, BEFORE],
            after=real[:, AFTER],
            shown=whole[:, SHOWN] > 0,
            merged=whole[:, MERGED] > 0,
            speed=real[:, SPEED],
            speed_sigma=real[:, SPEED_SIGMA],
            speed_shared=real[:, SPEED_SHARED],
            way=real[:, WAY],
            beside=whole[:, GATE] >= len(self._gates),
        )

    def ways(self, tracks: int) -> Floats:
        """(T,) what each track has driven in all, with corners _CORNER apart; 0 for those of which nothing is known."""
        way, state = self._way[:tracks], self._state[:tracks]
        rest = np.hypot(state[:, _X] - way[:, 0], state[:, _Y] - way[:, 1])
        driven = np.zeros(tracks)
        driven[: len(way)] = np.nan_to_num(way[:, 2] + rest)
        return driven


def lasting(track: Ints, gate: Ints, side: Ints, t: Floats) -> Mask:
    """(P,) whether passings are none of a pair of a track, to and fro over a gate within _BACK_S."""
    order = np.lexsort((t, gate, track))
    same = (np.diff(track[order]) == 0) & (np.diff(gate[order]) == 0) & (np.diff(t[order]) < _BACK_S)
    same &= np.diff(side[order]) != 0
    number = np.arange(len(same))
    begin = np.maximum.accumulate(np.where(same, -1, number))  # the last one that is no such pair
    first = np.flatnonzero(same & ((number - begin) % 2 == 1))
    lasting = np.ones(len(t), bool)
    lasting[order[first]] = lasting[order[first + 1]] = False
    return lasting


@kernel
def _look(
    row: int, count: int, t: Floats, xy: Floats, sigma: Floats, v: Floats, speed_sigma: Floats, speed_shared: Floats,
    track: Ints, margin: Floats, seen: Mask, merged: Mask,
    segment: Floats, begin: Floats, first: Ints, frame: Floats, reach: float,
    state: Floats, way: Floats, far: Floats, last: Ints, real: Floats, whole: Ints,
) -> tuple[int, int]:  # fmt: skip
    """Look at rows from `row` on until all are done or the passings need more room; the next row and passing.

    state   (T, 7) of each track the last values, columns _T...
    way     (T, 3) of each track the corner passed last, x, y, and what it had driven there
    frame   (G, 4) around each gate, `reach` beyond it
    far     (T, G) largest distance from the gate since the track passed it last; last (T, G) that passing, or -1
    real, whole   the passings: columns TIME... and GATE...
    """
    gates, now = len(first) - 1, np.empty(7)
    for i in range(row, len(track)):
        if count + gates > len(whole):
            return i, count
        x, y, k = xy[i, 0], xy[i, 1], track[i]
        if np.isnan(x):
            continue
        now[_T], now[_X], now[_Y], now[_SIGMA] = t[i], x, y, sigma[i]
        now[_SPEED] = np.sqrt(v[i, 0] * v[i, 0] + v[i, 1] * v[i, 1])
        now[_SPEED_SIGMA], now[_SPEED_SHARED] = speed_sigma[i], speed_shared[i]
        x0, y0 = state[k, _X], state[k, _Y]
        if np.isnan(way[k, 0]):
            way[k, 0], way[k, 1], way[k, 2] = x, y, 0.0
        for g in range(gates):
            left, low, right, high = frame[g, 0], frame[g, 1], frame[g, 2], frame[g, 3]
            side = -1
            if not (
                np.isnan(x0)
                or max(x, x0) < left + reach
                or min(x, x0) > right - reach
                or max(y, y0) < low + reach
                or min(y, y0) > high - reach
            ):
                side, share, along = _met(x0, y0, x, y, segment, begin, first[g], first[g + 1])
            passing = last[k, g]
            if side >= 0:
                if passing >= 0 and far[k, g] <= margin[i] and whole[passing, SIDE] != side:
                    whole[passing, GATE] = -1
                    last[k, g] = whole[passing, LAST]
                    far[k, g] = real[passing, BEFORE]
                else:
                    _note(real[count], now, state[k], share)
                    real[count, ALONG] = along
                    px, py = x0 + share * (x - x0), y0 + share * (y - y0)
                    real[count, WAY] = way[k, 2] + np.hypot(px - way[k, 0], py - way[k, 1])
                    real[count, BEFORE] = far[k, g]
                    whole[count, GATE], whole[count, TRACK], whole[count, SIDE] = g, k, side
                    whole[count, LAST], whole[count, SEEN] = passing, 0
                    whole[count, SHOWN], whole[count, MERGED] = seen[i], merged[i]
                    far[k, g] = 0.0
                    last[k, g] = count
                    count += 1
                passing = last[k, g]
            if far[k, g] < reach:
                inside = left <= x <= right and low <= y <= high
                away = _distance(x, y, segment, first[g], first[g + 1]) if inside else reach
                far[k, g] = max(far[k, g], min(away, reach))
            if passing >= 0:
                real[passing, AFTER] = far[k, g]
                whole[passing, SEEN] |= seen[i]
        for column in range(len(now)):
            state[k, column] = now[column]
        dx, dy = x - way[k, 0], y - way[k, 1]
        if dx * dx + dy * dy >= _CORNER**2:
            way[k, 0], way[k, 1], way[k, 2] = x, y, way[k, 2] + np.hypot(dx, dy)
    return len(track), count


@inlined
def _met(
    x0: float, y0: float, x: float, y: float, segment: Floats, begin: Floats, first: int, end: int
) -> tuple[int, float, float]:
    """The side that a step passes a gate to (-1: it does not pass), the share of the step until then, and the place
    along the gate. A step that passes to and fro does not pass."""
    net, share, along = 0, 0.0, 0.0
    for s in range(first, end):
        ax, ay, bx, by = segment[s, 0], segment[s, 1], segment[s, 2], segment[s, 3]
        dx, dy = bx - ax, by - ay
        before = dx * (y0 - ay) - dy * (x0 - ax)
        after = dx * (y - ay) - dy * (x - ax)
        if (before >= 0) == (after >= 0):
            continue
        part = before / (before - after)
        place = ((x0 + part * (x - x0) - ax) * dx + (y0 + part * (y - y0) - ay) * dy) / (dx * dx + dy * dy)
        if 0 <= place < 1 or (s == end - 1 and place == 1):
            net += 1 if after >= 0 else -1
            share, along = part, begin[s] + place * np.hypot(dx, dy)
    return (-1 if net == 0 else int(net > 0)), share, along


@inlined
def _distance(x: float, y: float, segment: Floats, first: int, end: int) -> float:
    """Distance of a point from a gate."""
    nearest = np.inf  # its square
    for s in range(first, end):
        ax, ay = segment[s, 0], segment[s, 1]
        dx, dy = segment[s, 2] - ax, segment[s, 3] - ay
        place = min(max(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy), 0.0), 1.0)
        nearest = min(nearest, (x - ax - place * dx) ** 2 + (y - ay - place * dy) ** 2)
    return np.sqrt(nearest)


@inlined
def _note(passing: Floats, now: Floats, before: Floats, share: float) -> None:
    """Write down the values between two rows; where one of them has none, those of the other."""
    for value, at in ((_T, TIME), (_SIGMA, SIGMA), (_SPEED, SPEED), (_SPEED_SIGMA, SPEED_SIGMA),
                      (_SPEED_SHARED, SPEED_SHARED)):  # fmt: skip
        a, b = before[value], now[value]
        if np.isnan(a):
            passing[at] = b
        elif np.isnan(b):
            passing[at] = a
        else:
            passing[at] = a + share * (b - a)
