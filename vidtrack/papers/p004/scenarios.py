"""The Monte Carlo experiments: two targets that cross, and nine. Lengths px, times frames."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from vidtrack.arrays.types import Floats
from vidtrack.associate.gate import Distance, Gate
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.papers.p004.simulated import MEASUREMENT_SIGMA, Targets, drive, nearest_target, track
from vidtrack.tracking.methods import METHODS

DISTANCES: tuple[Distance, ...] = ("euclidean", "decoupled", "mahalanobis")
GATE = 0.9999
LOST = 15.0
"""px; a track farther than this from every target is lost."""

CENTRE = np.array([120.0, 90.0])
FRAMES, BEFORE, SPEED = 40, 20, 2.0
"""Frames of a crossing, frames until the targets meet, px/frame."""
MERGED = slice(14, 22)
"""Frames in which the two targets are one blob, and neither is measured."""

NINE_FRAMES, NINE_SPEED = 60, 3.0
NINE_MERGED = 8.0
"""px; targets closer than this are one blob."""
NINE_HEADINGS = np.radians([-38.0, 62.0, 0.0, 180.0, 90.0, -90.0, 140.0, -142.0, 22.0])


def crossing(runs: int, turn: float, merged: bool, rng: Generator) -> Targets:
    """Two targets per run, which go in +y and +x, rotated by `turn` [rad], and meet at the centre."""
    heading = np.tile([np.pi / 2, 0.0], runs) + turn
    start = CENTRE - BEFORE * SPEED * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    truth = drive(start, heading, FRAMES, SPEED, 0.8, 0.05, rng)
    seen = np.ones(truth.shape[:2], bool)
    if merged:
        seen[MERGED] = False
    return Targets(truth, _measured(truth, rng), np.repeat(np.arange(runs), 2), seen)


def nine(runs: int, rng: Generator) -> Targets:
    """Nine targets per run, each at a random place near the middle of the picture at half time."""
    heading = np.tile(NINE_HEADINGS, runs)
    middle = CENTRE + rng.uniform(-1, 1, (len(heading), 2)) * (60, 45)
    start = middle - NINE_SPEED * NINE_FRAMES / 2 * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    truth = drive(start, heading, NINE_FRAMES, NINE_SPEED, 0.5, 0.05, rng)
    together = truth.reshape(NINE_FRAMES, runs, 9, 2)
    apart = np.linalg.norm(together[:, :, :, None] - together[:, :, None], axis=-1) + np.diag(np.full(9, np.inf))
    seen = (apart.min(axis=3) >= NINE_MERGED).reshape(NINE_FRAMES, -1)
    return Targets(truth, _measured(truth, rng), np.repeat(np.arange(runs), 9), seen)


def shares(targets: Targets, method: str, distance: Distance, model: ConstantVelocity | None = None) -> Floats:
    """Share of the runs (4,) that end correct, swapped, merged (both tracks on one target), lost (far from all)."""
    end = track(targets, model or motion(distance), METHODS[method](), Gate(GATE, distance))[-1]
    target, away = nearest_target(end, targets.truth[-1], targets.run)
    lost = (away > LOST).any(axis=1)
    correct = ~lost & (target == [0, 1]).all(axis=1)
    swap = ~lost & (target == [1, 0]).all(axis=1)
    return np.array([correct.mean(), swap.mean(), (~lost & ~correct & ~swap).mean(), lost.mean()])


def wrong_identities(targets: Targets, method: str, distance: Distance) -> Floats:
    """(runs,) number of tracks that end nearest to another target than their own, or far from all."""
    end = track(targets, motion(distance, 0.5), METHODS[method](), Gate(GATE, distance))[-1]
    target, away = nearest_target(end, targets.truth[-1], targets.run)
    return ((target != np.arange(target.shape[1])) | (away > LOST)).sum(axis=1).astype(float)


def motion(distance: Distance, along: float = 0.8) -> ConstantVelocity:
    """Process noise along the heading once it is known, 0.2 across; isotropic for the euclidean distance."""
    return ConstantVelocity(accel=along, cross=None if distance == "euclidean" else 0.2, warmup=6, heading=0.0)


def _measured(truth: Floats, rng: Generator) -> Floats:
    return truth + MEASUREMENT_SIGMA * rng.standard_normal(truth.shape)
