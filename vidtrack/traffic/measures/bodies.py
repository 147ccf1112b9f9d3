"""Vehicles as rectangles on the road, and the moments at which two of them come close."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from vidtrack.arrays.rows import dot
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import kernel
from vidtrack.traffic.measures.rows import Rows

_PLACE_M, _LENGTH_M, _SPEED_M_S = 1.0, 1.5, 3.0
"""m, m, m/s; standard deviations from which on a rectangle is not known: half the width of a car, a third of its
length, and the speed of a bicycle. Beyond them most of what comes close on the simulated roads does not."""

T, X, Y, EX, EY, LENGTH, WIDTH, VX, VY, LENGTH_SIGMA, SPEED_SIGMA, XX, YY, XY = range(14)
"""Columns of rectangles: time [s], middle [m], unit vector along the length, sides [m], velocity [m/s]; standard
deviations of the length [m], the width is off by the same share, and of the speed [m/s], taken to be as large across as
along; variances of the middle in x and in y, and their covariance [m2]"""


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """N rectangles in order of time.

    track   (N,) numbers
    table   (N, 14) columns T...: what a kernel needs of a row lies side by side
    merged  (N,) it shares a blob with others
    """

    track: Ints
    table: Floats
    merged: Mask

    @classmethod
    def nothing(cls) -> Bodies:
        """None."""
        return cls(np.empty(0, np.int64), np.empty((0, XY + 1)), np.empty(0, bool))

    def and_also(self, rows: Rows) -> Bodies:
        """These, and rows that the picture shows, with a place, a heading and a length that are known well enough."""
        here, most = len(self), len(self) + len(rows)
        track, table, merged = np.empty(most, np.int64), np.empty((most, XY + 1)), np.empty(most, bool)
        track[:here], table[:here], merged[:here] = self.track, self.table, self.merged
        count = _known(
            here, rows.track, rows.t, rows.seen, rows.merged, rows.xy, rows.ahead, rows.length, rows.width,
            rows.v, rows.length_sigma, rows.speed_sigma, rows.spread, track, table, merged,
        )  # fmt: skip
        return Bodies(track[:count], table[:count], merged[:count])

    def __len__(self) -> int:
        return len(self.track)

    @property
    def t(self) -> Floats:
        """(N,) s."""
        return self.table[:, T]

    @property
    def xy(self) -> Floats:
        """(N, 2) m; middles."""
        return self.table[:, X : Y + 1]

    @property
    def ahead(self) -> Floats:
        """(N, 2) unit vectors along the length."""
        return self.table[:, EX : EY + 1]

    @property
    def v(self) -> Floats:
        """(N, 2) m/s."""
        return self.table[:, VX : VY + 1]

    @property
    def heading_sigma(self) -> Floats:
        """(N,) rad; standard deviation of the heading, by that of the velocity across."""
        return self.table[:, SPEED_SIGMA] / np.maximum(np.linalg.norm(self.v, axis=1), 1e-9)

    def only(self, chosen: Mask | Ints | slice) -> Bodies:
        """The rectangles of a mask, of indices or of a slice."""
        return Bodies(self.track[chosen], self.table[chosen], self.merged[chosen])

    def after(self, seconds: Floats) -> Bodies:
        """Where they are so much later (N,) if they drive straight on."""
        table = self.table.copy()
        table[:, X : Y + 1] += seconds[:, None] * self.v
        return Bodies(self.track, table, self.merged)

    def half(self, n: Floats) -> Floats:
        """(N,) how far the rectangles reach from their middles along n (N, 2), times its length."""
        along, across = np.abs(dot(self.ahead, n)), np.abs(_cross(self.ahead, n))
        return np.asarray((self.table[:, LENGTH] * along + self.table[:, WIDTH] * across) / 2)

    def variance(self, n: Floats) -> Floats:
        """(N,) of how far they reach along n (N, 2): by the error of the middle and by that of the sides."""
        xx, yy, xy = self.table[:, XX:].T
        middle = n[:, 0] ** 2 * xx + n[:, 1] ** 2 * yy + 2 * n[:, 0] * n[:, 1] * xy
        return np.asarray(middle + (self.half(n) * self.table[:, LENGTH_SIGMA] / self.table[:, LENGTH]) ** 2)


@dataclass(frozen=True, slots=True, eq=False)
class Encounters:
    """E moments of two vehicles: `second` comes to where `first` was, or closes in on it.

    first, second   (E,) numbers
    value, sigma    (E,) s; the time to collision or the post-encroachment time (NaN: it does not count), and its
                    standard deviation
    rank    (E,) s; of several moments of the same two vehicles the one with the least rank counts
    t       (E,) s; when
    xy      (E, 2) m; where they touch
    angle   (E,) rad; between their headings, 0 to pi
    speed   (E, 2) m/s; of both
    merged  (E,) one of them shares a blob with others
    """

    first: Ints
    second: Ints
    value: Floats
    sigma: Floats
    rank: Floats
    t: Floats
    xy: Floats
    angle: Floats
    speed: Floats
    merged: Mask

    @classmethod
    def nothing(cls) -> Encounters:
        """None."""
        whole, real, pair = np.empty(0, np.int64), np.empty(0), np.empty((0, 2))
        return cls(whole, whole, *(real,) * 4, pair, real, pair, np.empty(0, bool))

    @classmethod
    def at(cls, a: Bodies, b: Bodies, value: Floats, sigma: Floats, rank: Floats, t: Floats, xy: Floats) -> Encounters:
        """Those of vehicles a and b (E,), in this order."""
        speed = np.column_stack([np.linalg.norm(one.v, axis=1) for one in (a, b)])
        angle = np.arccos(np.clip(dot(a.ahead, b.ahead), -1, 1))
        return cls(a.track, b.track, value, sigma, rank, t, xy, angle, speed, a.merged | b.merged)

    def __len__(self) -> int:
        return len(self.t)

    def only(self, chosen: Mask | Ints) -> Encounters:
        """Those of a mask or of indices."""
        return Encounters(*(getattr(self, column.name)[chosen] for column in fields(self)))

    @classmethod
    def together(cls, parts: list[Encounters]) -> Encounters:
        """All of several, one after the other."""
        return cls(*(np.concatenate([getattr(part, column.name) for part in parts]) for column in fields(cls)))

    def between(self, vehicle: Ints) -> Encounters:
        """The same between vehicles; `vehicle` (T,) of each number. Those of one vehicle with itself fall out."""
        names = [column.name for column in fields(self)][2:]
        first, second = vehicle[self.first], vehicle[self.second]
        renamed = Encounters(first, second, *(getattr(self, name) for name in names))
        return renamed.only(first != second)

    @property
    def pair(self) -> Ints:
        """(E,) one number for the two vehicles of each."""
        return pairs(self.first, self.second)

    def least(self) -> Ints:
        """Indices of the moments that count, one of each two vehicles, the earlier one of equals."""
        return least_of(self.pair, np.round(self.rank, 6), self.t, self.value)


@kernel
def _known(
    count: int, track: Ints, t: Floats, seen: Mask, merged: Mask, xy: Floats, ahead: Floats, length: Floats,
    width: Floats, v: Floats, length_sigma: Floats, speed_sigma: Floats, spread: Floats,
    tracks: Ints, table: Floats, shared: Mask,
) -> int:  # fmt: skip
    """Write rectangles that are known well enough into the three columns of `Bodies`, from `count` on; returns how many
    there are then."""
    for i in range(len(track)):
        known = length[i] + width[i] + xy[i, 0] + v[i, 0]
        sure = (spread[i, 0] + spread[i, 1]) / 2 < _PLACE_M**2 and length_sigma[i] < _LENGTH_M
        if not (seen[i] and np.isfinite(known) and sure and speed_sigma[i] < _SPEED_M_S):
            continue
        tracks[count], shared[count] = track[i], merged[i]
        table[count, T], table[count, X], table[count, Y] = t[i], xy[i, 0], xy[i, 1]
        table[count, EX], table[count, EY] = ahead[i, 0], ahead[i, 1]
        table[count, LENGTH], table[count, WIDTH] = length[i], width[i]
        table[count, VX], table[count, VY] = v[i, 0], v[i, 1]
        table[count, LENGTH_SIGMA], table[count, SPEED_SIGMA] = length_sigma[i], speed_sigma[i]
        table[count, XX], table[count, YY], table[count, XY] = spread[i, 0], spread[i, 1], spread[i, 2]
        count += 1
    return count


def pairs(one: Ints, other: Ints) -> Ints:
    """(N,) one number for each two vehicles (N,), in order of the smaller number and then of the larger one."""
    return np.asarray(np.minimum(one, other) << 32 | np.maximum(one, other))


def least_of(pair: Ints, *ranks: Floats) -> Ints:
    """Indices of one row of each pair (N,), in order of pairs: the least by the first of the ranks (N,).

    Of equals it is the least by the next one, and so on, and then the first. NaN is more than any number.
    """
    least = np.argsort(pair, kind="stable")
    for rank in (np.where(np.isnan(one), np.inf, one) for one in ranks):
        first = np.flatnonzero(np.diff(pair[least], prepend=-1))
        lowest = np.minimum.reduceat(rank[least], first) if len(first) else rank
        least = least[~(rank[least] > np.repeat(lowest, np.diff(first, append=len(least))))]
    return least[np.diff(pair[least], prepend=-1) != 0]


def touching_place(a: Bodies, b: Bodies, n: Floats) -> Floats:
    """(N, 2) the middle of what two rectangles have in common, along unit vectors n (N, 2) and square to them."""
    place = np.zeros_like(n)
    for axis in (n, np.column_stack([-n[:, 1], n[:, 0]])):
        low, high = ([dot(one.xy, axis) + sign * one.half(axis) for one in (a, b)] for sign in (-1, 1))
        place += ((np.maximum(*low) + np.minimum(*high)) / 2)[:, None] * axis
    return place


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
