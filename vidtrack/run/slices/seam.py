"""Where two slices meet: the same vehicles in the overlap, and the moment at which one takes over from the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import affine
from vidtrack.arrays.rows import starts
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.assignment import assign
from vidtrack.output.sink import Step
from vidtrack.score.matching import box_iou
from vidtrack.tracks import TENTATIVE

AGREE = 0.5
"""Intersection over union with which two boxes are of one vehicle, and share of common frames in which they must be."""


@dataclass(frozen=True, slots=True)
class Seam:
    """How a slice goes on where the one before it ends.

    time_s       the later slice's steps count from here on
    shift        what is added to the later slice's frame numbers
    plane        (2, 3) from the later slice's scene to the earlier one's [px]; None: identity
    left, right  (K,) ids of the earlier and of the later slice for the same vehicles
    same_ids     the later slice goes on from the earlier one's state: all its ids are those of the earlier one
    """

    time_s: float
    shift: int
    plane: Floats | None
    left: Ints
    right: Ints
    same_ids: bool = False


_NOBODY = np.empty(0, np.int64)


def handed_on(last: Step, first: Step, before: int | None) -> Seam:
    """The seam before the first step of a slice that goes on from the state after the last step of another one.

    before  number of that last step's frame as the later slice counts; None: it begins with the next picture
    """
    shift = last.index - before if before is not None else last.index + 1 - first.index
    return Seam(first.time_s, shift, None, _NOBODY, _NOBODY, same_ids=True)


def seam(left: Sequence[Step], right: Sequence[Step], begin_s: float, fps: float) -> Seam:
    """The seam of two slices by their steps in the overlap.

    begin_s  where the later slice begins, if no frame is in both
    fps      nominal frames/s
    """
    other = {step.time_s: step for step in right}
    pairs = [(step, other[step.time_s]) for step in left if step.time_s in other]
    if not pairs:
        gap = round((right[0].time_s - left[-1].time_s) * fps) if left and right else 0
        shift = left[-1].index + gap - right[0].index if left and right else 0
        return Seam(begin_s, shift, None, _NOBODY, _NOBODY)
    plane = _plane(pairs)
    ids = [np.unique(np.concatenate([pair[side].tracks.id for pair in pairs])) for side in (0, 1)]
    a, b = _matched(pairs, plane, *ids)
    time_s = _quietest(pairs, ids[0][a], ids[1][b])
    return Seam(time_s, pairs[0][0].index - pairs[0][1].index, plane, ids[0][a], ids[1][b])


def _plane(pairs: Sequence[tuple[Step, Step]]) -> Floats | None:
    """The map between the scenes: the median over all common frames, whose motion both know."""
    if all(step.motion is None for pair in pairs for step in pair):
        return None
    motions = [[affine.IDENTITY if step.motion is None else step.motion for step in pair] for pair in pairs]
    return np.median([affine.after(affine.inverse(left), right) for left, right in motions], axis=0)


def _matched(pairs: Sequence[tuple[Step, Step]], plane: Floats | None, left: Ints, right: Ints) -> tuple[Ints, Ints]:
    """Rows (K,) of ids left and right that are one vehicle: the assignment with most frames in agreement."""
    agree, both = np.zeros((2, len(left), len(right)), np.int64)
    for one, other in pairs:
        box = other.tracks.box if plane is None else affine.boxes(plane, other.tracks.box)
        i, j = (part.ravel() for part in np.indices((len(one.tracks), len(other.tracks))))
        rows = np.searchsorted(left, one.tracks.id[i]), np.searchsorted(right, other.tracks.id[j])
        both[rows] += 1
        agree[rows] += box_iou(one.tracks.box[i], box[j]) >= AGREE
    row, column = (part.copy() for part in np.nonzero((agree > 0) & (agree >= AGREE * both)))  # each by itself
    none = np.zeros(len(left))
    taken = assign(starts(row, len(left)), column, -agree[row, column].astype(float), none, len(right))
    kept = np.flatnonzero(taken >= 0)
    return kept, taken[kept]


def _quietest(pairs: Sequence[tuple[Step, Step]], left: Ints, right: Ints) -> float:
    """The common time with the fewest vehicles that only one slice has, then the fewest in all, then the latest."""
    alone = [_alone(one, left) + _alone(other, right) for one, other in pairs]
    crowd = [len(one.tracks) + len(other.tracks) for one, other in pairs]
    order = np.lexsort([[-number for number in range(len(pairs))], crowd, alone])
    return pairs[int(order[0])][0].time_s


def _alone(step: Step, matched: Ints) -> int:
    """Number of confirmed tracks that are not among the matched ones."""
    tracks: Mask = (step.tracks.status != TENTATIVE) & ~np.isin(step.tracks.id, matched)
    return int(np.count_nonzero(tracks))
