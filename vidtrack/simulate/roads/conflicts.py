"""Conflicts of two vehicles, from exact footprints: time to collision and post-encroachment time.

Gettman, Head: Surrogate safety measures from traffic simulation models, FHWA-RD-03-050 (2003).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.simulate.roads.stage import footprints
from vidtrack.simulate.scene import touching

TTC_S, PET_S = 1.5, 5.0  # limits of a conflict, as SSAM counts them by default
CROSSING_ANGLE = np.radians(30)  # vehicles whose headings differ less follow each other: no encroachment


@dataclass(frozen=True, slots=True)
class Conflict:
    """Vehicle `second` comes to where `first` was, or closes in on it; None: that limit is not reached."""

    time_s: float
    first: int
    second: int
    pet_s: float | None
    ttc_s: float | None


@dataclass(frozen=True, slots=True, eq=False)
class _Path:
    """A vehicle (its index) at the times (n,) when it is seen."""

    vehicle: int
    k: Ints
    time: Floats
    xy: Floats
    velocity: Floats
    heading: Floats
    base: Floats

    @property
    def reach(self) -> float:
        """m; half the footprint's diagonal."""
        return float(np.linalg.norm(self.base[0, 0] - self.base[0, 2]) / 2)


def conflicts(
    time: Floats, xy: Floats, speed: Floats, heading: Floats, length: Floats, width: Floats
) -> Iterator[Conflict]:
    """Conflicts of vehicles (V,) at times (K,) [s]; xy (K, V, 2) m, speed and heading (K, V), NaN where not seen."""
    paths = []
    for vehicle in np.flatnonzero((~np.isnan(speed)).any(axis=0)):
        k = np.flatnonzero(~np.isnan(speed[:, vehicle]))
        angle = heading[k, vehicle]
        velocity = speed[k, vehicle, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        sides = (np.full(len(k), side[vehicle]) for side in (length, width))
        base = footprints(xy[k, vehicle], angle, *sides)
        paths.append(_Path(int(vehicle), k, time[k], xy[k, vehicle], velocity, angle, base))
    for a, b in combinations(paths, 2):
        if a.time[0] > b.time[-1] + PET_S or b.time[0] > a.time[-1] + PET_S:
            continue
        encroached, closest = _encroachment(a, b), _closing(a, b)
        if decisive := encroached or closest:
            value, when, second = decisive
            first = a if second is b else b
            pet, ttc = value if encroached else None, closest[0] if closest else None
            yield Conflict(when, first.vehicle, second.vehicle, pet, ttc)


def _encroachment(a: _Path, b: _Path) -> tuple[float, float, _Path] | None:
    """Post-encroachment time, when the second vehicle arrives, and which one that is."""
    near = np.linalg.norm(a.xy[:, None] - b.xy[None], axis=2) < a.reach + b.reach
    near &= np.abs(a.time[:, None] - b.time[None]) < PET_S
    i, j = np.nonzero(near)
    across = np.abs(np.angle(np.exp(1j * (a.heading[i] - b.heading[j])))) >= CROSSING_ANGLE
    i, j = i[across], j[across]
    overlap = touching(a.base[i], b.base[j]) if len(i) else np.empty(0, bool)
    if not overlap.any():
        return None
    i, j = i[overlap], j[overlap]
    later = b.time[j] - a.time[i]
    best = np.abs(later).argmin()
    first, second, row = (a, b, j[best]) if later[best] > 0 else (b, a, i[best])
    if _follows(first, second, int(row)):
        return None
    return float(abs(later[best])), float(second.time[row]), second


def _follows(first: _Path, second: _Path, row: int) -> bool:
    """Whether the second vehicle, a length before it is where it is in `row`, is on the way of the first already."""
    length = np.linalg.norm(second.base[row, 0] - second.base[row, 3])
    away = np.linalg.norm(second.xy[: row + 1] - second.xy[row], axis=1) >= length
    before = int(np.flatnonzero(away)[-1]) if away.any() else 0
    aligned = np.abs(np.angle(np.exp(1j * (first.heading - second.heading[before])))) < CROSSING_ANGLE
    near = aligned & (np.abs(first.time - second.time[before]) < PET_S)
    there = np.broadcast_to(second.base[before], (int(near.sum()), 4, 2))
    return bool(near.any() and touching(first.base[near], there).any())


def _closing(a: _Path, b: _Path) -> tuple[float, float, _Path] | None:
    """The least time to collision, when that was, and who was behind."""
    _, i, j = np.intersect1d(a.k, b.k, assume_unique=True, return_indices=True)
    if len(i) == 0:
        return None
    ttc = time_to_collision(a.base[i], b.base[j], b.velocity[j] - a.velocity[i])
    best = int(ttc.argmin())
    if ttc[best] > TTC_S:
        return None
    ahead = (b.xy[j[best]] - a.xy[i[best]]) @ (a.velocity[i[best]] + b.velocity[j[best]])
    return float(ttc[best]), float(a.time[i[best]]), a if ahead > 0 else b


def time_to_collision(a: Floats, b: Floats, relative: Floats) -> Floats:
    """(N,) s until rectangles b (N, 4, 2), moving at `relative` (N, 2) m/s towards a (N, 4, 2), touch; inf: never.

    Along each edge's normal the two overlap during an interval of time; they touch when all intervals have begun.
    """
    edges = np.concatenate([np.diff(a[:, :3], axis=1), np.diff(b[:, :3], axis=1)], axis=1)
    normal = np.stack([edges[..., 1], -edges[..., 0]], axis=-1)
    on_a, on_b = (np.einsum("nec,nvc->nev", normal, corners) for corners in (a, b))
    rate = np.einsum("nec,nc->ne", normal, relative)
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(on_a.min(-1) - on_b.max(-1)) / rate, (on_a.max(-1) - on_b.min(-1)) / rate])
    apart = (on_a.min(-1) > on_b.max(-1)) | (on_b.min(-1) > on_a.max(-1))
    still = rate == 0
    begin = np.where(still, np.where(apart, np.inf, -np.inf), ends.min(axis=0)).max(axis=1)
    end = np.where(still, np.inf, ends.max(axis=0)).min(axis=1)
    return np.where((begin <= end) & (end >= 0), np.maximum(begin, 0), np.inf)
