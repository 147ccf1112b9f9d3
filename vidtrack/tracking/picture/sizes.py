"""Typical size of vehicles at each place of the picture, learnt from tracks."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.median import median
from vidtrack.arrays.rows import located
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import kernel
from vidtrack.tracks import CONFIRMED, Tracks

_SAMPLES = 400  # kept, the newest
_STRIDE = 1 / 3  # sizes that a vehicle moves between two samples of it
_TRACKS = 5  # different vehicles that make a field
_SPREAD = (0.4, 0.5)  # largest standard deviations of ln width and ln height of a field that says anything
_REFIT_S = 1.0
_ROUNDS = 6  # of reweighting
_FLAT = 0.3  # prior standard deviation of a slope: shares of the typical size over one picture width
_QUANTILE = 0.7  # what counts as typical: vehicles come in pieces more often than in pairs
_SIGMAS = 1.95  # standard deviations of a normal variable in the median of what it exceeds that quantile by
_SLOPES = np.diag([0.0, 1.0, 1.0])
_LEAST = 0.5  # of the smallest sample: the field is not extrapolated to nothing


class SizeField:
    """Typical width and height, each a + b x + c y of a box's bottom centre, robustly fitted to ln size.

    spread  (2,) standard deviations of ln width and ln height about the field; infinite before there is one
    """

    STATE = ("spread", "_extent", "_fit", "_floor", "_place", "_size", "_of", "_id", "_xy", "_fitted_s")

    def __init__(self, width: float, height: float) -> None:
        """width, height of the picture [px]."""
        self.spread: Floats = np.full(2, np.inf)
        self._extent = float(max(width, height))
        self._fit: Floats = np.zeros((3, 2))
        self._floor: Floats = np.zeros(2)
        self._place: Floats = np.empty((0, 3))  # 1, x, y over the extent
        self._size: Floats = np.empty((0, 2))
        self._of: Ints = np.empty(0, np.int64)  # track of each sample
        self._id: Ints = np.empty(0, np.int64)  # tracks that were sampled, ascending, and where last
        self._xy: Floats = np.empty((0, 2))
        self._fitted_s = 0.0

    @property
    def known(self) -> bool:
        """Whether the field is fitted."""
        return bool((self.spread < _SPREAD).all())

    def typical(self, box: Floats) -> Floats:
        """(N, 2) width and height typical of vehicles whose bottom centre is that of boxes (N, 4); NaN if unknown."""
        if not self.known:
            return np.full((len(box), 2), np.nan)
        return _fitted(box, self._extent, self._fit, self._floor)

    def area(self, box: Floats) -> Floats:
        """(N,) area typical of vehicles at the place of boxes (N, 4); NaN if unknown."""
        return np.prod(self.typical(box), axis=1)

    def learn(self, tracks: Tracks, whole: Mask) -> None:
        """Take samples of tracks (T,) that are alone, `whole` (T,) and have driven; refit once a second."""
        rows, self._id, self._xy = _sampled(
            tracks.id, tracks.status, tracks.group, tracks.travel, tracks.box, tracks.xy, whole, self._id, self._xy
        )
        if len(rows):
            self._place = np.concatenate([self._place, _places(tracks.box[rows], self._extent)])[-_SAMPLES:]
            self._size = np.concatenate([self._size, tracks.box[rows, 2:]])[-_SAMPLES:]
            self._of = np.concatenate([self._of, tracks.id[rows]])[-_SAMPLES:]
        if tracks.t - self._fitted_s >= _REFIT_S:
            self._fitted_s = tracks.t
            _, of, number = np.unique(self._of, return_inverse=True, return_counts=True)
            if len(number) >= _TRACKS:
                self._refit(1 / np.sqrt(number[of]))

    def _refit(self, vote: Floats) -> None:
        """Quantile regression of relative sizes by iteratively reweighted least squares, votes (N,) of the samples.

        The field stays what it is while vehicles differ too much for another one.
        """
        fits, floors, spread = np.empty((3, 2)), np.empty(2), np.empty(2)
        for axis in range(2):
            size = self._size[:, axis]
            middle = median(size.copy())
            fit, scale = np.array([middle, 0.0, 0.0]), 0.5
            floors[axis] = _LEAST * size.min()
            for _ in range(_ROUNDS):
                expected = np.maximum(self._place @ fit, floors[axis])
                error = np.log(size / expected)
                above = error > 0
                excess = error[above]
                scale = max(_SIGMAS * median(excess), 0.02) if len(excess) else 0.02
                side = np.where(above, _QUANTILE, 1 - _QUANTILE)
                weight = vote * side / np.maximum(np.abs(error), 0.1 * scale) * scale / expected**2
                flat = _SLOPES * (scale / (_FLAT * 10 * middle)) ** 2
                weighted = (self._place * weight[:, None]).T
                fit = np.linalg.solve(weighted @ self._place + flat, weighted @ size)
            fits[:, axis], spread[axis] = fit, scale
        if (spread < _SPREAD).all():
            self._fit, self._floor, self.spread = fits, floors, spread


@kernel
def _places(box: Floats, extent: float) -> Floats:
    """(N, 3) 1, x, y of the bottom centres of boxes (N, 4), in units of the picture's extent from its middle."""
    place = np.ones((len(box), 3))
    for i in range(len(box)):
        place[i, 1] = (box[i, 0] + box[i, 2] / 2) / extent - 0.5
        place[i, 2] = (box[i, 1] + box[i, 3]) / extent - 0.5
    return place


@kernel
def _fitted(box: Floats, extent: float, fit: Floats, floor: Floats) -> Floats:
    """(N, 2) places (N, 3) of boxes (N, 4) times fit (3, 2), at least floor (2,); NaN stays NaN."""
    place, size = _places(box, extent), np.empty((len(box), 2))
    for i in range(len(place)):
        for axis in range(2):
            value = place[i, 0] * fit[0, axis] + place[i, 1] * fit[1, axis] + place[i, 2] * fit[2, axis]
            size[i, axis] = floor[axis] if value < floor[axis] else value
    return size


@kernel
def _sampled(
    name: Ints, status: np.ndarray, group: Ints, travel: Floats, box: Floats, xy: Floats, whole: Mask,
    known: Ints, before: Floats,
) -> tuple[Ints, Ints, Floats]:  # fmt: skip
    """(N,) rows of the tracks (T,) that are sampled now, names (K,) of all sampled so far, ascending, and where (K, 2).

    A track is sampled if it is whole (T,), alone, has driven, and is a stride farther than `before` (., 2), where the
    one of its name in `known` was sampled last. Tracks that have ended are forgotten.
    """
    last = located(name, known)
    rows, n = np.empty(len(name), np.int64), 0
    names, where, count = np.empty(len(name), np.int64), np.empty((len(name), 2)), 0
    for t in range(len(name)):
        longest = max(box[t, 2], box[t, 3])
        now = status[t] == CONFIRMED and group[t] < 0 and travel[t] > longest and whole[t]
        if last[t] >= 0:
            dx, dy = xy[t, 0] - before[last[t], 0], xy[t, 1] - before[last[t], 1]
            now = now and np.sqrt(dx * dx + dy * dy) > _STRIDE * longest
        if now:
            rows[n] = t
            n += 1
        if not (now or last[t] >= 0):
            continue
        k = count
        while k > 0 and names[k - 1] > name[t]:  # by name
            names[k], where[k, 0], where[k, 1] = names[k - 1], where[k - 1, 0], where[k - 1, 1]
            k -= 1
        names[k] = name[t]
        for axis in range(2):
            where[k, axis] = xy[t, axis] if now else before[last[t], axis]
        count += 1
    return rows[:n], names[:count], where[:count]
