"""Which tracks of several runs are of one target: whole tracks are compared, not single times."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import gammaincinv

from vidtrack.arrays.rows import dot
from vidtrack.arrays.types import Floats, Ints, Mask

LEAST_COMMON = 3
"""Fewest common times of two tracks that are compared."""
INSIDE = 0.999
"""Share of pairs of one target that are found, if the errors are as stated."""
LIMIT = 2 * float(gammaincinv(1.0, INSIDE))
"""Of the mean squared distance. Errors of one track last, so that its times count as one: it is the quantile of one."""


@dataclass(frozen=True, slots=True)
class Histories:
    """Tracks of several runs at common times.

    run    (T,) run of each track
    there  (T, K) whether a track exists at each time
    xy     (T, K, 2) positions, cov (T, K, 2, 2) covariances; NaN where there is none
    """

    run: Ints
    there: Mask
    xy: Floats
    cov: Floats


def same_targets(histories: Histories) -> Ints:
    """(T,) number of the target of each track, from 0 in order of the tracks.

    Two tracks of different runs may be of one target if the squares of their distances, by the sum of both
    covariances, are on average within what two errors allow. The nearest pairs are joined first. A target has at most
    one track of each run at a time.
    """
    target = np.arange(len(histories.run))
    for a, b in _by_distance(histories):
        one, other = target == target[a], target == target[b]
        if target[a] != target[b] and not _overlap(histories, one, other):
            target[one | other] = min(target[a], target[b])
    return np.unique(target, return_inverse=True)[1]


def parallel(histories: Histories, target: Ints) -> Floats:
    """(P,) mean distances [m] of pairs of tracks that move as one target does, but too far apart for their errors.

    target (T,) of the tracks. Each has no partner in the other's run, and both go farther than they are apart: so it is
    rather one target, of which a run has a bias, than two. The nearest pairs come first, each track once.
    """
    found = []
    for a, b, both in _together(histories):
        if _partnered(histories, target, a, b) or _partnered(histories, target, b, a):
            continue
        v, S = _difference(histories, a, b, both)
        apart_m = float(np.linalg.norm(v, axis=1).mean())
        way_m = min(float(np.linalg.norm(np.ptp(histories.xy[k, both], axis=0))) for k in (a, b))
        if _mean_d2(v - v.mean(axis=0), S) < LIMIT and apart_m < way_m:
            found.append((apart_m, a, b))
    taken: set[int] = set()
    apart = []
    for apart_m, a, b in sorted(found):
        if not taken & {a, b}:
            taken |= {a, b}
            apart.append(apart_m)
    return np.array(apart)


def _partnered(histories: Histories, target: Ints, a: int, b: int) -> bool:
    """Whether track a is of one target with a track of b's run."""
    return bool((histories.run[target == target[a]] == histories.run[b]).any())


def _by_distance(histories: Histories) -> list[tuple[int, int]]:
    """Pairs of tracks near enough to be of one target, the nearest first."""
    found = [(_mean_d2(*_difference(histories, a, b, both)), a, b) for a, b, both in _together(histories)]
    return [(a, b) for d2, a, b in sorted(found) if d2 < LIMIT]


def _together(histories: Histories) -> Iterator[tuple[int, int, Mask]]:
    """Tracks a and b of two runs, and their common times (K,), of which there are enough to compare them."""
    for a in range(len(histories.run)):
        common = histories.there & histories.there[a]
        for b in np.flatnonzero((histories.run > histories.run[a]) & (common.sum(axis=1) >= LEAST_COMMON)).tolist():
            yield a, b, common[b]


def _difference(histories: Histories, a: int, b: int, both: Mask) -> tuple[Floats, Floats]:
    """(C, 2) difference of two tracks at their common times, and (C, 2, 2) its covariance."""
    return histories.xy[a, both] - histories.xy[b, both], histories.cov[a, both] + histories.cov[b, both]


def _mean_d2(v: Floats, S: Floats) -> float:
    """Mean of the squared Mahalanobis distances of v (C, 2) with S (C, 2, 2)."""
    return float(dot(v, np.asarray(np.linalg.solve(S, v[:, :, None])[:, :, 0], float)).mean())


def _overlap(histories: Histories, one: Mask, other: Mask) -> bool:
    """Whether a track of one target and one of another are of the same run at the same time."""
    for run in np.unique(histories.run[one]):
        mine, theirs = (histories.there[rows & (histories.run == run)].any(axis=0) for rows in (one, other))
        if (mine & theirs).any():
            return True
    return False
