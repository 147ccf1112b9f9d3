"""Routes over the ground, and where they share the road or cross.

A route is a lane's centre line from where vehicles come to where they go. Two tables say all about a pair (r, q):
where a place on q lies on r when both go the same way there (`beside`), and which part of each lies too near to the
other for both to be used at the same time (`Conflicts`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from vidtrack.arrays.types import Floats, Ints, Mask

STEP_M = 0.5  # between the points of a route
SAME_WAY = np.radians(55)
SAME_LANE_M = 3.2  # centre lines nearer than this carry one vehicle side by side
CLEAR_M = 4.0  # centre lines that cross stay this far apart
CLEAR_PARALLEL_M = 3.2
CLEAR_OPPOSITE_M = 2.7
MERGED_M = 6.0  # routes that go the same way for longer are one lane there
SIDEWAYS = 2.0  # m/s^2; what passengers bear in a curve
SLOWING = 1.3  # m/s^2; before a curve
BEFORE_CONFLICT_M = 1.0  # from the stop line to the first conflict

Red = Callable[[float], bool]


@dataclass(frozen=True, slots=True, eq=False)
class Route:
    """A lane's centre line.

    xy      (P, 2) m, about STEP_M apart
    start, end  names of the legs
    origin  vehicles of equal origin come one behind the other
    limit   m/s; allowed speed
    share   of the origin's vehicles that take it
    yields  rank: a route gives way to those of a lower one
    stop_m  m along the route of a painted stop line; None: where the first conflict is
    red     whether the signal there is red at a time [s]; None: no signal
    long    whether lorries and buses take it
    left, right  neighbouring lanes, as indices of routes; -1: none
    """

    xy: Floats
    start: str
    end: str
    origin: str
    limit: float
    share: float = 1.0
    yields: int = 0
    stop_m: float | None = None
    red: Red | None = None
    long: bool = True
    left: int = -1
    right: int = -1


def smooth(points: list[tuple[float, float]], window: float) -> Floats:
    """(P, 2) a polyline through `points`, its corners rounded by a running mean of `window` m, twice."""
    corner = np.array(points)
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(corner, axis=0), axis=1))])
    fine = np.arange(0, along[-1], 0.1)
    xy = np.stack([np.interp(fine, along, corner[:, k]) for k in (0, 1)], axis=1)
    half = round(window / 0.2)
    for _ in range(2):
        ahead = xy[-1] + np.arange(1, half + 1)[:, None] * (xy[-1] - xy[-2])
        behind = xy[0] - np.arange(half, 0, -1)[:, None] * (xy[1] - xy[0])
        total = np.cumsum(np.concatenate([np.zeros((1, 2)), behind, xy, ahead]), axis=0)
        xy = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
    return xy[:: round(STEP_M / 0.1)]


@dataclass(frozen=True, slots=True, eq=False)
class Conflicts:
    """(R, R) tables of what a vehicle on route r (row) must see clear of vehicles on q (column) before it goes.

    there   whether there is a conflict behind r's stop line
    merges  both go on in one lane
    leaves  m along r; where its own rear has left the conflict
    begins, ends  m along q; a vehicle between them is in the conflict
    """

    there: Mask
    merges: Mask
    leaves: Floats
    begins: Floats
    ends: Floats


class Network:
    """Routes with everything that follows from their geometry.

    reach  m beyond a stop line; conflicts farther away are met by following only (a roundabout's next entry)
    """

    def __init__(self, routes: list[Route], reach: float = 60.0) -> None:
        self.routes, self.reach = routes, reach
        count, longest = len(routes), max(len(route.xy) for route in routes)
        self._s = np.full((count, longest), np.nan)
        pose = np.full((count, longest, 3), np.nan)
        self._speed, self._time = np.full((count, longest), np.nan), np.full((count, longest), np.nan)
        for r, route in enumerate(routes):
            step, n = np.linalg.norm(np.diff(route.xy, axis=0), axis=1), len(route.xy)
            s = np.concatenate([[0], np.cumsum(step)])
            dx, dy = np.gradient(route.xy, s, axis=0).T
            pose[r, :n] = np.column_stack([route.xy, np.unwrap(np.arctan2(dy, dx))])
            self._s[r, :n] = s
            self._speed[r, :n] = _speeds(s, pose[r, :n, 2], route.limit)
            self._time[r, :n] = np.concatenate([[0], np.cumsum(step / self._speed[r, 1:n])])
        self._pose = pose
        self.length = np.nanmax(self._s, axis=1)
        self.rank = np.array([route.yields for route in routes])
        self.origin = np.unique([route.origin for route in routes], return_inverse=True)[1]
        self._span = float(self.length.max()) + 100
        real = ~np.isnan(self._s)
        self._key = (np.arange(count)[:, None] * self._span + self._s)[real]
        self._columns = {"x": pose[..., 0][real], "y": pose[..., 1][real], "heading": pose[..., 2][real]}
        self._columns |= {"speed": self._speed[real], "time": self._time[real]}
        self.has_lanes = any(route.left >= 0 or route.right >= 0 for route in routes)
        self._beside = np.full((count, count, longest), np.nan)
        self._trees = [cKDTree(route.xy) for route in routes]
        self._near = {(r, q): self._relate(r, q) for r in range(count) for q in range(count)}
        self.related = ~np.isnan(self._beside).all(axis=2)

    def _at(self, column: str, route: Ints, s: Floats) -> Floats:
        return np.interp(np.clip(s, 0, self.length[route]) + self._span * route, self._key, self._columns[column])

    def pose(self, route: Ints, s: Floats) -> tuple[Floats, Floats]:
        """Positions (N, 2) m and headings (N,) rad at s (N,) along routes (N,)."""
        return np.stack([self._at("x", route, s), self._at("y", route, s)], axis=-1), self._at("heading", route, s)

    def speed(self, route: Ints, s: Floats) -> Floats:
        """Wished speed (N,) m/s: the limit, and what curves ahead allow."""
        return self._at("speed", route, s)

    def travel_s(self, route: Ints, s: Floats) -> Floats:
        """Time (N,) from a route's beginning at the wished speed."""
        return self._at("time", route, s)

    def beside(self, r: Ints, q: Ints, s: Floats) -> Floats:
        """Where on r the place s on q lies, m; NaN where they do not go the same way there. Arrays broadcast."""
        at = np.clip(np.rint(s / STEP_M), 0, self._s.shape[1] - 1).astype(int)
        return np.asarray(self._beside[r, q, at] + s - self._s[q, at])

    @cached_property
    def stop(self) -> Floats:
        """(R,) m; stop line of each route, a metre before its first conflict; infinite: none."""
        first = np.array(
            [
                min((near[0][0] for (r, _), near in self._near.items() if r == row and len(near[0])), default=np.inf)
                for row in range(len(self.routes))
            ]
        )
        lines = np.array([first[self.origin == origin].min() for origin in self.origin]) - BEFORE_CONFLICT_M
        painted = [np.inf if route.stop_m is None else route.stop_m for route in self.routes]
        return np.minimum(lines, painted)

    @cached_property
    def conflicts(self) -> Conflicts:
        """What each route must see clear: the first part of it behind its stop line that lies too near to another."""
        count = len(self.routes)
        there, merges = np.zeros((count, count), bool), np.zeros((count, count), bool)
        leaves, begins, ends = (np.full((count, count), np.nan) for _ in range(3))
        for (r, q), (near, other) in self._near.items():
            if len(near) == 0 or near[0] > self.stop[r] + self.reach:
                continue
            last = np.append(np.flatnonzero(np.diff(near) > 4 * STEP_M), len(near) - 1)[0]
            low, high = other[: last + 1, 0].min(), other[: last + 1, 1].max()
            s = self._s[q]
            shared = (s >= low) & (s <= high) & (self._beside[r, q] >= near[0])
            there[r, q], merges[r, q] = True, shared.sum() * STEP_M > MERGED_M
            begins[r, q], ends[r, q], leaves[r, q] = low, high, near[last]
            if merges[r, q]:
                ends[r, q] = s[shared][0]
                leaves[r, q] = self._beside[r, q][shared][0]
        return Conflicts(there, merges, leaves, begins, ends)

    def _relate(self, r: int, q: int) -> tuple[Floats, Floats]:
        """Fill r's row of `_beside` for q. Places (n,) on r in conflict with q, and the part (n, 2) of q for each."""
        pairs = self._trees[r].sparse_distance_matrix(self._trees[q], CLEAR_M, output_type="ndarray")
        i, j, away = pairs["i"], pairs["j"], pairs["v"]
        heading = self._pose[r, i, 2]
        facing = np.cos(heading - self._pose[q, j, 2])
        same = np.flatnonzero((facing > np.cos(SAME_WAY)) & (away < SAME_LANE_M))
        same = same[np.argsort(-away[same], kind="stable")]  # of equal j the nearest is written last
        shift = self._pose[q, j, :2] - self._pose[r, i, :2]
        along = self._s[r, i] + shift[:, 0] * np.cos(heading) + shift[:, 1] * np.sin(heading)
        self._beside[r, q, j[same]] = along[same]
        if self.origin[r] == self.origin[q]:
            return np.empty(0), np.empty((0, 2))
        clear = np.where(facing > np.cos(np.radians(30)), CLEAR_PARALLEL_M, CLEAR_M)
        near = away < np.where(facing < np.cos(np.radians(150)), CLEAR_OPPOSITE_M, clear)
        part = np.tile([np.inf, -np.inf], (self._s.shape[1], 1))
        np.minimum.at(part[:, 0], i[near], self._s[q, j[near]])
        np.maximum.at(part[:, 1], i[near], self._s[q, j[near]])
        rows = np.unique(i[near])
        return self._s[r, rows], part[rows]


def _speeds(s: Floats, heading: Floats, limit: float) -> Floats:
    """(P,) the limit, less in curves and before them."""
    bend = np.abs(np.gradient(heading, s))
    speed = np.minimum(limit, np.sqrt(SIDEWAYS / np.maximum(bend, 1e-6)))
    for k in range(len(s) - 2, -1, -1):
        speed[k] = min(speed[k], np.sqrt(speed[k + 1] ** 2 + 2 * SLOWING * (s[k + 1] - s[k])))
    return np.asarray(speed)
