"""Turning movements, peak hour and its factor: known answers and how often bounds hold."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_up_day import MOVEMENTS, busy_day, write_day

from vidtrack.traffic.report.findings import read_findings
from vidtrack.traffic.report.sheet import peak_hour, peak_hour_factor, sheet_of
from vidtrack.traffic.report.turns import drawn, turns


def sheet(folder):
    found = read_findings(folder)
    return found, sheet_of(found, turns(drawn(found.site)))


def test_the_sheet_holds_every_whole_trip_once(tmp_path):
    found, got = sheet(busy_day(tmp_path / "day"))
    assert np.nansum(got.count) == (found.numbers("trips", "complete") > 0).sum()
    assert [(one.start, one.end) for one in got.movements[:3]] == [
        ("north", "east"),
        ("north", "south"),
        ("north", "west"),
    ]
    assert {(one.start, one.end) for one in got.movements} == set(MOVEMENTS)


def test_counts_are_where_they_were_made(tmp_path):
    counts = [[3, 0], [0, 7], [1, 1]]
    _, got = sheet(write_day(tmp_path / "day", counts, legs=[("north", "south"), ("west", "north")]))
    columns = [
        [(one.start, one.end) for one in got.movements].index(p) for p in (("north", "south"), ("west", "north"))
    ]
    assert got.count[:, columns].tolist() == counts
    assert got.total.tolist() == [3, 7, 2]
    assert got.of_leg("west").tolist() == [0, 7, 1]


def test_what_nobody_drove_is_zero_though_the_site_does_not_say_what_it_allows(tmp_path):
    folder = write_day(tmp_path / "day", [4, 0, 5], [1, 0, 1])
    site = folder / "site.toml"
    site.write_text(site.read_text().partition("[movements]")[0])
    _, got = sheet(folder)
    assert {(one.start, one.end) for one in got.movements} == set(MOVEMENTS)
    west = [one.start == "west" for one in got.movements]
    np.testing.assert_array_equal(got.count[:, west], [[0] * 3, [np.nan] * 3, [0] * 3])


def test_a_trip_without_an_exit_is_in_no_movement(tmp_path):
    _, got = sheet(write_day(tmp_path / "day", [[5, 2]], legs=[("north", "south"), ("north", None)]))
    assert got.total.tolist() == [5]


def test_nobody_watched_is_not_zero(tmp_path):
    _, got = sheet(write_day(tmp_path / "day", [4, 0, 0, 5], [1, 0, 1, 1]))
    assert np.isnan(got.count[1]).all()
    assert got.total[[0, 2, 3]].tolist() == [4, 0, 5]


def test_peak_hour_by_hand():
    total = np.array([50.0, 100, 120, 140, 90, 40])
    peak = peak_hour(total, np.ones(6, bool), np.arange(7) * 900.0)
    assert (peak.first, peak.last, peak.volume) == (1, 5, 450)
    assert peak.factor == pytest.approx(450 / (4 * 140))
    assert peak.low < peak.factor < peak.high


def test_the_hour_of_five_minutes_has_twelve():
    total = np.full(14, 10.0)
    total[13] = 20
    peak = peak_hour(total, np.ones(14, bool), np.arange(15) * 300.0)
    assert (peak.first, peak.last, peak.volume) == (2, 14, 130)
    assert peak.factor == pytest.approx(130 / (12 * 20))


def test_an_hour_with_a_gap_is_no_peak_hour():
    total, watched = np.array([1.0, 1, 1, 1, 900, 900, np.nan, 900]), np.ones(8, bool)
    watched[6] = False
    peak = peak_hour(total, watched, np.arange(9) * 900.0)
    assert peak.last <= 6
    assert peak_hour(total[4:], watched[4:], np.arange(5) * 900.0) is None


@pytest.mark.parametrize(("intervals", "seconds"), [(3, 900.0), (8, 700.0), (8, 7200.0)])
def test_no_peak_hour_without_an_hour_of_whole_intervals(intervals, seconds):
    assert peak_hour(np.ones(intervals), np.ones(intervals, bool), np.arange(intervals + 1) * seconds) is None


@given(st.lists(st.integers(0, 500), min_size=4, max_size=12).filter(any))
def test_the_factor_lies_in_its_bounds(counts):
    factor, low, high = peak_hour_factor(np.array(counts, float))
    assert 1 / len(counts) - 1e-9 <= low <= factor + 1e-9
    assert factor <= high + 1e-9 <= 1 + 2e-9


def test_no_vehicles_have_no_factor():
    assert np.isnan(peak_hour_factor(np.zeros(4))).all()


@pytest.mark.parametrize("rates", [(100, 100, 100, 100), (10, 10, 10, 10), (60, 90, 140, 80), (20, 1, 1, 1)])
def test_bounds_hold_in_95_of_100_days(rates):
    truth = np.mean(rates) / np.max(rates)
    days = np.random.default_rng(1).poisson(rates, (400, 4)).astype(float)
    bounds = np.array([peak_hour_factor(day)[1:] for day in days])
    assert np.mean((bounds[:, 0] <= truth + 1e-9) & (truth <= bounds[:, 1] + 1e-9)) >= 0.95
