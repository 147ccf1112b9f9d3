"""Pairs of equal frames and their assignment, against hand cases and brute force."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vidtrack.errors import ConfigError
from vidtrack.formats import Table, box_table
from vidtrack.score.matching import assign, best_pairs, box_iou, match_boxes, match_points


def positions(xy: list, unit: str = "px") -> Table:
    xy = np.array(xy, dtype=float)
    return Table(np.zeros(len(xy), int), np.arange(len(xy)), xy, None, np.ones(len(xy)), unit=unit)


@pytest.mark.parametrize(
    ("a", "b", "iou"),
    [
        ((0, 0, 10, 10), (0, 0, 10, 10), 1.0),
        ((0, 0, 10, 10), (5, 0, 10, 10), 50 / 150),
        ((0, 0, 10, 10), (2, 2, 5, 5), 25 / 100),
        ((0, 0, 10, 10), (10, 0, 10, 10), 0.0),
        ((0, 0, 10, 10), (10, 10, 10, 10), 0.0),
        ((0, 0, 10, 10), (-30, 50, 10, 10), 0.0),
        ((0, 0, 0, 0), (0, 0, 0, 0), 0.0),
        ((0, 0, 10, 0), (0, 0, 10, 10), 0.0),
    ],
)
def test_iou_of_two_boxes(a, b, iou):
    a, b = np.array([a], float), np.array([b], float)
    assert box_iou(a, b)[0] == pytest.approx(iou, abs=1e-15)
    assert box_iou(b, a)[0] == pytest.approx(iou, abs=1e-15)


def test_a_missing_box_is_like_nothing():
    result = box_table(np.zeros(2), np.arange(2), np.array([[np.nan] * 4, [0, 0, 9, 9]]))
    matchup = match_boxes(result, box_table(np.zeros(1), np.zeros(1), np.array([[0, 0, 9, 9]])))
    assert matchup.result.tolist() == [1]


def test_only_rows_of_equal_frames_are_paired_whatever_their_order():
    box = np.tile([0.0, 0, 10, 10], (4, 1))
    result = box_table(np.array([7, 2, 7, 5]), np.array([1, 2, 3, 4]), box)
    truth = box_table(np.array([5, 2, 9, 7]), np.array([1, 2, 3, 4]), box)
    matchup = match_boxes(result, truth)
    assert list(zip(matchup.truth.tolist(), matchup.result.tolist(), strict=True)) == [(1, 1), (0, 3), (3, 0), (3, 2)]
    assert matchup.truth_count.tolist() == [1, 1, 1, 1]
    assert matchup.result_count.tolist() == [1, 1, 2, 0]


@given(st.integers(0, 2**32 - 1))
def test_every_overlap_is_found(seed):
    rng = np.random.default_rng(seed)
    box = np.hstack([rng.integers(0, 50, (40, 2)), rng.integers(0, 30, (40, 2))])
    truth, result = (box_table(rng.integers(0, 3, 20), np.arange(20), half) for half in np.split(box, 2))
    matchup = match_boxes(result, truth)
    t, r = np.divmod(np.arange(400), 20)
    overlap = (box_iou(truth.box[t], result.box[r]) > 0) & (truth.frame[t] == result.frame[r])
    found = zip(matchup.truth.tolist(), matchup.result.tolist(), strict=True)
    assert sorted(found) == list(zip(t[overlap].tolist(), r[overlap].tolist(), strict=True))
    assert (np.diff(matchup.pair_frame) >= 0).all()


def test_points_are_half_similar_at_the_largest_distance():
    matchup = match_points(positions([[0, 5]]), positions([[0, 0]]), max_distance=5)
    assert matchup.distance[0] == 5
    assert matchup.similarity[0] == 0.5


def test_points_compare_in_the_axes_both_have():
    matchup = match_points(positions([[3, 4]], "m"), positions([[0, 0, 900]], "m"), max_distance=5)
    assert matchup.distance[0] == 5


def test_pixels_do_not_match_metres():
    with pytest.raises(ConfigError, match="in px and the truth in m"):
        match_points(positions([[0, 0]]), positions([[0, 0]], "m"), max_distance=5)


def test_boxes_are_needed_for_iou():
    with pytest.raises(ConfigError, match="need boxes"):
        match_boxes(positions([[0, 0]]), positions([[0, 0]]))


@given(arrays(float, st.tuples(st.integers(1, 4), st.integers(1, 4)), elements=st.floats(0.01, 1)), st.data())
def test_the_best_pairs_are_those_of_brute_force(score, data):
    listed = data.draw(arrays(bool, score.shape))
    row, column = np.nonzero(listed)
    if not len(row):
        return
    chosen = best_pairs(row, column, score[row, column])
    assert len(set(row[chosen])) == len(set(column[chosen])) == chosen.sum()
    gain = np.zeros((4, 4))
    gain[: score.shape[0], : score.shape[1]] = np.where(listed, score, 0)
    best = max(gain[range(4), list(p)].sum() for p in permutations(range(4)))
    assert score[row, column][chosen].sum() == pytest.approx(best)


@given(st.integers(0, 2**32 - 1))
def test_assignment_is_one_to_one_and_as_good_frame_by_frame(seed):
    rng = np.random.default_rng(seed)
    frame, row, column = np.unique(
        np.column_stack([f := rng.integers(0, 4, 25), f * 10 + rng.integers(0, 4, 25), f * 7 + rng.integers(0, 4, 25)]),
        axis=0,
    ).T
    score = rng.uniform(0.1, 1, len(frame))
    chosen = assign(frame, row, column, score)
    assert len(set(row[chosen])) == len(set(column[chosen])) == chosen.sum()
    for f in np.unique(frame):
        here = frame == f
        alone = best_pairs(row[here] - f * 10, column[here] - f * 7, score[here])
        assert score[here & chosen].sum() == pytest.approx(score[here][alone].sum())
