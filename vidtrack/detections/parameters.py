"""Estimates a detector's parameters from its stored boxes: least score to trust, jitter of boxes, object motion.

A real object is detected again at nearly the same place, a false one rarely: the share of boxes of a score that have
a match in the neighbouring frames indicates how often that score is right. On MOT15 and KITTI detections it rises with
the score as the share of true boxes does.

With a still camera that is not sufficient: a lamp post can be a false object in every frame. But false objects do not
move. So moving boxes are real, and their scores are those of real objects.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import kernel
from vidtrack.estimate.noise import file_noise

REACH, ALIKE = 0.5, 1.35
"""A match: a box in the next frame within REACH of the longer side, each side between 1/ALIKE and ALIKE times."""
TRUSTED, BEST = 0.8, 0.9
"""A score is trusted if its boxes have matches at least TRUSTED times as often as those of rank BEST and better."""
MOVED, STEPS = 0.5, 4
"""A chain of at least STEPS matched boxes is a mover if it extends farther than MOVED of its size."""
SELDOM = 0.1
"""Share of the movers' boxes that may score below the trusted score."""
PACE = 1.2
"""Object sizes/s; speed of a typical mover, person or car, from which an unknown frame rate is estimated."""
SLOWEST, FASTEST = 5.0, 60.0
"""Frames/s; bounds of an estimated rate."""
LONGEST_S = 1.0
"""s; longest lag of the second differences."""
ENOUGH = 30
"""Least number of boxes for an estimate of jitter and motion."""
MARGIN = 1.5
"""Factor on jitter and acceleration: errors of neighbouring frames correlate and chains break in strong motion."""
LEAST_ACCEL = 0.2
TINY = 1e-12


@dataclass(frozen=True, slots=True)
class Parameters:
    """Parameters of a detector and its scene. Object size is the longer side of a box.

    sure_score  least trusted score, as the share of detections with at most this score
    jitter      object sizes; standard deviation of a box's centre
    accel       object sizes/s^2; standard deviation of the acceleration in the picture

    The last two are None if the file is too short.
    """

    sure_score: float
    jitter: float | None
    accel: float | None


@dataclass(frozen=True, slots=True)
class Chains:
    """Boxes sorted by frame and position, linked from frame to frame.

    centre, size, rank, found   (N, 2), (N, 2), (N,), (N,); found: share of the neighbouring frames with a match
    follower  (N,) the same object's box in the next frame, -1 for none
    mover     (N,) boxes of chains that move
    """

    centre: Floats
    size: Floats
    rank: Floats
    found: Floats
    follower: Ints
    mover: Mask

    @classmethod
    def of(cls, frame: Ints, box: Floats, rank: Floats) -> Chains:
        """Chains of boxes (N, 4) in frames (N,), sorted by frame, with ranks (N,)."""
        centre = box[:, :2] + box[:, 2:] / 2
        order = np.lexsort((centre[:, 0], frame))
        frame, centre, size, rank = frame[order], centre[order], box[order, 2:], rank[order]
        start = np.searchsorted(frame, np.arange(frame[0], frame[-1] + 2))
        after, before = _matches(start, centre, size, 1), _matches(start, centre, size, -1)
        neighbours = (frame > frame[0]).astype(float) + (frame < frame[-1])
        found = ((after >= 0).astype(float) + (before >= 0)) / np.maximum(neighbours, 1)
        follower = np.where((after >= 0) & (before[after] == np.arange(len(after))), after, -1)
        return cls(centre, size, rank, found, follower, _movers(follower, centre, size))

    @property
    def step(self) -> float | None:
        """Object sizes per frame; the movers' median step weighted by distance. None with too few movers.

        Weighted by distance, not by time, because waiting vehicles do not show how fast vehicles drive.
        """
        goes = np.flatnonzero(self.mover & (self.follower >= 0))
        if len(goes) < ENOUGH:
            return None
        gone = self.centre[self.follower[goes]] - self.centre[goes]
        steps = np.sort(np.hypot(*gone.T) / self.size[goes].max(axis=1))
        way = np.cumsum(steps)
        return float(steps[np.searchsorted(way, way[-1] / 2)])


def natural_rate(chains: Chains) -> float | None:
    """Frames/s at which a typical mover has speed PACE; None with too few movers."""
    step = chains.step
    return None if step is None else float(np.clip(PACE / max(step, TINY), SLOWEST, FASTEST))


def estimate_parameters(chains: Chains, fps: float, hold_s: float) -> Parameters:
    """Parameters of the detector of these boxes.

    fps     frames/s
    hold_s  s; correlation time of the acceleration
    """
    jitter, accel = _motion(chains.follower, chains.centre, chains.size.max(axis=1), fps, hold_s)
    sure = _sure_score(chains.rank, chains.found)
    if np.count_nonzero(chains.mover) >= ENOUGH:
        sure = max(sure, float(np.quantile(chains.rank[chains.mover], SELDOM, method="higher")))
    return Parameters(sure, jitter, accel)


def _sure_score(rank: Floats, found: Floats) -> float:
    """Least rank whose boxes have matches often enough, by a monotonic (isotonic) fit."""
    from scipy.optimize import isotonic_regression

    levels, which, count = np.unique(rank, return_inverse=True, return_counts=True)
    share = isotonic_regression(np.bincount(which, found) / count, weights=count).x
    best = share[which][rank >= min(BEST, levels[-1])].mean()
    return float(levels[share >= TRUSTED * best][0])


def _motion(
    follower: Ints, centre: Floats, size: Floats, fps: float, hold_s: float
) -> tuple[float | None, float | None]:
    """Jitter and acceleration from the second differences of centres (N, 2) along chains of boxes.

    follower (N,) is the same object's box in the next frame, -1 for none. Lags are 1, 2, 4, ... frames.
    """
    lags, variances = [], []
    frames = 1
    while frames <= max(2.0, LONGEST_S * fps):
        middle, end = follower, np.where(follower >= 0, follower[follower], -1)
        chain = end >= 0
        if chain.sum() < ENOUGH:
            break
        bend = (centre[chain] - 2 * centre[middle[chain]] + centre[end[chain]]) / size[chain, None]
        lags.append(frames / fps)
        variances.append(max(float(np.mean(bend**2)), TINY))
        follower, frames = end, 2 * frames
    if len(lags) < 2:
        return None, None
    jitter, accel = MARGIN * np.array(file_noise(np.array(lags), np.array(variances), hold_s))
    return float(jitter), max(float(accel), LEAST_ACCEL)


@kernel
def _matches(start: Ints, centre: Floats, size: Floats, step: int) -> Ints:
    """(N,) nearest match of each box in the frame `step` away, -1 for none.

    Boxes start[k]..start[k + 1] are those of frame k, sorted by the x of their centres.
    """
    matched = np.full(len(centre), -1)
    frames = len(start) - 1
    for k in range(max(0, -step), min(frames, frames - step)):
        others = centre[start[k + step] : start[k + step + 1], 0]
        for i in range(start[k], start[k + 1]):
            reach = REACH * max(size[i, 0], size[i, 1])
            nearest = reach * reach
            first = start[k + step] + np.searchsorted(others, centre[i, 0] - reach)
            for j in range(first, start[k + step + 1]):
                dx, dy = centre[j, 0] - centre[i, 0], centre[j, 1] - centre[i, 1]
                if dx > reach:
                    break
                alike = True
                for axis in range(2):
                    alike &= size[i, axis] < ALIKE * size[j, axis] and size[j, axis] < ALIKE * size[i, axis]
                if alike and dx * dx + dy * dy < nearest:
                    nearest, matched[i] = dx * dx + dy * dy, j
    return matched


@kernel
def _movers(follower: Ints, centre: Floats, size: Floats) -> Mask:
    """(N,) boxes of chains of at least STEPS boxes that extend farther than MOVED of their longest side."""
    mover, begun = np.zeros(len(follower), np.bool_), np.zeros(len(follower), np.bool_)
    for i in range(len(follower)):
        if begun[i]:
            continue
        boxes, longest, j = 0, 0.0, i
        low, high = centre[i].copy(), centre[i].copy()
        while j >= 0:
            begun[j] = True
            boxes += 1
            for axis in range(2):
                low[axis], high[axis] = min(low[axis], centre[j, axis]), max(high[axis], centre[j, axis])
                longest = max(longest, size[j, axis])
            j = follower[j]
        if boxes >= STEPS and (high[0] - low[0]) ** 2 + (high[1] - low[1]) ** 2 > (MOVED * longest) ** 2:
            j = i
            while j >= 0:
                mover[j] = True
                j = follower[j]
    return mover
