"""v85 and its bounds."""

import numpy as np
import pytest
from made_up_day import write_day

from vidtrack.traffic.report.findings import read_findings
from vidtrack.traffic.report.speeds import speeds_of, v85_of


def test_known_percentile(tmp_path):
    found = read_findings(write_day(tmp_path / "day", [4], speeds=np.arange(1.0, 102.0)))
    (one,) = speeds_of(found)
    assert (one.gate, one.direction, len(one.speed)) == ("south_out", "down", 101)
    assert one.v85 == pytest.approx(86)
    assert one.low < 86 < one.high
    assert one.shared == pytest.approx(0.5)


def test_too_few_vehicles_have_no_v85():
    assert np.isnan(v85_of(np.arange(22.0), 0, 0)).all()
    assert np.isfinite(v85_of(np.arange(23.0), 0, 0)).all()


def test_bounds_hold_in_95_of_100_samples():
    random = np.random.default_rng(3)
    truth = 50 + 8 * 1.0364334
    for n in (30, 200):
        bounds = np.array([v85_of(random.normal(50, 8, n), 0, 0)[1:] for _ in range(600)])
        assert np.mean((bounds[:, 0] <= truth) & (truth <= bounds[:, 1])) >= 0.94


def test_own_errors_lower_the_lower_bound_and_shared_ones_widen_both():
    speed = np.random.default_rng(4).normal(50, 8, 300)
    v85, low, high = v85_of(speed, 0, 0)
    _, low_own, high_own = v85_of(speed, 4, 0)
    _, low_shared, high_shared = v85_of(speed, 0, 2)
    assert low_own == pytest.approx(low - 1.0364334 * (speed.std() - np.sqrt(speed.var() - 16)))
    assert high_own == high
    assert v85 - low_shared == pytest.approx(np.hypot(v85 - low, 2 * 1.96))
    assert high_shared - v85 == pytest.approx(np.hypot(high - v85, 2 * 1.96))
