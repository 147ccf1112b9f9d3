"""Figures of counts against counts by hand: known answers, and intervals that hold the truth."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.errors import ConfigError
from vidtrack.traffic.validation.event_tables import Events
from vidtrack.traffic.validation.validate import (
    WANTED_BIAS,
    Estimate,
    figures_of,
    geh,
    net_bias,
    noted_for,
    proportion,
    validate,
)


def events(*rows, certain=True):
    """From (time, gate, direction) or (time, gate, direction, certain)."""
    rows = sorted((*row, certain)[:4] for row in rows)
    time, gate, direction, sure = zip(*rows, strict=True)
    return Events("time_s", np.array(time, float), np.array(gate, object), np.array(direction, object), np.array(sure))


def test_events_are_matched_within_gate_and_direction():
    noted = events((1, "a", "up"), (5, "a", "up"), (9, "a", "down"), (20, "b", "up"))
    counted = events(
        (1.4, "a", "up"), (5.2, "a", "down"), (9.1, "a", "down"), (19.9, "b", "up"), (15, "b", "up"), (3, "c", "up")
    )
    result = validate(counted, noted, 1.0)
    a, b = result.gates["a"], result.gates["b"]
    assert (a.noted, a.hit, a.missed, a.false) == (3, 2, 1, 1)  # at 5 s the total is right and the direction wrong
    assert (b.noted, b.hit, b.missed, b.false) == (1, 1, 0, 1)
    assert (result.pooled.hit, result.pooled.missed, result.pooled.false) == (3, 1, 2)
    assert result.unnoted == ("c",)
    assert a.bias.value == 0
    assert a.recall.value == a.precision.value == pytest.approx(2 / 3)
    assert (result.begin, result.end) == (0.0, 21.0)
    assert a.per_hour == pytest.approx(3 / (21 / 3600))


def test_uncertain_ones_cost_nothing():
    noted = events((1, "a", "up"), (5, "a", "up", False), (9, "a", "up", False))
    figures = validate(events((1, "a", "up"), (5, "a", "up")), noted, 1.0).pooled
    assert (figures.noted, figures.uncertain, figures.hit, figures.missed, figures.false) == (1, 2, 1, 0, 0)


def test_at_the_ends_of_the_time_nothing_is_lost_and_nothing_is_invented():
    noted = events((10.1, "a", "up"), (30.2, "a", "up"))
    counted = events((2, "a", "up"), (9.9, "a", "up"), (29.9, "a", "up"), (35, "a", "up"))
    figures = validate(counted, noted, 1.0, begin=10.0, end=30.0).pooled
    # 9.9 is the vehicle of 10.1; 30.2 was after the end, and so 29.9 is neither hit nor false
    assert (figures.hit, figures.missed, figures.false, figures.uncertain) == (1, 0, 0, 1)


def day(shift_s=0.0, share=1.0, seed=3):
    """Crossings of six hours by the clock, 300 an hour; of each that share."""
    random = np.random.default_rng(seed)
    t = np.sort(random.uniform(0, 6 * 3600, 1800))
    t = t[random.uniform(size=len(t)) < share] + shift_s
    names = np.array(["a", "b"], object)[(t - shift_s > 3 * 3600).astype(int)]
    return Events("utc", t, names, np.full(len(t), "up", object), np.ones(len(t), bool))


@pytest.mark.parametrize(("shift_s", "words"), [(3600, "1 h late"), (-5400, "1.5 h early")])
def test_a_count_by_hand_in_another_zone_is_refused_though_it_overlaps(shift_s, words):
    noted = day(shift_s)
    hour = noted.select(np.abs(noted.time - shift_s - 9000) < 1800)
    with pytest.raises(ConfigError, match=f"by hand is {words}: 283 of its 283 crossings .* check its zone"):
        validate(day(), hour, 1.0)


def test_a_bad_count_is_of_no_other_zone():
    figures = validate(day(share=0.3), day(), 1.0).pooled
    assert figures.recall.value < 0.5
    assert validate(day(seed=4), day(), 1.0).pooled.hit < 1000  # of another day


@pytest.mark.parametrize("seed", range(5))
def test_at_a_busy_gate_chance_names_no_zone(seed):
    """Of two minutes a tenth was counted: at 1,200 vehicles an hour some other quarter of an hour fits better."""
    rng = np.random.default_rng(seed)
    every = np.sort(rng.uniform(0, 12 * 3600, 12 * 1200))
    seen = every[(rng.random(len(every)) < 0.1) | (np.abs(every - 6 * 3600) > 1800)]
    noted = every[np.abs(every - 6 * 3600) < 60]
    counted, by_hand = (replace(events(*((t, "a", "up") for t in one)), clock="utc") for one in (seen, noted))
    assert validate(counted, by_hand, 1.0).pooled.recall.value < 0.6


def test_what_does_not_overlap_is_refused():
    early, late = events((1, "a", "up")), events((100, "a", "up"))
    with pytest.raises(ConfigError, match=r"no overlap in time: what was counted lies between 1\.000 s"):
        validate(early, late, 1.0)
    with pytest.raises(ConfigError, match="what was noted by hand lies between"):
        validate(early, late, 1.0, begin=0.0, end=10.0)
    with pytest.raises(ConfigError, match="before it begins"):
        validate(early, early, 1.0, begin=10.0, end=2.0)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan, np.inf])
def test_a_tolerance_is_a_number_of_seconds(tolerance):
    with pytest.raises(ConfigError, match="give a number of seconds above 0"):
        validate(events((1, "a", "up")), events((1, "a", "up")), tolerance)


def test_exact_interval_of_a_share():
    """Values of Clopper and Pearson's tables."""
    assert proportion(0, 10) == Estimate(0.0, 0.0, pytest.approx(0.3085, abs=1e-4))
    assert proportion(10, 10) == Estimate(1.0, pytest.approx(0.6915, abs=1e-4), 1.0)
    assert proportion(5, 10).low == pytest.approx(0.1871, abs=1e-4)
    assert proportion(5, 10).high == pytest.approx(0.8129, abs=1e-4)


def test_geh_is_of_hourly_flows():
    estimate = geh(1000, Estimate(0.1, -0.05, 0.2))
    assert estimate.value == pytest.approx(np.sqrt(2 * 100**2 / 2100))
    assert estimate.low == 0
    assert estimate.high == pytest.approx(np.sqrt(2 * 200**2 / 2200))
    assert geh(1000, Estimate(-0.2, -0.3, -0.1)).low == pytest.approx(np.sqrt(2 * 100**2 / 1900))


@pytest.mark.parametrize(("miss", "false"), [(0.02, 0.02), (0.1, 0.05), (0.0, 0.1), (0.3, 0.01)])
@pytest.mark.parametrize("noted", [30, 300])
def test_the_interval_of_the_bias_holds_the_truth_in_at_least_95_of_100(miss, false, noted):
    rng = np.random.default_rng(1)
    misses, falses = rng.binomial(noted, miss, 2000), rng.poisson(noted * false, 2000)
    pairs, times = np.unique(np.column_stack([misses, falses]), axis=0, return_counts=True)
    inside = sum(
        n
        for (m, f), n in zip(pairs.tolist(), times.tolist(), strict=True)
        if (bias := net_bias(noted, m, f)).low <= false - miss <= bias.high
    )
    assert inside / 2000 > 0.945  # 0.95 less what 2,000 runs leave open


@given(st.integers(1, 2000), st.data())
def test_intervals_hold_their_value(noted, data):
    missed, false = data.draw(st.integers(0, noted)), data.draw(st.integers(0, 3 * noted))
    for estimate in (net_bias(noted, missed, false), proportion(missed, noted)):
        assert estimate.low <= estimate.value <= estimate.high
    figures = figures_of(np.array([noted - missed, missed, false, 0]), hours=0.5)
    assert figures.per_hour == 2 * noted
    assert figures.geh.low <= figures.geh.value + 1e-12 <= figures.geh.high + 1e-9


@pytest.mark.parametrize(("miss", "false"), [(0.0, 0.0), (0.05, 0.02), (0.2, 0.3)])
def test_after_so_many_the_bias_is_known_and_not_before(miss, false):
    def half_width(noted):
        bias = net_bias(noted, miss * noted, false * noted)
        return max(bias.high - bias.value, bias.value - bias.low)

    enough = noted_for(miss, false)
    assert half_width(enough) <= WANTED_BIAS < half_width(enough - 1)


def test_minutes_follow_from_errors_and_flow():
    figures = figures_of(np.array([95, 5, 4, 0]), hours=0.25)
    assert figures.minutes == pytest.approx(noted_for(0.05, 0.04) / (100 / 15))
    large = 1.96**2 * (0.05 * 0.95 + 0.04) / WANTED_BIAS**2  # of the normal approximation, which exact intervals exceed
    assert large < noted_for(0.05, 0.04) < 1.5 * large


def test_a_gate_with_nothing_certain_has_no_shares():
    figures = figures_of(np.array([0, 0, 0, 3]), hours=1.0)
    assert figures.recall is figures.precision is figures.bias is figures.geh is figures.minutes is None
