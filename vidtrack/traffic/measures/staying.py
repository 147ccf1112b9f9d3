"""How long vehicles are in zones, and when they stand: one look at each row, in order of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.rows import make_room
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import inlined, kernel
from vidtrack.errors import ConfigError
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.measures.rows import Rows
from vidtrack.traffic.site import Site

STANDS_M_S = 5 / 3.6
"""m/s; slower vehicles stand"""
ZONE_PAUSE_S, STANDING_PAUSE_S = 1.0, 2.0
"""s; two stays of a vehicle with less between them are one"""
_STILL_S = 1.0
"""s; a vehicle whose speed is not known stands when it has not moved for so long by more than one at STANDS_M_S does"""
_EDGE_SHARE = 0.5
"""Of the shorter side of a box that the border cuts: while it stands none of its edges moves by more"""
_LENS_STEPS = 8
BEGIN, END, STOOD, X, Y, FIRST_X, FIRST_Y = range(7)
TRACK, ZONE, CAME, LEFT = range(4)


@dataclass(frozen=True, slots=True, eq=False)
class Stays:
    """E stays in a zone, or of standing, in order of time.

    zone, vehicle   (E,)
    begin, end      (E,) s
    stood           (E,) s of it that the vehicle stood; NaN without a calibration
    came, left      (E,) whether it was seen before and afterwards; else it was there before, or still is
    xy              (E, 2) where it was as soon as that was sure, in the unit of positions; NaN where it never was
    first_xy        (E, 2) where it was at first, however sure
    """

    zone: Ints
    vehicle: Ints
    begin: Floats
    end: Floats
    stood: Floats
    came: Mask
    left: Mask
    xy: Floats
    first_xy: Floats


class Staying:
    """Takes blocks of rows in order of time.

    outlines  (V, 2) of each of Z zones, where vehicles are
    metres    speeds are in m/s; else nothing is known about standing
    """

    def __init__(self, outlines: list[Floats], metres: bool) -> None:
        self._zones, self._metres = len(outlines), metres
        closed = [np.column_stack([outline, np.roll(outline, -1, axis=0)]) for outline in outlines]
        self._side = np.concatenate([*closed, np.empty((0, 4))])
        self._first = np.cumsum([0, *map(len, closed)])
        self._last_t, self._still = np.full(0, np.nan), np.full((0, 7), np.nan)
        self._open = np.full((0, self._zones + 1), -1)
        self._real, self._whole, self._count = np.zeros((0, 7)), np.zeros((0, 4), np.int64), 0

    def add(self, rows: Rows) -> None:
        """Look at some rows."""
        if len(rows) == 0:
            return
        tracks = int(rows.track.max()) + 1
        make_room(self._last_t, tracks, np.nan)
        make_room(self._still, tracks, np.nan)
        make_room(self._open, tracks, -1)
        row = 0
        while row < len(rows):
            make_room(self._real, self._count + 64 * (self._zones + 1), 0.0)
            make_room(self._whole, self._count + 64 * (self._zones + 1), 0)
            row, self._count = _look(
                row, self._count, rows.t, rows.xy, np.isfinite(rows.spread[:, 0]), rows.v, rows.cut, rows.track,
                self._metres, self._side, self._first, self._last_t, self._still, self._open, self._real, self._whole,
            )  # fmt: skip

    def in_zones(self, vehicle: Ints) -> Stays:
        """Stays in zones; `vehicle` (T,) of each track."""
        stays = self._stays(vehicle, self._whole[: self._count, ZONE] < self._zones, ZONE_PAUSE_S)
        if not self._metres:
            stays.stood[:] = np.nan
        return stays

    def standing(self, vehicle: Ints) -> Stays:
        """When vehicles stood, anywhere."""
        return self._stays(vehicle, self._whole[: self._count, ZONE] == self._zones, STANDING_PAUSE_S)

    def _stays(self, vehicle: Ints, chosen: Mask, pause_s: float) -> Stays:
        real, whole = self._real[: self._count][chosen], self._whole[: self._count][chosen]
        who = vehicle[whole[:, TRACK]]
        order = np.lexsort((real[:, BEGIN], who, whole[:, ZONE]))
        real, whole, who = real[order], whole[order], who[order]
        same = (np.diff(who) == 0) & (np.diff(whole[:, ZONE]) == 0) & (real[1:, BEGIN] - real[:-1, END] < pause_s)
        first = np.flatnonzero(np.append(True, ~same)[: len(who)])
        last = np.append(first[1:], len(who))[: len(first)] - 1
        end = np.maximum.reduceat(real[:, END], first) if len(first) else np.empty(0)
        placed = np.where(np.isfinite(real[:, X]), np.arange(len(who)), len(who))
        placed = np.minimum(np.minimum.reduceat(placed, first), last) if len(first) else first
        stood = np.add.reduceat(real[:, STOOD], first) if len(first) else np.empty(0)
        sorted_ = np.argsort(real[first, BEGIN], kind="stable")
        first, last, placed = first[sorted_], last[sorted_], placed[sorted_]
        return Stays(
            zone=whole[first, ZONE],
            vehicle=who[first],
            begin=real[first, BEGIN],
            end=end[sorted_],
            stood=stood[sorted_],
            came=whole[first, CAME] > 0,
            left=whole[last, LEFT] > 0,
            xy=real[placed][:, [X, Y]],
            first_xy=real[first][:, [FIRST_X, FIRST_Y]],
        )


def outlines_of(site: Site, ground: Ground | None) -> list[Floats]:
    """(V, 2) outlines of the zones where vehicles are tracked. Raises ConfigError for one that is not on the road."""
    outlines = []
    for name, zone in site.tracked_zones.items():
        outline = np.array(zone.polygon)
        if ground is not None:
            if ground.lens is not None:
                steps = np.arange(_LENS_STEPS)[:, None] / _LENS_STEPS
                outline = (outline[:, None] + steps * (np.roll(outline, -1, axis=0) - outline)[:, None]).reshape(-1, 2)
            with np.errstate(invalid="ignore"):
                outline = ground.metres(outline)
            if not np.isfinite(outline).all():
                raise ConfigError(f"the zone {name} reaches above the horizon of the calibration; draw it on the road")
        outlines.append(outline)
    return outlines


@kernel
def _look(
    row: int, count: int, t: Floats, xy: Floats, sure: Mask, v: Floats, cut: Floats, track: Ints, metres: bool,
    side: Floats, first: Ints, last_t: Floats, still: Floats, open_: Ints, real: Floats, whole: Ints,
) -> tuple[int, int]:  # fmt: skip
    """Look at rows from `row` on until all are done or the stays need more room; the next row and stay.

    sure    (N,) whether the calibration knows the place
    last_t  (T,) s; of each track; open_ (T, Z + 1) its stay in each zone, the last one for standing; -1: none
    still   (T, 7) since when [s] a track whose speed is not known is near x, y, and its box as it was then, cut
    real, whole   the stays: columns BEGIN... and TRACK...
    """
    zones = len(first) - 1
    for i in range(row, len(t)):
        if count + zones + 1 > len(whole):
            return i, count
        k, x, y = track[i], xy[i, 0], xy[i, 1]
        if np.isnan(x):
            continue
        new = np.isnan(last_t[k])
        dt = 0.0 if new else t[i] - last_t[k]
        square, since, stood = v[i, 0] * v[i, 0] + v[i, 1] * v[i, 1], t[i] - dt / 2, dt
        stands = metres and square < STANDS_M_S**2
        if metres and np.isnan(square):
            far = STANDS_M_S * _STILL_S
            near = (x - still[k, 1]) ** 2 + (y - still[k, 2]) ** 2 <= far * far
            if not near or _drives_in(cut[i], still[k, 3:]):
                still[k, 0], still[k, 1], still[k, 2], still[k, 3:] = t[i], x, y, cut[i]
            stands, since = t[i] - still[k, 0] >= _STILL_S, still[k, 0]
            if stands and open_[k, zones] < 0:
                stood = t[i] - since
        else:
            still[k, 1] = np.nan
        for z in range(zones + 1):
            here = stands if z == zones else _inside(x, y, side, first[z], first[z + 1])
            stay = open_[k, z]
            if here and stay < 0:
                real[count, BEGIN], real[count, END], real[count, STOOD] = since, t[i], 0.0
                if z < zones:
                    real[count, BEGIN] = t[i] - dt / 2
                real[count, X], real[count, Y] = (x, y) if sure[i] else (np.nan, np.nan)
                real[count, FIRST_X], real[count, FIRST_Y] = x, y
                whole[count, TRACK], whole[count, ZONE], whole[count, CAME], whole[count, LEFT] = k, z, not new, 0
                open_[k, z] = count
                count += 1
            elif here:
                real[stay, END] = t[i]
                if sure[i] and np.isnan(real[stay, X]):
                    real[stay, X], real[stay, Y] = x, y
                real[stay, STOOD] += min(stood, t[i] - real[stay, BEGIN]) if stands else 0.0
            elif stay >= 0:
                real[stay, END], whole[stay, LEFT] = t[i] - dt / 2, 1
                open_[k, z] = -1
        last_t[k] = t[i]
    return len(t), count


@inlined
def _drives_in(box: Floats, before: Floats) -> bool:
    """Whether an edge of a box (4,) that the border cuts has moved since before; the border holds one in its place."""
    if np.isnan(box[0]) or np.isnan(before[0]):
        return False
    most = _EDGE_SHARE * min(before[2], before[3])
    for side in range(2):
        moved = box[side] - before[side]
        if abs(moved) > most or abs(moved + box[side + 2] - before[side + 2]) > most:
            return True
    return False


@inlined
def _inside(x: float, y: float, side: Floats, first: int, end: int) -> bool:
    """Whether a point is in a polygon: a ray to the right meets its sides an odd number of times."""
    inside = False
    for s in range(first, end):
        y1, y2 = side[s, 1], side[s, 3]
        if (y1 > y) != (y2 > y) and x < side[s, 0] + (y - y1) / (y2 - y1) * (side[s, 2] - side[s, 0]):
            inside = not inside
    return inside
