"""CLEAR by hand, and against a plain loop over frames."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from vidtrack.formats import Table, box_table
from vidtrack.score import clear, match_boxes
from vidtrack.score.matching import box_iou


def rows(*entries: tuple) -> Table:
    """A table from (frame, id, left) of boxes 10 wide and high."""
    frame, identity, left = np.array(entries, dtype=float).reshape(-1, 3).T
    box = np.column_stack([left, np.zeros(len(left)), np.full((len(left), 2), 10.0)])
    return box_table(frame, identity, box)


def scored(result: Table, truth: Table, **options):
    return clear(match_boxes(result, truth), **options)


def test_counts_of_matches_misses_and_false_positives():
    truth = rows((0, 1, 0), (0, 2, 50), (1, 1, 0), (1, 2, 50))
    result = rows((0, 7, 0), (0, 8, 50), (0, 9, 200), (1, 7, 0), (1, 8, 58))
    found = scored(result, truth)
    assert (found.matches, found.misses, found.false_positives, found.switches) == (3, 1, 2, 0)
    assert found.mota == pytest.approx(1 - 3 / 4)
    assert found.motp == pytest.approx(1)


def test_precision_is_the_mean_similarity_of_the_matches():
    found = scored(rows((0, 1, 0), (1, 1, 2)), rows((0, 1, 0), (1, 1, 0)))
    assert found.motp == pytest.approx((1 + 80 / 120) / 2)


def test_a_change_of_track_is_a_switch_also_after_a_gap():
    truth = rows(*((f, 1, 0) for f in range(4)))
    assert scored(rows((0, 7, 0), (1, 7, 0), (2, 8, 0), (3, 8, 0)), truth).switches == 1
    assert scored(rows((0, 7, 0), (1, 7, 90), (3, 8, 0)), truth).switches == 1


def test_crossed_tracks_are_two_switches():
    truth = rows(*((f, i, 50 * i) for f in range(4) for i in (0, 1)))
    result = rows(*((f, i ^ (f >= 2), 50 * i) for f in range(4) for i in (0, 1)))
    assert scored(result, truth).switches == 2


def test_a_match_continues_even_where_another_is_nearer():
    truth = rows((0, 1, 0), (1, 1, 0))
    result = rows((0, 7, 0), (1, 7, 3), (1, 8, 0))
    found = scored(result, truth)
    assert found.switches == 0
    assert found.motp == pytest.approx((1 + 70 / 130) / 2)


def test_a_match_of_two_frames_ago_has_no_preference():
    truth = rows((0, 1, 0), (1, 1, 0), (2, 1, 0))
    result = rows((0, 7, 0), (1, 9, 80), (2, 7, 3), (2, 8, 0))
    assert scored(result, truth).switches == 1


def test_a_track_found_again_is_a_fragmentation():
    truth = rows(*((f, 1, 0) for f in range(6)), *((f, 2, 70) for f in range(6)))
    result = rows(*((f, 7, 0) for f in (0, 1, 4, 5)), *((f, 8, 70) for f in range(6)))
    assert scored(result, truth).fragmentations == 1


def test_a_frame_without_any_result_does_not_fragment_as_in_trackeval():
    truth = rows(*((f, 1, 0) for f in range(6)))
    found = scored(rows(*((f, 7, 0) for f in (0, 1, 4, 5))), truth)
    assert (found.fragmentations, found.misses) == (0, 2)


def test_mostly_tracked_and_mostly_lost_are_strict():
    truth = rows(*((f, i, 50 * i) for f in range(10) for i in range(4)))
    seen = {0: 9, 1: 8, 2: 2, 3: 1}
    found = scored(rows(*((f, i, 50 * i) for i, n in seen.items() for f in range(n))), truth)
    assert (found.mostly_tracked, found.partially_tracked, found.mostly_lost) == (1, 2, 1)


def test_the_threshold_itself_matches():
    truth, result = rows((0, 1, 0)), rows((0, 1, 5))
    assert scored(result, truth, threshold=1 / 3).matches == 1
    assert scored(result, truth, threshold=0.34).matches == 0


def test_an_empty_result_misses_everything():
    found = scored(rows(), rows((0, 1, 0), (1, 1, 0)))
    assert (found.mota, found.motp, found.misses, found.mostly_lost) == (0, 0, 2, 1)


def by_loop(result: Table, truth: Table) -> tuple[int, int, int]:
    """Matches, switches and fragmentations, frame after frame."""
    last, before, fragments = {}, {}, dict.fromkeys(truth.id, 0)
    matches = switches = 0
    for frame in np.intersect1d(truth.frame, result.frame):
        t, r = np.flatnonzero(truth.frame == frame), np.flatnonzero(result.frame == frame)
        iou = np.array([[box_iou(truth.box[[i]], result.box[[j]])[0] for j in r] for i in t])
        kept = np.array([[before.get(truth.id[i]) == result.id[j] for j in r] for i in t])
        gain = np.where(iou >= 0.5, iou + 1000 * kept, 0)
        best = np.column_stack(linear_sum_assignment(-gain))
        now = {truth.id[t[a]]: result.id[r[b]] for a, b in best if gain[a, b] > 0}
        matches += len(now)
        switches += sum(i in last and last[i] != j for i, j in now.items())
        for i in now.keys() - before.keys():
            fragments[i] += 1
        last |= now
        before = now
    return matches, switches, sum(max(0, n - 1) for n in fragments.values())


@given(st.integers(0, 2**32 - 1))
def test_equals_a_loop_over_frames(seed):
    rng = np.random.default_rng(seed)

    def crowd() -> Table:
        there = rng.random((12, 5)) < 0.8
        frame, identity = np.nonzero(there)
        box = np.hstack([rng.uniform(0, 14, (len(frame), 2)), rng.uniform(8, 14, (len(frame), 2))])
        return box_table(frame, identity, box)

    result, truth = crowd(), crowd()
    found = scored(result, truth)
    assert (found.matches, found.switches, found.fragmentations) == by_loop(result, truth)
