"""Compares result and truth: similarity of the rows of a frame, and their one-to-one assignment."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.errors import ConfigError
from vidtrack.formats import Table

FRAME_SPACING = 3.0  # in units of the reach: rows of different frames are never near
ROUNDING = 1e-9  # keeps pairs exactly at the reach, which are tested afterwards


@dataclass(frozen=True, slots=True)
class Matchup:
    """Truth and result by frame, and their pairs of positive similarity.

    truth_frame, result_frame   (N,), (M,) the frame of each row, numbered 0..F-1
    truth_id, result_id         (N,), (M,) the identity of each row, numbered from 0 without gaps
    truth, result               (B,) the rows of each pair, in order of frame
    similarity                  (B,) 0 to 1: IoU of boxes, for points 1 - d / (2 max_distance)
    distance                    (B,) 1 - IoU of boxes, for points Euclidean
    reach                       pairs from this distance on are not listed
    """

    truth_frame: Ints
    result_frame: Ints
    truth_id: Ints
    result_id: Ints
    truth: Ints
    result: Ints
    similarity: Floats
    distance: Floats
    reach: float

    @property
    def truth_count(self) -> Ints:
        """(F,) truth rows of each frame."""
        return np.bincount(self.truth_frame, minlength=self._frames)

    @property
    def result_count(self) -> Ints:
        """(F,) result rows of each frame."""
        return np.bincount(self.result_frame, minlength=self._frames)

    @property
    def pair_frame(self) -> Ints:
        """(B,) the frame of each pair."""
        return self.truth_frame[self.truth]

    @property
    def _frames(self) -> int:
        return max(self.truth_frame.max(initial=-1), self.result_frame.max(initial=-1)) + 1

    def identity_pairs(self) -> tuple[Ints, Ints, Ints]:
        """The distinct (truth id, result id) of the pairs: (K,), (K,), and their index (B,) for each pair."""
        results = self.result_id.max(initial=0) + 1
        key, which = np.unique(self.truth_id[self.truth] * results + self.result_id[self.result], return_inverse=True)
        return key // results, key % results, which


def match_boxes(result: Table, truth: Table) -> Matchup:
    """Compare boxes by intersection over union. Raises ConfigError if a table has no boxes."""
    if result.box is None or truth.box is None:
        raise ConfigError("both tables need boxes to be matched by IoU; match points instead")
    truth_half, result_half = truth.box[:, 2:] / 2, result.box[:, 2:] / 2
    reach = np.nanmax(truth_half, axis=0, initial=0.0) + np.nanmax(result_half, axis=0, initial=0.0)
    t, r = _near_rows(truth, result, truth.box[:, :2] + truth_half, result.box[:, :2] + result_half, reach)
    iou = box_iou(truth.box[t], result.box[r])
    return _matchup(result, truth, t, r, iou, 1 - iou, reach=1.0)


def match_points(result: Table, truth: Table, max_distance: float, reach: float = 0.0) -> Matchup:
    """Compare positions by Euclidean distance d, in the axes common to both tables.

    The similarity 1 - d / (2 max_distance) is 0.5 at max_distance [px or m]; pairs are listed up to
    twice that, or to `reach` if it is larger. Raises ConfigError for positions in different units.
    """
    if result.unit != truth.unit:
        raise ConfigError(f"the result is in {result.unit} and the truth in {truth.unit}; give both in one unit")
    axes = min(result.xy.shape[1], truth.xy.shape[1])
    reach = max(2 * max_distance, reach)
    t, r = _near_rows(truth, result, truth.xy[:, :axes], result.xy[:, :axes], np.full(axes, reach))
    distance = np.linalg.norm(truth.xy[t, :axes] - result.xy[r, :axes], axis=1)
    similarity = np.maximum(0.0, 1 - distance / (2 * max_distance))
    return _matchup(result, truth, t, r, similarity, distance, reach)


def box_iou(a: Floats, b: Floats) -> Floats:
    """Intersection over union (B,) of boxes (B, 4) with boxes (B, 4); 0 for empty boxes."""
    a_start, b_start = a[:, :2], b[:, :2]
    a_end, b_end = a_start + a[:, 2:], b_start + b[:, 2:]
    overlap = _area(np.maximum(np.minimum(a_end, b_end) - np.maximum(a_start, b_start), 0.0))
    # Sides are from the rounded corners, like the overlap: equal boxes then have exactly 1.
    union = _area(a_end - a_start) + _area(b_end - b_start) - overlap
    return np.divide(overlap, union, out=np.zeros_like(union), where=overlap > 0)


def _area(sides: Floats) -> Floats:
    return sides[:, 0] * sides[:, 1]


def _near_rows(truth: Table, result: Table, truth_at: Floats, result_at: Floats, reach: Floats) -> tuple[Ints, Ints]:
    """Rows of truth and result (B,), (B,) of equal frames that differ by at most `reach` (d,) on every axis.

    Sorted by frame. Found by a k-d tree with the frame as an additional axis, since all pairs of a
    frame would cost its square.
    """
    scale = np.where(reach > 0, reach, 1.0)
    finite, trees = [], []
    for table, at in ((truth, truth_at), (result, result_at)):
        rows = np.flatnonzero(np.isfinite(at.sum(axis=1)))
        points = np.column_stack([at[rows] / scale, FRAME_SPACING * table.frame[rows]])
        finite.append(rows)
        trees.append(cKDTree(points, balanced_tree=False, compact_nodes=False))
    near = trees[0].sparse_distance_matrix(trees[1], 1 + ROUNDING, p=np.inf, output_type="ndarray")
    t, r = finite[0][near["i"]], finite[1][near["j"]]
    order = np.lexsort((r, t, truth.frame[t]))
    return t[order], r[order]


def _matchup(
    result: Table, truth: Table, t: Ints, r: Ints, similarity: Floats, distance: Floats, reach: float
) -> Matchup:
    """The pairs nearer than `reach`, with frames and identities numbered without gaps."""
    frame = np.unique(np.concatenate([truth.frame, result.frame]), return_inverse=True)[1]
    near = distance < reach
    return Matchup(
        truth_frame=frame[: len(truth)],
        result_frame=frame[len(truth) :],
        truth_id=np.unique(truth.id, return_inverse=True)[1],
        result_id=np.unique(result.id, return_inverse=True)[1],
        truth=t[near],
        result=r[near],
        similarity=similarity[near],
        distance=distance[near],
        reach=reach,
    )


def assign(frame: Ints, row: Ints, column: Ints, score: Floats) -> Mask:
    """The one-to-one choice of pairs (B,) in each frame with the largest total score, of scores above zero."""
    chosen, contests = split_contests(frame, row, column)
    for pairs, i, j in contests:
        chosen[pairs] = best_pairs(i, j, score[pairs])
    return chosen


def split_contests(frame: Ints, row: Ints, column: Ints) -> tuple[Mask, Iterator[tuple[Ints, Ints, Ints]]]:
    """The pairs (B,) whose row and column occur only once, and the others frame by frame.

    Pairs must be sorted by frame. Each contest has the indices of its pairs and their rows and
    columns, numbered from 0.
    """
    free = (np.bincount(row)[row] == 1) & (np.bincount(column)[column] == 1) if len(row) else np.zeros(0, bool)
    return free, _contests(np.flatnonzero(~free), frame, row, column)


def _contests(pairs: Ints, frame: Ints, row: Ints, column: Ints) -> Iterator[tuple[Ints, Ints, Ints]]:
    if not len(pairs):
        return
    frame = frame[pairs]
    starts = np.flatnonzero(np.diff(frame, prepend=-1))
    ends = np.append(starts[1:], len(pairs))
    i, j = _numbered_in_frame(frame, row[pairs], starts), _numbered_in_frame(frame, column[pairs], starts)
    for start, end in zip(starts, ends, strict=True):
        yield pairs[start:end], i[start:end], j[start:end]


def _numbered_in_frame(frame: Ints, row: Ints, starts: Ints) -> Ints:
    """Rows renumbered 0, 1, ... within their frame, in order; starts (S,) index of each frame's first row."""
    _, rank = np.unique(frame * (row.max() + 1) + row, return_inverse=True)
    lowest = np.minimum.reduceat(rank, starts)
    return rank - np.repeat(lowest, np.diff(np.append(starts, len(row))))


def best_pairs(row: Ints, column: Ints, score: Floats) -> Mask:
    """The pairs (B,) of a one-to-one assignment of rows and columns with the largest total score."""
    table = np.zeros((row.max() + 1, column.max() + 1))
    table[row, column] = score
    partner = np.full(len(table), -1)
    rows, columns = linear_sum_assignment(table, maximize=True)
    partner[rows] = columns
    return partner[row] == column
