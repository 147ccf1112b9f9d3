"""All scores together: invariants, ignored truth, points, pooling, consistency."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.errors import ConfigError, FormatError
from vidtrack.formats import Table, box_table
from vidtrack.score import evaluate, pool

COUNTED = ("switches", "fragmentations", "false_positives", "misses")
FRACTIONS = ("motp", "idf1", "idp", "idr", "hota", "deta", "assa", "ospa")
SEEDS = st.integers(0, 2**32 - 1)


def traffic(seed: int, frames: int = 8, objects: int = 4) -> Table:
    rng = np.random.default_rng(seed)
    frame, identity = np.nonzero(rng.random((frames, objects)) < 0.9)
    box = np.hstack([rng.uniform(0, 40, (len(frame), 2)), rng.uniform(10, 30, (len(frame), 2))])
    return box_table(frame, identity + 1, box)


def noisy(truth: Table, seed: int) -> Table:
    rng = np.random.default_rng(seed)
    kept = truth.select(rng.random(len(truth)) < 0.8)
    return box_table(kept.frame, kept.id, kept.box + rng.normal(0, 2, kept.box.shape) * [1, 1, 0, 0])


@given(SEEDS)
def test_a_perfect_result_scores_one(seed):
    truth = traffic(seed)
    scores = evaluate(truth, truth)
    assert [scores[name] for name in ("mota", "motp", "idf1", "idp", "idr", "hota", "deta", "assa")] == pytest.approx(
        [1] * 8
    )
    assert [scores[name] for name in ("misses", "false_positives", "switches")] == [0, 0, 0]
    assert [scores[name] for name in ("ospa", "gospa")] == pytest.approx([0, 0], abs=1e-7)


@given(SEEDS)
def test_scores_do_not_depend_on_the_numbers_of_tracks_nor_on_the_order_of_rows(seed):
    truth = traffic(seed)
    result = noisy(truth, seed)
    rng = np.random.default_rng(seed)
    renamed = replace(result, id=rng.permutation(1000)[result.id]).select(rng.permutation(len(result)))
    before, after = evaluate(result, truth), evaluate(renamed, truth)
    assert after.pop("matched_by") == before.pop("matched_by")
    assert after == pytest.approx(before)


@given(SEEDS, SEEDS)
@settings(max_examples=50)
def test_scores_stay_in_range(seed, other):
    truth = traffic(seed)
    scores = evaluate(traffic(other), truth)
    assert all(0 <= scores[name] <= 1 for name in FRACTIONS)
    assert scores["mota"] <= 1
    assert scores["matches"] + scores["misses"] == scores["truth_rows"] == len(truth)
    assert all(scores[name] >= 0 for name in (*COUNTED, "gospa"))


def test_truth_rows_with_conf_zero_are_ignored():
    truth = traffic(1)
    extra = box_table(np.array([0, 1]), np.array([90, 90]), np.full((2, 4), 500.0), np.zeros(2))
    both, _ = pool([(truth, truth), (replace(extra, frame=extra.frame - 8), extra)])
    assert evaluate(truth, both) == evaluate(truth, truth)


def test_nothing_to_score_against_is_an_error():
    truth = traffic(1)
    with pytest.raises(FormatError, match="conf above 0"):
        evaluate(truth, replace(truth, conf=np.zeros(len(truth))))


def test_detections_are_not_tracks():
    truth = traffic(1)
    with pytest.raises(FormatError, match="result has rows without identity"):
        evaluate(replace(truth, id=np.full(len(truth), -1)), truth)


@pytest.mark.parametrize(
    "options", [{"iou": 0}, {"iou": 1.5}, {"max_distance": 0}, {"max_distance": np.inf}, {"cutoff": 2}, {"order": 0}]
)
def test_senseless_options_are_refused(options):
    truth = traffic(1)
    with pytest.raises(ConfigError, match="must be"):
        evaluate(truth, truth, **options)


def radar(offset: float, **columns) -> Table:
    xy = np.array([[0.0, offset], [10, offset], [20, offset]])
    return Table(np.arange(3), np.ones(3, int), xy, None, np.ones(3), unit="m", **columns)


def test_positions_match_by_distance():
    assert evaluate(radar(100), radar(0))["matches"] == 3
    assert evaluate(radar(101), radar(0))["matches"] == 0
    scores = evaluate(radar(30), radar(0), max_distance=40, cutoff=60)
    assert (scores["mota"], scores["ospa"], scores["gospa"]) == pytest.approx((1, 30, 30))


def test_boxes_can_be_scored_as_points():
    truth = traffic(3)
    scores = evaluate(truth, truth, points=True)
    assert scores["mota"] == 1
    assert "20 px" in scores["matched_by"]


def test_consistency_is_reported_where_the_columns_are():
    cov = np.tile(np.eye(2) * 50, (3, 1, 1))
    scores = evaluate(radar(10, cov=cov, nis=np.array([np.nan, 1, 3])), radar(0))
    assert (scores["nees"], scores["nees_samples"]) == (2, 3)
    assert (scores["nis"], scores["nis_samples"]) == (2, 2)
    assert not [name for name in evaluate(radar(10), radar(0)) if name.startswith(("nis", "nees"))]


def test_consistency_can_come_from_another_table():
    states = radar(10, cov=np.tile(np.eye(2) * 50, (3, 1, 1)))
    assert evaluate(radar(0), radar(0), states=states)["nees"] == 2


def test_pooled_sequences_count_as_one():
    truths = [traffic(seed) for seed in range(3)]
    runs = [(noisy(truth, 1), truth) for truth in truths]
    alone = [evaluate(*run) for run in runs]
    together = evaluate(*pool(runs))
    for name in ("misses", "false_positives", "switches", "fragmentations", "tracks", "frames"):
        assert together[name] == sum(scores[name] for scores in alone)
    errors = sum((1 - scores["mota"]) * scores["truth_rows"] for scores in alone)
    assert together["mota"] == pytest.approx(1 - errors / sum(map(len, truths)))


def drives(times_s, speed=(10.0, -7.0)):
    """Two targets at constant speed at these times."""
    scan = np.repeat(np.arange(len(times_s)), 2)
    time_s, target = np.repeat(times_s, 2), np.tile([1, 2], len(times_s))
    xy = np.column_stack([np.array(speed)[target - 1] * time_s, 50.0 * target])
    return Table(scan, target, xy, None, np.ones(len(scan)), unit="m", time_s=time_s)


def test_numbers_of_the_same_scans_count_whatever_the_zero_of_time():
    truth = drives(4.0 * np.arange(10))
    assert evaluate(replace(truth, time_s=truth.time_s + 1.7 + 1e9), truth)["idf1"] == 1.0
    assert evaluate(replace(truth, time_s=None), truth)["idf1"] == 1.0


def test_numbers_of_other_times_are_matched_by_time():
    """Scans of a radar at 1.3 s against frames ten times a second; the result goes on after the truth."""
    truth, result = drives(0.1 * np.arange(200)), drives(0.05 + 1.3 * np.arange(20))
    scores = evaluate(result, truth, max_distance=1.0)
    assert (scores["frames"], scores["misses"], scores["false_positives"], scores["idf1"]) == (16, 0, 0, 1.0)
    assert scores["gospa"] == pytest.approx(0.0, abs=1e-9)
    away = truth.select((truth.id == 1) | (truth.time_s < 6) | (truth.time_s > 12))  # a gap is not bridged
    assert evaluate(result, away, max_distance=1.0)["false_positives"] == 5


def test_what_a_result_lacks_of_the_time_of_its_truth_is_missed():
    truth, result = drives(0.1 * np.arange(200)), drives(0.05 + 1.3 * np.arange(15))
    late = result.select((result.frame >= 4) & (result.frame < 12))
    scores = evaluate(late, truth, max_distance=1.0)
    assert (scores["frames"], scores["misses"], scores["matches"]) == (16, 16, 16)


def test_scans_of_two_sensors_may_have_the_same_time():
    truth, result = drives(0.1 * np.arange(100)), drives(np.sort(np.append(0.04 * np.arange(200), 0.2 * np.arange(40))))
    scores = evaluate(result, truth, max_distance=1.0)
    assert (scores["frames"], scores["misses"], scores["false_positives"]) == (288, 96, 0)


def test_a_result_of_one_time_is_scored_at_that_time():
    truth = drives(np.arange(4.0))
    once = replace(truth, time_s=np.ones(len(truth)))
    assert evaluate(once, truth)["frames"] == 4


def test_targets_keep_their_own_steps_and_none_without_two_rows_counts():
    """A target that is known every 5 s beside one ten times a second; and truth of one row a target."""
    seldom, result = drives(0.1 * np.arange(200)), drives(0.05 + 1.3 * np.arange(15))
    seldom = seldom.select((seldom.id == 1) | (seldom.frame % 50 == 0))
    assert evaluate(result, seldom, max_distance=1.0)["false_positives"] == 3  # after the last row of the seldom one
    once = drives(0.1 * np.arange(200))
    with pytest.raises(FormatError, match="two rows"):
        evaluate(result, replace(once, id=np.arange(len(once))))


def test_clocks_without_a_common_time_are_refused():
    truth, result = drives(0.1 * np.arange(200)), drives(1e3 + 1.3 * np.arange(20))
    with pytest.raises(FormatError, match=r"number 19 is at 1024.7 s in the result and at 1.9 s in the truth"):
        evaluate(result, truth)
    with pytest.raises(FormatError, match="other scans"):
        evaluate(*pool([(drives(1.3 * np.arange(20)), truth)] * 2))
