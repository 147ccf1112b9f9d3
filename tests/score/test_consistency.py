"""NEES and NIS against the chi-square distribution."""

import numpy as np
import pytest

from vidtrack.formats import Table
from vidtrack.score import consistency, nees


def test_bounds_of_one_value_are_the_quantiles_of_chi_square():
    found = consistency(np.array([1.0]), dim=2)
    assert (found.low, found.high) == pytest.approx((0.0506, 7.3778), abs=1e-4)
    assert (found.mean, found.inside, found.samples) == (1.0, 1.0, 1)


def test_bounds_close_in_on_the_dimension():
    found = consistency(np.full(100_000, 2.0), dim=2)
    assert 1.98 < found.low < 2 < found.high < 2.02


def test_right_small_and_large_covariances_are_told_apart():
    normal = np.random.default_rng(5).standard_normal((5000, 2))
    value = (normal**2).sum(axis=1)
    right, small, large = consistency(value, 2), consistency(4 * value, 2), consistency(value / 4, 2)
    assert right.low < right.mean < right.high
    assert right.inside == pytest.approx(0.95, abs=0.02)
    assert small.mean > small.high
    assert large.mean < large.low


def test_missing_values_are_left_out():
    assert consistency(np.array([np.nan, 3.0]), dim=2).samples == 1
    assert consistency(np.array([np.nan]), dim=2) is None


def test_nees_is_the_squared_error_in_units_of_the_covariance():
    xy = np.array([[3.0, 4.0], [3.0, 4.0], [0, 0], [0, 0]])
    cov = np.array([np.eye(2), [[9.0, 0], [0, 4.0]], [[1.0, 1.0], [1.0, 1.0]], np.full((2, 2), np.nan)])
    result = Table(np.arange(4), np.ones(4, int), xy, None, np.ones(4), cov)
    truth = Table(np.arange(4), np.ones(4, int), np.zeros((4, 2)), None, np.ones(4))
    np.testing.assert_allclose(nees(result, truth, np.arange(4), np.arange(4)), [25, 1 + 4, np.nan, np.nan])


def test_a_covariance_whose_correlation_is_one_has_no_nees():
    sigma = np.random.default_rng(0).uniform(0.1, 10, (1000, 2)).round(3)
    cov = sigma[:, :, None] * sigma[:, None]
    rows = np.arange(1000)
    result = Table(rows, np.ones(1000, int), sigma, None, np.ones(1000), cov)
    truth = Table(rows, np.ones(1000, int), np.zeros((1000, 2)), None, np.ones(1000))
    assert np.isnan(nees(result, truth, rows, rows)).all()
