"""Result and truth side by side: how alike the rows of a frame are, and one-to-one assignment of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from vidtrack.errors import ConfigError
from vidtrack.formats import Table
from vidtrack.scan import Floats, Ints

Mask = NDArray[np.bool_]
PAIRS_AT_ONCE = 1_000_000  # bounds the memory of frames with very many objects


@dataclass(frozen=True, slots=True)
class Matchup:
    """Truth and result by frame, and the pairs of them that are alike at all.

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
        """The distinct (truth id, result id) among the pairs: (K,), (K,), and (B,) which of them each pair is."""
        results = self.result_id.max(initial=0) + 1
        key, which = np.unique(self.truth_id[self.truth] * results + self.result_id[self.result], return_inverse=True)
        return key // results, key % results, which


def match_boxes(result: Table, truth: Table) -> Matchup:
    """Compare boxes by intersection over union. Raises ConfigError when a table has none."""
    if result.box is None or truth.box is None:
        raise ConfigError("both tables need boxes to be matched by IoU; match points instead")
    result_box, truth_box = result.box, truth.box

    def compare(t: Ints, r: Ints) -> tuple[Floats, Floats]:
        iou = box_iou(truth_box[t], result_box[r])
        return iou, 1 - iou

    return _match(result, truth, compare, reach=1.0)


def match_points(result: Table, truth: Table, max_distance: float, reach: float = 0.0) -> Matchup:
    """Compare positions by Euclidean distance d, in the axes both tables have.

    The similarity 1 - d / (2 max_distance) is 0.5 at max_distance [px or m]; pairs are listed up to
    twice that, or to `reach` if it is larger. Raises ConfigError for positions in different units.
    """
    if result.unit != truth.unit:
        raise ConfigError(f"the result is in {result.unit} and the truth in {truth.unit}; give both in one unit")
    axes = min(result.xy.shape[1], truth.xy.shape[1])

    def compare(t: Ints, r: Ints) -> tuple[Floats, Floats]:
        distance = np.linalg.norm(truth.xy[t, :axes] - result.xy[r, :axes], axis=1)
        return np.maximum(0.0, 1 - distance / (2 * max_distance)), distance

    return _match(result, truth, compare, max(2 * max_distance, reach))


def box_iou(a: Floats, b: Floats) -> Floats:
    """Intersection over union (B,) of boxes (B, 4) with boxes (B, 4); 0 for empty boxes."""
    a_start, b_start = a[:, :2], b[:, :2]
    a_end, b_end = a_start + a[:, 2:], b_start + b[:, 2:]
    overlap = _area(np.maximum(np.minimum(a_end, b_end) - np.maximum(a_start, b_start), 0.0))
    # Sides from the rounded corners, as the overlap's are: equal boxes then have exactly 1.
    union = _area(a_end - a_start) + _area(b_end - b_start) - overlap
    return np.divide(overlap, union, out=np.zeros_like(union), where=overlap > 0)


def _area(sides: Floats) -> Floats:
    return sides[:, 0] * sides[:, 1]


def _match(
    result: Table, truth: Table, compare: Callable[[Ints, Ints], tuple[Floats, Floats]], reach: float
) -> Matchup:
    """List the pairs of equal frames that are nearer than `reach`."""
    _, frame = np.unique(np.concatenate([truth.frame, result.frame]), return_inverse=True)
    truth_frame, result_frame = frame[: len(truth)], frame[len(truth) :]
    kept: list[tuple[NDArray, ...]] = [(np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0), np.empty(0))]
    for t, r in _rows_of_equal_frames(truth_frame, result_frame):
        similarity, distance = compare(t, r)
        near = distance < reach
        kept.append((t[near], r[near], similarity[near], distance[near]))
    t, r, similarity, distance = (np.concatenate(column) for column in zip(*kept, strict=True))
    truth_id = np.unique(truth.id, return_inverse=True)[1]
    result_id = np.unique(result.id, return_inverse=True)[1]
    return Matchup(truth_frame, result_frame, truth_id, result_id, t, r, similarity, distance, reach)


def _rows_of_equal_frames(truth_frame: Ints, result_frame: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Every (truth row, result row) of the same frame, in order of frame, in blocks of bounded size."""
    truth_order = np.argsort(truth_frame, kind="stable")
    result_order = np.argsort(result_frame, kind="stable")
    ordered = result_frame[result_order]
    first = np.searchsorted(ordered, truth_frame[truth_order], "left")
    partners = np.searchsorted(ordered, truth_frame[truth_order], "right") - first
    for rows in np.array_split(np.arange(len(truth_order)), partners.sum() // PAIRS_AT_ONCE + 1):
        count = partners[rows]
        within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        yield np.repeat(truth_order[rows], count), result_order[np.repeat(first[rows], count) + within]


def assign(frame: Ints, row: Ints, column: Ints, score: Floats) -> Mask:
    """The one-to-one choice of pairs (B,) in each frame with the largest total score, scores above zero."""
    chosen, contests = split_contests(frame, row, column)
    for pairs, i, j in contests:
        chosen[pairs] = best_pairs(i, j, score[pairs])
    return chosen


def split_contests(frame: Ints, row: Ints, column: Ints) -> tuple[Mask, Iterator[tuple[Ints, Ints, Ints]]]:
    """The pairs (B,) that no other pair competes with, and frame by frame the others.

    Pairs must be in order of frame. Each contest is the indices of its pairs and their rows and
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
    """Rows renumbered 0, 1, ... within their frame, in their order; starts (S,) is where each frame begins."""
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
