"""The register of tracks: identity and history of each row of the bank."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from scipy.special import expit

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import kernel
from vidtrack.tracks import COASTING, CONFIRMED, MERGED, TENTATIVE

BELIEF = 20.0
"""Largest log-odds of a track's existence."""
REST = 0.5
"""Sizes; what moves less stands still."""
SCANS = (1 << 63) - 1
"""Mask of the bits of a history that are kept: the 63 lowest."""


class Register:
    """Identity and history of each row; rows are in the order of the estimator's.

    id, status, born_s, updated_s (last evidence), history (hits of the last 63 scans as bits, newest lowest), start (T,
    d) position at birth, box (T, 4) left, top, width, height relative to the position, merged (number of the tracks on
    its measurement, -1 alone) and merged_since_s, exchange (probability that the target is another's, since they were
    not resolved), score (log-odds that it is a target), best (highest score since it was confirmed, before that the
    first), run, label (class last seen, -1 unknown), alone_s (time seen on a blob of its own), outside (the border of
    the picture has cut it since it began), entered (it began so, and came in), inward (T, 2) axes along which it comes
    in, beside (it began beside a vehicle), towed (T, d) where it would be if it went with the vehicles it was beside,
    travelled (farthest it ever was from its start), rest (T, d) and rest_s (where and when it last moved on by REST of
    its size), missed (T, S) scans of each station without it since it was last seen, visible (T, S) probability that
    each station could see it, NaN while nothing is known, look (T, 3) mean luminance and chroma, NaN unknown, shown (T,
    4, 2) where the inner edge of each was inside the sides of the picture that cut it, at most and at least since, host
    (the larger track whose box it is in, -1 none) and seat (T, 5) (see `occlusion.aboard`).
    Where a smoother needs them also prior_x, prior_P and gain (see Tracks), made anew in every scan.
    """

    STATE = ("next_id", "id", "status", "born_s", "updated_s", "history", "start", "box", "merged", "merged_since_s",
             "exchange", "score", "best", "run", "label", "alone_s", "outside", "entered", "inward", "beside",
             "towed", "travelled", "rest", "rest_s", "missed", "visible", "look", "shown",
             "host", "seat")  # fmt: skip

    ADDED: ClassVar = {
        name: lambda register: np.zeros(len(register), bool) for name in ("outside", "entered", "beside")
    } | {
        "inward": lambda register: np.zeros((len(register), 2), bool),
        "towed": lambda register: register.start.copy(),
        "look": lambda register: np.full((len(register), 3), np.nan),
        "shown": lambda register: np.full((len(register), 4, 2), np.nan),
        "host": lambda register: np.full(len(register), -1),
        "seat": lambda register: np.full((len(register), 5), np.nan),
    }

    LINKS = ("prior_x", "prior_P", "gain")

    def __init__(self, dim: int, smooth: bool = False, stations: int = 1) -> None:
        """dim of the positions; whether a smoother needs more; number of stations."""
        self.next_id = 1
        self.id = np.empty(0, np.int64)
        self.status = np.empty(0, np.int8)
        self.born_s = np.empty(0)
        self.updated_s = np.empty(0)
        self.history = np.empty(0, np.int64)
        self.start = np.empty((0, dim))
        self.box = np.empty((0, 4))
        self.merged = np.empty(0, np.int64)
        self.merged_since_s = np.empty(0)
        self.exchange = np.empty(0)
        self.score = np.empty(0)
        self.best = np.empty(0)
        self.run = np.empty(0, np.int64)
        self.label = np.empty(0, np.int64)
        self.alone_s = np.empty(0)
        self.outside = np.empty(0, bool)
        self.entered = np.empty(0, bool)
        self.inward = np.empty((0, 2), bool)
        self.beside = np.empty(0, bool)
        self.towed = np.empty((0, dim))
        self.travelled = np.empty(0)
        self.rest = np.empty((0, dim))
        self.rest_s = np.empty(0)
        self.missed = np.empty((0, stations), np.int64)
        self.visible = np.empty((0, stations))
        self.look = np.empty((0, 3))
        self.shown = np.empty((0, 4, 2))
        self.host = np.empty(0, np.int64)
        self.seat = np.empty((0, 5))
        self.link(np.empty((0, 2 * dim)), np.empty((0, 2 * dim, 2 * dim)), np.empty((0, 2 * dim, 2 * dim)))
        self._columns = self.STATE[1:] + (self.LINKS if smooth else ())

    def __len__(self) -> int:
        return len(self.id)

    def link(self, prior_x: Floats, prior_P: Floats, gain: Floats) -> None:
        """How the rows go on from the scan before, for a smoother."""
        self.prior_x, self.prior_P, self.gain = prior_x, prior_P, gain

    def links(self) -> dict[str, Floats]:
        """What `link` was given, for the rows there are now."""
        return {name: getattr(self, name) for name in self.LINKS}

    @property
    def existence(self) -> Floats:
        """(T,) probability that each row is a target."""
        return expit(self.score)

    @property
    def came_in(self) -> Mask:
        """(T,) rows that came in over the border of the picture, or are coming in."""
        return self.entered | self.inward[:, 0] | self.inward[:, 1]

    def travel(self, xy: Floats) -> Floats:
        """(T,) distances of positions (T, d) from where the rows began."""
        return _distance(xy, self.start, self.inward)

    def travel_apart(self, xy: Floats) -> Floats:
        """(T,) distances of positions (T, d) from where the rows would be if they had gone with vehicles."""
        return _distance(xy, self.towed, self.inward)

    def move(self, xy: Floats, t: float) -> None:
        """Note where the rows are at t: xy (T, d)."""
        _move(xy, self.start, self.inward, self.travelled, self.box, self.rest, self.rest_s, t)

    def come_in(self, xy: Floats, sides: Mask) -> None:
        """Note which sides (T, 4) of the rows at xy (T, d) the border of the picture cuts.

        What is seen of a vehicle that comes in grows, so that its middle moves half as far as the vehicle: along these
        axes distances count twice. Once it is in, its start is moved so that they stay what they were.
        """
        _come_in(xy, sides, self.outside, self.entered, self.inward, self.start, self.towed, self.rest)

    def tow(self, rows: Ints, by: Floats) -> None:
        """Move on where rows (K,) would be if they went with vehicles, that moved by (K, d)."""
        self.towed[rows] += by

    def record_hits(self, hit: Mask, sure: Mask, looked: Mask, station: int, t: float, dt: float) -> None:
        """Note which rows (T,) the scan of a station at t shows, dt seconds after the last, and which of them for sure.

        Only sure ones keep a row alive, and confirm a tentative one. Rows at which the station does not look (T,) are
        neither seen nor missed.
        """
        _see(self.history, self.alone_s, self.updated_s, self.status, self.missed, hit, sure, looked, station, t, dt)

    def seen(self, looked: Mask) -> None:
        """Begin to count misses anew for the rows that were looked at (T,) and seen."""
        _begin_anew(self.missed, self.history, looked)

    def add_evidence(self, log_ratio: Floats, alone: Mask) -> None:
        """Add evidence (T,) to the log-odds of existence of rows that are alone (T,): Bayes' rule."""
        _believe(self.score, self.best, self.status, log_ratio, alone)

    def settle(self) -> None:
        """Set the status of confirmed rows by this scan: confirmed, coasting or merged."""
        _settle(self.status, self.history, self.merged)

    def append(
        self,
        t: float,
        position: Floats,
        box: Floats,
        score: float,
        run: Ints,
        label: Ints | None = None,
        ids: Ints | None = None,
        sides: Mask | None = None,
    ) -> Ints:
        """Register new tentative tracks, cut by sides (B, 4); returns their ids, the next ones unless given."""
        count = len(position)
        sides = np.zeros((count, 4), bool) if sides is None else sides
        following = self.next_id + count
        if ids is None:
            ids = np.arange(self.next_id, following)
        else:
            following = max(following, 1 + int(ids.max(initial=0)))
        self.next_id = following
        new = {
            "id": ids,
            "status": TENTATIVE,
            "born_s": t,
            "updated_s": t,
            "history": 1,
            "start": position,
            "box": box,
            "merged": -1,
            "exchange": 0.0,
            "score": score,
            "best": score,
            "run": run,
            "label": -1 if label is None else label,
            "alone_s": 0.0,
            "outside": np.logical_or.reduce(sides, axis=1),
            "entered": False,
            "inward": inward(sides),
            "beside": False,
            "towed": position,
            "travelled": 0.0,
            "rest": position,
            "rest_s": t,
            "missed": 0,
            "host": -1,
        }
        first = len(self)
        for name in self._columns:
            old = getattr(self, name)
            longer = np.empty((first + count, *old.shape[1:]), old.dtype)
            longer[:first] = old
            longer[first:] = new.get(name, np.nan)
            setattr(self, name, longer)
        return ids

    def rename(self, rows: np.ndarray) -> tuple[Ints, Ints]:
        """Give these rows new ids, one for each old one; returns the old ids and the new ones."""
        old, place = np.unique(self.id[rows], return_inverse=True)
        new = self.next_id + np.arange(len(old))
        self.id[rows] = new[place]
        self.next_id += len(old)
        return old, new

    def keep(self, rows: np.ndarray) -> None:
        """Drop all rows but these indices."""
        for name in self._columns:
            setattr(self, name, getattr(self, name).take(rows, axis=0))


@kernel
def _see(
    history: Ints, alone_s: Floats, updated_s: Floats, status: np.ndarray, missed: Ints,
    hit: Mask, sure: Mask, looked: Mask, station: int, t: float, dt: float,
) -> None:  # fmt: skip
    for i in range(len(hit)):
        alone_s[i] += dt * hit[i]
        if hit[i] and sure[i]:
            updated_s[i] = t
        counts = hit[i] and (sure[i] or status[i] != TENTATIVE)
        if looked[i]:
            history[i] = (history[i] << 1 | counts) & SCANS
            missed[i, station] += 1


@kernel
def _begin_anew(missed: Ints, history: Ints, looked: Mask) -> None:
    for i in range(len(looked)):
        if looked[i] and history[i] & 1:
            for station in range(missed.shape[1]):
                missed[i, station] = 0


@kernel
def _believe(score: Floats, best: Floats, status: np.ndarray, log_ratio: Floats, alone: Mask) -> None:
    for i in range(len(score)):
        told = log_ratio[i] if alone[i] else 0.0
        score[i] = min(max(score[i] + told, -BELIEF), BELIEF)
        if status[i] != TENTATIVE:
            best[i] = max(best[i], score[i])


@kernel
def _settle(status: np.ndarray, history: Ints, merged: Ints) -> None:
    for i in range(len(status)):
        if status[i] != TENTATIVE:
            status[i] = CONFIRMED if history[i] & 1 else COASTING
        if merged[i] >= 0:
            status[i] = MERGED


def inward(sides: Mask) -> Mask:
    """(T, 2) axes along which boxes cut by sides (T, 4) may come in.

    Not over the top: there far vehicles come into view whole.
    """
    inward = sides[:, 2:].copy()
    inward[:, 0] |= sides[:, 0]
    return inward


@kernel
def _come_in(
    xy: Floats, sides: Mask, outside: Mask, entered: Mask, inward: Mask, start: Floats, towed: Floats, rest: Floats
) -> None:
    for i in range(len(xy)):
        out = outside[i] and (sides[i, 0] or sides[i, 1] or sides[i, 2] or sides[i, 3])
        entered[i] |= outside[i] and not out
        outside[i] = out
        for axis in range(2):
            cut = sides[i, axis + 2] or (axis == 0 and sides[i, 0])
            if inward[i, axis] and not cut:
                inward[i, axis] = False
                start[i, axis] -= xy[i, axis] - start[i, axis]
                towed[i, axis] -= xy[i, axis] - towed[i, axis]
                rest[i, axis] -= xy[i, axis] - rest[i, axis]


@kernel
def _move(
    xy: Floats, start: Floats, inward: Mask, travelled: Floats, box: Floats, rest: Floats, rest_s: Floats, t: float
) -> None:
    farthest, moved = _distance(xy, start, inward), _distance(xy, rest, inward)
    for i in range(len(xy)):
        travelled[i] = max(travelled[i], farthest[i])
        if moved[i] > REST * max(box[i, 2], box[i, 3]):
            rest_s[i] = t
            for axis in range(xy.shape[1]):
                rest[i, axis] = xy[i, axis]


@kernel
def _distance(a: Floats, b: Floats, twice: Mask) -> Floats:
    """(T,) distances between points a and b (T, d); axes that count twice (T, 2)."""
    distance = np.empty(len(a))
    for t in range(len(a)):
        total = 0.0
        for axis in range(a.shape[1]):
            apart = a[t, axis] - b[t, axis]
            total += (2 * apart if axis < 2 and twice[t, axis] else apart) ** 2
        distance[t] = np.sqrt(total)
    return distance
