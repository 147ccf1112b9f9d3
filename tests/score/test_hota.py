"""HOTA by hand, and against the definition written as loops."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from vidtrack.formats import Table, box_table
from vidtrack.score import hota, match_boxes
from vidtrack.score.matching import box_iou

BOX = np.array([0.0, 0, 10, 10])


def still(frame, identity, box=BOX) -> Table:
    frame = np.asarray(list(frame))
    return box_table(frame, np.broadcast_to(identity, frame.shape), np.broadcast_to(box, (len(frame), 4)))


def test_a_track_cut_in_two_halves_the_association():
    found = hota(match_boxes(still(range(10), np.repeat([7, 8], 5)), still(range(10), 1)))
    assert (found.hota, found.deta, found.assa) == pytest.approx((np.sqrt(0.5), 1, 0.5))


def test_half_of_the_rows_missed():
    found = hota(match_boxes(still(range(5), 7), still(range(10), 1)))
    assert (found.hota, found.deta, found.assa) == pytest.approx((0.5, 0.5, 0.5))


def test_poor_boxes_pass_the_lower_thresholds_only():
    wide = BOX * [1, 1, 1, 0.62]
    found = hota(match_boxes(still(range(10), 7, wide), still(range(10), 1)))
    assert (found.hota, found.deta, found.assa) == pytest.approx((12 / 19, 12 / 19, 12 / 19))


def test_an_empty_result_is_zero():
    found = hota(match_boxes(still([], 1), still(range(3), 1)))
    assert (found.hota, found.deta, found.assa) == (0, 0, 0)


def by_definition(result: Table, truth: Table, alpha: float) -> float:
    """HOTA at one threshold, row by row (Luiten 2021, sections 5 and 6)."""
    iou = np.array([[box_iou(t[None], r[None])[0] for r in result.box] for t in truth.box])
    iou *= truth.frame[:, None] == result.frame
    share = iou / np.maximum(iou.sum(0)[None] + iou.sum(1)[:, None] - iou, 1e-300)
    align = np.zeros_like(iou)
    for i, t in enumerate(truth.id):
        for j, r in enumerate(result.id):
            soft = share[np.ix_(truth.id == t, result.id == r)].sum()
            align[i, j] = soft / ((truth.id == t).sum() + (result.id == r).sum() - soft)
    matched = [(i, j) for i, j in np.column_stack(linear_sum_assignment(-align * iou)) if iou[i, j] >= alpha]
    association = 0.0
    for i, j in matched:
        tpa = sum(truth.id[a] == truth.id[i] and result.id[b] == result.id[j] for a, b in matched)
        association += tpa / ((truth.id == truth.id[i]).sum() + (result.id == result.id[j]).sum() - tpa)
    return np.sqrt(association / (len(truth) + len(result) - len(matched)))


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.07, 0.33, 0.61]))
def test_equals_its_definition(seed, alpha):
    rng = np.random.default_rng(seed)

    def crowd() -> Table:
        frame, identity = np.nonzero(rng.random((4, 3)) < 0.8)
        box = np.hstack([rng.uniform(0, 12, (len(frame), 2)), rng.uniform(8, 14, (len(frame), 2))])
        return box_table(frame, identity, box)

    result, truth = crowd(), crowd()
    if len(result) and len(truth):
        found = hota(match_boxes(result, truth), alphas=np.array([alpha]))
        assert found.hota == pytest.approx(by_definition(result, truth, alpha), abs=1e-12)
