"""All vehicles of a day: their rows go in one after the other, their speeds, sizes and classes come out."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.vehicles.band import SIZE
from vidtrack.traffic.vehicles.classes import Classified, classified
from vidtrack.traffic.vehicles.fit import MEAN, SIGMA, fit
from vidtrack.traffic.vehicles.knots import Knots, Knotting
from vidtrack.traffic.vehicles.pieces import pieces
from vidtrack.traffic.vehicles.scale import Scale, scale_of
from vidtrack.traffic.vehicles.straightness import LOOKED_AT, Paths, Straightness, paths_of, straightness

_Table = TypeVar("_Table", "_Sizes", Classified, Paths)
_BATCH, _AT_ONCE = 1024, 2
"""Tracks that are fitted together, and how many such batches at a time: they bound the memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Speeds:
    """W speeds, NaN where they are not known: (W,) m/s, standard deviations of the own and of the shared error."""

    speed: Floats
    own: Floats
    shared: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """Speeds that were asked for; classes of T tracks, NaN where there is no fit; what contradicts the calibration."""

    speeds: Speeds
    classes: Classified
    scale: Scale | None
    straightness: Straightness | None


class Vehicles:
    """Takes rows in order of time; None for the ground: nothing is known in metres."""

    def __init__(self, ground: Ground | None) -> None:
        self._ground = ground
        self._knotting = Knotting()

    def add(self, track: Ints, t: Floats, xy: Floats, edge: Floats) -> None:
        """Look at rows: track (N,), t (N,) s, xy (N, 2) m, edge (N, 4) px left, top, right and lower edges seen."""
        if self._ground is not None:
            self._knotting.add(track, t, xy, edge)

    def fitted(self, vehicle: Ints, track: Ints, t: Floats) -> Fitted | None:
        """Speeds of tracks (W,) at times (W,) s, and the classes of all T; None without edges.

        vehicle  (T,) number of the first track of the vehicle that each track is of: they have one size
        """
        if self._ground is None:
            return None
        tracks = len(vehicle)
        knots = self._knotting.knots(tracks)
        if len(knots.t) == 0:
            return None
        ground, order = self._ground, np.argsort(track, kind="stable")
        first = np.searchsorted(track[order], np.arange(0, tracks + _BATCH, _BATCH))

        def batch(number: int) -> tuple[_Sizes, Classified, Paths]:
            begin, asked = number * _BATCH, order[first[number] : first[number + 1]]
            some = knots.between(begin, min(begin + _BATCH, tracks))
            looked = np.arange(begin, begin + _BATCH) % every == 0
            speeds[:, asked], found, paths = _fitted(ground, some, track[asked] - begin, t[asked], looked)
            of_size = classified(found.information, found.vector, found.speed)
            return replace(found, track=found.track + begin), of_size, paths

        speeds, every = np.full((3, len(t)), np.nan), -(-tracks // LOOKED_AT)
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            sizes, classes, driven = zip(*pool.map(batch, range(len(first) - 1)), strict=True)
        told, of_size, straight = _together(_Sizes, sizes), _together(Classified, classes), _together(Paths, driven)
        best = _last(told.worth, vehicle[told.track])  # of each vehicle the track that tells most
        scale = scale_of(told.information[best], told.vector[best], told.speed[best])
        whole = _of_all(of_size.of(best), vehicle[told.track[best]], vehicle)
        return Fitted(Speeds(*speeds), whole, scale, straightness(straight))


@dataclass(frozen=True, slots=True, eq=False)
class _Sizes:
    """What B tracks (B,) say about the size s of their vehicles, exp(-s' A s / 2 + b' s), and their mean speeds [m/s].

    worth (B,) how much, information (B, 3, 3) A, vector (B, 3) b, speed (B,)
    """

    track: Ints
    worth: Floats
    information: Floats
    vector: Floats
    speed: Floats


def _fitted(ground: Ground, knots: Knots, track: Ints, t: Floats, looked: Mask) -> tuple[Floats, _Sizes, Paths]:
    """(3, W) speeds as in `Speeds`, sizes, and the straight paths of those that are `looked` at, of some tracks.

    Each time is looked up in the piece that it lies in.
    """
    with np.errstate(invalid="ignore"):
        place = ground.metres(ground.inside(_foot(knots.edge)))
    sure = np.isfinite(place[:, 0])
    knots, place = knots.only(sure), place[sure]
    first = pieces(ground, knots, place)
    owner = np.searchsorted(knots.first, first[:-1], side="right") - 1
    of_piece = _piece_of(knots, first, owner, track, t)
    order = np.argsort(of_piece, kind="stable")
    asked_of = np.searchsorted(of_piece[order], np.arange(len(owner) + 1))
    path, speed = np.empty((len(knots.t), 2)), np.full((len(t), 6), np.nan)
    size, cov, misfit = np.empty((len(owner), SIZE)), np.empty((len(owner), SIZE, SIZE)), np.empty(len(owner))
    pose = ground.pose()
    up = np.zeros(3) if pose is None else pose.up
    fit(
        first, knots.t, _straight(ground, knots.edge), knots.rows, place, ground.homography, up,
        asked_of, t[order], path, size, cov, misfit, speed,
    )  # fmt: skip
    result = np.empty((3, len(t)))
    result[0, order], result[1, order] = speed[:, 0], speed[:, 1]
    result[2, order] = _by_shared(ground, knots.t, path, speed)
    driven = paths_of(ground, path, first, np.isfinite(misfit) & looked[owner])
    return result, _sizes(knots.t, first, owner, path, size, cov, misfit), driven


def _by_shared(ground: Ground, t: Floats, path: Floats, speed: Floats) -> Floats:
    """(W,) m/s; standard deviation of speeds (W, 6) by the calibration: it moves the two ends of a step apart."""
    sigma = np.full(len(speed), np.nan)
    known = np.flatnonzero(np.isfinite(speed[:, 0]))
    i, j = speed[known, 4].astype(int), speed[known, 5].astype(int)
    apart = ground.by_shared_error(path[j]) - ground.by_shared_error(path[i])
    along = np.einsum("wi,wik->wk", speed[known, 2:4], apart) / (t[j] - t[i])[:, None]
    sigma[known] = np.linalg.norm(along, axis=1)
    return sigma


def _sizes(t: Floats, first: Ints, owner: Ints, path: Floats, size: Floats, cov: Floats, misfit: Floats) -> _Sizes:
    """By the piece of each track that tells most; without what was known beforehand."""
    worth = np.nan_to_num(np.diff(first) / misfit)
    best = _last(worth, owner)
    best = best[worth[best] > 0]
    begin, end = first[best], first[best + 1] - 1
    known = np.diag(1 / SIGMA[:3] ** 2)
    inverse = np.linalg.inv(cov[best, :3, :3])
    vector = np.einsum("tij,tj->ti", inverse, size[best, :3]) - known @ MEAN[:3]
    return _Sizes(
        owner[best],
        worth[best],
        (inverse - known) / misfit[best, None, None],
        vector / misfit[best, None],
        np.linalg.norm(path[end] - path[begin], axis=1) / (t[end] - t[begin]),
    )


def _together(kind: type[_Table], parts: Sequence[_Table]) -> _Table:
    """The rows of several tables of a kind, one after the other."""
    return kind(*(np.concatenate([getattr(part, column.name) for part in parts]) for column in fields(kind)))


def _last(worth: Floats, owner: Ints) -> Ints:
    """The indices of those that are worth most, one of each owner."""
    order = np.lexsort((worth, owner))
    return order[np.diff(owner[order], append=-1) != 0]


def _of_all(found: Classified, who: Ints, vehicle: Ints) -> Classified:
    """The classes of all tracks, each of a vehicle (T,), by those of the vehicles `who`; NaN where nothing is told."""
    parts = found.probability, found.size, found.sigma
    result = [np.full((len(vehicle), part.shape[1]), np.nan) for part in parts]
    for whole, part in zip(result, parts, strict=True):
        whole[who] = part
    return Classified(*(whole[vehicle] for whole in result))


def _piece_of(knots: Knots, first: Ints, owner: Ints, track: Ints, t: Floats) -> Ints:
    """(W,) the piece of a track (W,) that a time (W,) lies in or after; len(owner) where there is none."""
    begin = np.append(knots.t, np.inf)[first[:-1]]
    day = 2 * (max(np.abs(knots.t).max(initial=0), np.abs(t).max(initial=0)) + 1)  # longer than all times
    at = np.searchsorted(begin + day * owner, t + day * track, side="right") - 1
    return np.where(np.append(owner, -1)[at] == track, at, len(owner))


def _foot(edge: Floats) -> Floats:
    """(N, 2) middles of the lower edges [px]; of one whose side the border cuts, its other corner."""
    left, _, right, bottom = edge.T
    return np.column_stack([_middle(left, right), bottom])


def _middle(a: Floats, b: Floats) -> Floats:
    """(N,) middles of a and b; where one of them is not known, the other."""
    return (np.where(np.isnan(a), b, a) + np.where(np.isnan(b), a, b)) / 2


def _straight(ground: Ground, edge: Floats) -> Floats:
    """(K, 4) edges without the lens's distortion, each at its middle."""
    if ground.lens is None:
        return edge
    left, top, right, bottom = edge.T
    x, y = _middle(left, right), _middle(top, bottom)
    points = ((left, y, 0), (x, top, 1), (right, y, 0), (x, bottom, 1))
    return np.column_stack([ground.straight(np.column_stack([a, b]))[:, axis] for a, b, axis in points])
