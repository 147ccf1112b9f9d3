"""Simulation of point targets in many Monte Carlo runs, tracked by one bank. Time is in frames."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.gate import Gate
from vidtrack.associate.hard import Associator
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.scan import Scan
from vidtrack.tracking.deferred.forest import ForestRule
from vidtrack.tracking.lifecycle import LifeCycle
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracks import Tracks

MEASUREMENT_SIGMA = 0.7
"""px, of a blob's centroid in each axis."""

FOREVER = LifeCycle(coast_s=float("inf"), coast_scans=None)


@dataclass(frozen=True, slots=True)
class Targets:
    """Truth and measurements of N targets in all runs, K frames.

    truth  (K, N, 2) px, z (K, N, 2) px, run (N,)
    seen   (K, N) whether there is a measurement; targets in one blob have none
    """

    truth: Floats
    z: Floats
    run: Ints
    seen: Mask

    def batches(self, size: int) -> Iterator[tuple[int, Targets]]:
        """Yields the targets of `size` runs at a time, each with the number of runs up to its end."""
        runs = int(self.run.max()) + 1
        for first in range(0, runs, size):
            end = min(first + size, runs)
            own = (first <= self.run) & (self.run < end)
            yield end, Targets(self.truth[:, own], self.z[:, own], self.run[own] - first, self.seen[:, own])


def drive(
    start: Floats, heading: Floats, frames: int, speed: float, along: float, across: float, rng: Generator
) -> Floats:
    """Positions (K, N, 2) of targets from start (N, 2) with heading (N,).

    Acceleration is constant over a frame: along the heading N(0, along^2) plus a pull of 0.2 to the speed
    [px/frame], across it N(0, across^2).
    """
    u = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    n = np.stack([-u[:, 1], u[:, 0]], axis=-1)
    xy, v = start.copy(), speed * u
    path = [xy]
    for _ in range(frames - 1):
        pull = 0.2 * (speed - (v * u).sum(axis=1))
        a = (pull + along * rng.standard_normal(len(u)))[:, None] * u
        a += across * rng.standard_normal(len(u))[:, None] * n
        xy, v = xy + v + a / 2, v + a
        path.append(xy)
    return np.stack(path)


def track(targets: Targets, model: ConstantVelocity, associate: Associator | ForestRule, gate: Gate) -> Floats:
    """Positions (K - 1, N, 2) of the tracks of all targets from frame 1 on, started there by two points.

    Row n starts on target n. There are no births or deletions, so every run ends with a track for each target.
    """
    R = MEASUREMENT_SIGMA**2 * np.eye(2)
    tracker = Tracker(model, associate, gate, FOREVER, births=False)
    x, P = two_points(targets.z[0], targets.z[1])
    tracker.add(1.0, x, P, run=targets.run)
    path = [targets.z[1]]
    for k in range(2, len(targets.z)):
        seen = targets.seen[k]
        path.append(_placed(tracker.step(Scan(float(k), targets.z[k, seen], R, run=targets.run[seen])), len(x)))
    return np.stack(path)


def _placed(tracks: Tracks, count: int) -> Floats:
    """Positions (N, 2) of the first `count` tracks in order of id; infinite where a track has ended.

    Branching ends a track when another has taken the same measurements.
    """
    xy = np.full((count, 2), np.inf)
    first = tracks.id <= count
    xy[tracks.id[first] - 1] = tracks.xy[first]
    return xy


def two_points(z0: Floats, z1: Floats) -> tuple[Floats, Floats]:
    """States (N, 4) and covariances (N, 4, 4) from measurements a frame apart (Bar-Shalom and Fortmann)."""
    x = np.stack([z1[:, 0], z1[:, 0] - z0[:, 0], z1[:, 1], z1[:, 1] - z0[:, 1]], axis=-1)
    axis = MEASUREMENT_SIGMA**2 * np.array([[1.0, 1.0], [1.0, 2.0]])
    return x, np.broadcast_to(np.kron(np.eye(2), axis), (len(x), 4, 4))


def nearest_target(xy: Floats, truth: Floats, run: Ints) -> tuple[Ints, Floats]:
    """Nearest target (N,) of the same run for each row of xy (N, 2), and its distance (N,).

    Rows and targets are in order of run, with equally many in each.
    """
    size = int(np.bincount(run)[0])
    a, b = xy.reshape(-1, size, 2), truth.reshape(-1, size, 2)
    distance = np.linalg.norm(a[:, :, None] - b[:, None], axis=-1)
    return distance.argmin(axis=2), distance.min(axis=2)
