"""What straight paths say about a calibration: lanes of a straight road are parallel on the ground, and straight.

Through a homography lines stay lines, but where its points are wrong the lanes of one road converge: the direction of a
path changes with its place across the road. Through a lens they bend, the more the farther from the middle of the
picture, and towards it or away from it. A bend of the road bends all its paths to the same side, so it is told apart
where roads lie on both sides of the middle, or in several directions; else the lens's standard deviation is large.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.traffic.calibration.ground import Ground

_LEAST_M, _LEAST_KNOTS = 15.0, 6
"""Of a path that is looked at"""
_STRAIGHT = 0.02
"""Largest rise of the arc over its chord, as a share: else the vehicle turns"""
_ROAD, _LEAST_PATHS, _MOST_ROADS = np.radians(6.0), 10, 4
"""rad to either side; paths of one road differ by less. How many make a road"""
_MOST_PATHS = 600
"""More than that say nothing new."""
LOOKED_AT = 40 * _MOST_PATHS
"""Tracks of a day among which these are looked for, evenly spread: all, or at least half as many as this"""
_WANDER_M = 0.15
"""m; standard deviation of where vehicles drive within their lane, at each end of a path and in its middle"""
_LANES, _LENS_PX = np.radians(0.25), 3.0
"""rad; the outer lanes of a road are so parallel. px in the corner; footprints of boxes are off by as much"""
_SIGMAS, _ROUNDS, _FAR = 3.0, 6, 2.0
"""Limit of a doubt; rounds of reweighting, and the standard deviations from which on a path loses its weight"""


@dataclass(frozen=True, slots=True, eq=False)
class Paths:
    """W paths of vehicles that drove straight on.

    middle (W, 2) m; angle (W,) rad, their direction in (-pi/2, pi/2]; length (W,) m
    bend     (W,) 1/m; the path lies bend s2 to the left of its chord, a distance s from the middle
    by_lens  (W,) 1/m; the bend that a lens would make which moves the corner of the picture by 1 px
    shared   (W, 8) rad; change of the direction by the calibration's errors of unit variance
    """

    middle: Floats
    angle: Floats
    length: Floats
    bend: Floats
    by_lens: Floats
    shared: Floats

    def only(self, chosen: Mask) -> Paths:
        """The paths of a mask."""
        return Paths(*(getattr(self, name)[chosen] for name in self.__slots__))


@dataclass(frozen=True, slots=True)
class Straightness:
    """What straight paths contradict.

    converging   rad; by how much the outer paths of a road converge, where that is surest, and its sigma
    apart        m; between them
    lens         px; by how much the calibration misses the bend by the lens in the corner of the picture, and its sigma
    paths        how many of them
    """

    converging: float
    converging_sigma: float
    apart: float
    lens: float
    lens_sigma: float
    paths: int

    @property
    def converges(self) -> bool:
        return bool(abs(self.converging) > _SIGMAS * self.converging_sigma)

    @property
    def bends(self) -> bool:
        return bool(abs(self.lens) > _SIGMAS * self.lens_sigma)

    def told(self) -> dict[str, float | int | bool]:
        """In plain data."""
        return {
            "converging_deg": round(float(np.degrees(self.converging)), 3),
            "converging_sigma_deg": round(float(np.degrees(self.converging_sigma)), 3),
            "apart_m": round(self.apart, 2),
            "converges": self.converges,
            "lens_px": round(self.lens, 2),
            "lens_sigma_px": round(self.lens_sigma, 2),
            "bends": self.bends,
            "paths": self.paths,
        }


def paths_of(ground: Ground, xy: Floats, first: Ints, sound: Mask) -> Paths:
    """The straight ones among P paths.

    xy (K, 2) m their corners; first (P + 1,) where each begins; sound (P,) those that are looked at
    """
    count = np.diff(first)
    piece = np.flatnonzero(sound & (count >= _LEAST_KNOTS))
    number = np.full(len(count), -1)
    number[piece] = np.arange(len(piece))
    owner = number[np.repeat(np.arange(len(count)), count)]
    xy, owner = xy[owner >= 0], owner[owner >= 0]

    def mean(values: Floats) -> Floats:
        return np.bincount(owner, values, len(piece)) / np.maximum(count[piece], 1)

    middle = np.column_stack([mean(xy[:, 0]), mean(xy[:, 1])])
    off = xy - middle[owner]
    xx, yy, cross = mean(off[:, 0] ** 2), mean(off[:, 1] ** 2), mean(off[:, 0] * off[:, 1])
    angle = np.arctan2(2 * cross, xx - yy) / 2
    ahead = np.column_stack([np.cos(angle), np.sin(angle)])
    left = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    s, aside = np.sum(off * ahead[owner], axis=1), np.sum(off * left[owner], axis=1)
    moments = [mean(s**k) for k in range(5)]
    normal = np.array([[moments[i + j] for j in range(3)] for i in range(3)]).transpose(2, 0, 1)
    length = np.full(len(piece), -np.inf)
    np.maximum.at(length, owner, s)
    short = np.full(len(piece), np.inf)
    np.minimum.at(short, owner, s)
    length -= short

    def bend(values: Floats) -> Floats:
        vector = np.column_stack([mean(values * s**k) for k in range(3)])
        return np.asarray(np.linalg.solve(normal, vector[..., None])[:, 2, 0])

    known = length > _LEAST_M
    if not known.any():
        return Paths(
            middle[known], angle[known], length[known], angle[known], angle[known], np.empty((0, len(ground.cov)))
        )
    normal[~known] = np.eye(3)  # a short piece may be a single place
    arm = (ground.pixels(xy) - ground.center) / np.linalg.norm(ground.center)
    moved = np.einsum("kij,kj->ki", ground.by_own_error(xy), arm * np.sum(arm**2, axis=1)[:, None])
    bent, by_lens = bend(aside), bend(np.sum(moved * left[owner], axis=1))
    half = length[:, None] / 2 * ahead
    turned = ground.by_shared_error(middle + half) - ground.by_shared_error(middle - half)
    shared = np.einsum("wi,wik->wk", left, turned) / length[:, None]
    known &= np.abs(bent) * length / 4 < _STRAIGHT
    return Paths(middle, angle, length, bent, by_lens, shared).only(known)


def straightness(paths: Paths) -> Straightness | None:
    """None for too few paths."""
    paths = paths.only(np.arange(len(paths.angle)) % -(-max(len(paths.angle), 1) // _MOST_PATHS) == 0)
    road = _roads(paths.angle)
    if not (road >= 0).any():
        return None
    paths, road = paths.only(road >= 0), road[road >= 0]
    told = [_converging(paths.only(road == k)) for k in range(road.max() + 1)]
    converging, sigma, apart = max(told, key=lambda one: abs(one[0]) / one[1])
    lens, lens_sigma = _lens(paths, road)
    return Straightness(converging, sigma, apart, lens, lens_sigma, len(road))


def _roads(angle: Floats) -> Ints:
    """(W,) the road that a path with a direction (W,) goes along, those with most paths first; -1: of none."""
    road = np.full(len(angle), -1)
    for k in range(_MOST_ROADS):
        free = np.flatnonzero(road < 0)
        near = np.abs(_turn(angle[free][:, None] - angle[free])) < _ROAD
        if len(free) == 0 or near.sum(axis=1).max() < _LEAST_PATHS:
            break
        road[free[near[np.argmax(near.sum(axis=1))]]] = k
    return road


def _turn(angle: Floats) -> Floats:
    """The same angles between undirected lines, in [-pi/2, pi/2)."""
    return np.asarray((angle + np.pi / 2) % np.pi - np.pi / 2)


def _converging(paths: Paths) -> tuple[float, float, float]:
    """By how much the outer paths of a road converge [rad], its sigma, and how far they are apart [m]."""
    mean = np.angle(np.exp(2j * paths.angle).sum()) / 2
    across = (paths.middle - paths.middle.mean(axis=0)) @ np.array([-np.sin(mean), np.cos(mean)])
    design = np.column_stack([np.ones(len(across)), across])
    slope, spread, gain = _fitted(design, _turn(paths.angle - mean), np.sqrt(2) * _WANDER_M / paths.length)
    low, high = np.percentile(across, [5, 95])
    apart = float(high - low)
    sigma = np.sqrt(spread[1, 1] + np.sum((gain[1] @ paths.shared) ** 2))
    return float(slope[1]) * apart, float(np.hypot(sigma * apart, _LANES)), apart


def _lens(paths: Paths, road: Ints) -> tuple[float, float]:
    """By how much the lens moves the corner of the picture, beside what the calibration has [px], and its sigma."""
    mean = np.array([np.angle(np.exp(2j * paths.angle[road == k]).sum()) / 2 for k in range(road.max() + 1)])
    same = np.where(np.cos(paths.angle - mean[road]) > 0, 1.0, -1.0)
    curves = (road[:, None] == np.arange(len(mean))).astype(float)
    design = np.column_stack([curves, same * paths.by_lens])
    found, spread, _ = _fitted(design, same * paths.bend, np.sqrt(1.5) * _WANDER_M * 4 / paths.length**2)
    return float(found[-1]), float(np.sqrt(spread[-1, -1] + _LENS_PX**2))


def _fitted(design: Floats, y: Floats, sigma: Floats) -> tuple[Floats, Floats, Floats]:
    """Least squares that outliers do not move: the unknowns (n,), their covariance, their derivatives by y (n, W)."""
    weight = np.ones(len(y))
    scale = 1.0
    for _ in range(_ROUNDS):
        rooted = np.sqrt(weight) / sigma
        gain = np.linalg.pinv(design * rooted[:, None]) * rooted
        found = gain @ y
        off = np.abs(y - design @ found) / sigma
        scale = max(1.0, 1.4826 * float(np.median(off)))
        weight = 1 / np.maximum(1.0, off / (_FAR * scale))
    return found, (gain * (scale * sigma) ** 2) @ gain.T, gain
