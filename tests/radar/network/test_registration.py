"""Registration: biases from common targets, with honest errors."""

import numpy as np
import pytest

from vidtrack.radar.coordinates import to_polar, wrap
from vidtrack.radar.network.registration import Plotted, Registration

ORIGINS = [(0.0, 15e3), (0.0, -15e3)]
SIGMA = np.array([40.0, np.radians(0.3)])
PRIOR = np.array([[100.0, np.radians(1.0), 0.0], [100.0, np.radians(1.0), 1.0]])
R = np.diag(SIGMA**2)


def learnt(rng, bias, origins=ORIGINS, prior=PRIOR, scans=40, targets=5, noise=1.0, wrong=0):
    """A registration after two radars with biases (2, 3) have seen targets fly straight, `wrong` of them mixed up."""
    registration = Registration(origins, prior, np.array([4.0, 4.0]), jerk=0.1)
    start, velocity = rng.uniform(-30e3, 30e3, (targets, 2)), rng.normal(0, 150, (targets, 2))
    for k in range(scans):
        for radar, begin in enumerate((0.0, 1.7)):
            t = begin + 4.0 * k
            z = to_polar(start + velocity * t - np.array(origins[radar])) + bias[radar, :2]
            z = z + noise * SIGMA * rng.normal(size=z.shape)
            late = t + bias[radar, 2]
            ids = np.roll(np.arange(targets), radar * wrong)
            plots = Plotted(radar, ids, np.full(targets, late), z, np.tile(R, (targets, 1, 1)), velocity[ids])
            registration.learn(late, plots)
    return registration


@pytest.mark.parametrize("time_s", [0.0, 0.8])
def test_biases_are_found_and_their_errors_are_as_stated(time_s):
    rng = np.random.default_rng(5)
    squares = []
    for _ in range(20):
        bias = PRIOR * rng.normal(size=(2, 3))
        bias[1, 2] = time_s
        found = learnt(rng, bias)
        off = (found.bias - bias).ravel()[[0, 1, 3, 4, 5]]
        cov = found.cov[np.ix_([0, 1, 3, 4, 5], [0, 1, 3, 4, 5])]
        squares.append(off @ np.linalg.solve(cov, off) / 5)
    assert 0.5 < np.mean(squares) < 1.5
    assert found.observed().all()
    assert np.degrees(found.sigma()[:, 1]).max() < 0.1


def test_without_errors_of_plots_the_bias_is_exact():
    bias = np.array([[0.0, 0.0, 0.0], [60.0, np.radians(1.0), 0.0]])
    prior = PRIOR * [[0], [1]]
    found = learnt(np.random.default_rng(1), bias, prior=prior, noise=0.0)
    np.testing.assert_allclose(found.bias[1, 0], 60.0, atol=1.0)
    np.testing.assert_allclose(np.degrees(found.bias[1, 1]), 1.0, atol=0.01)
    np.testing.assert_array_equal(found.bias[0], 0.0)


def test_radars_at_one_place_tell_the_difference_of_their_biases_only():
    bias = np.array([[0.0, 0.0, 0.0], [80.0, np.radians(1.0), 0.0]])
    prior = PRIOR * [1, 1, 0]
    found = learnt(np.random.default_rng(2), bias, origins=[(0.0, 0.0)] * 2, prior=prior)
    assert not found.observed()[:, :2].any()
    np.testing.assert_allclose(np.degrees(wrap(found.bias[1, 1] - found.bias[0, 1])), 1.0, atol=0.1)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_common_to_radars_at_one_place_stays_unknown_at_ranges_like_the_prior(seed):
    rng = np.random.default_rng(seed)
    sigma, place = np.array([0.4, np.radians(1.0)]), [(0.0, 0.0)] * 2
    found = Registration(place, np.tile([30.0, np.radians(1.0), 0.0], (2, 1)), np.array([0.2, 0.2]), jerk=4.0)
    start, velocity = np.column_stack([rng.uniform(-30, 30, 5), rng.uniform(20, 60, 5)]), rng.normal(0, 3, (5, 2))
    for k in range(200):
        t = 0.1 * k
        z = to_polar(start + velocity * t) + sigma * rng.normal(size=(5, 2))
        R = np.tile(np.diag(sigma**2), (5, 1, 1))
        found.learn(t, Plotted(k % 2, np.arange(5), np.full(5, t), z, R, velocity))
    assert not found.observed()[:, :2].any()
    assert (np.abs(found.bias[:, :2]) < [1.0, np.radians(0.3)]).all()
    assert abs(found.bias[1, 0] - found.bias[0, 0]) < 0.3


def test_plots_of_different_targets_teach_nothing():
    found = learnt(np.random.default_rng(3), np.zeros((2, 3)), wrong=1)
    assert found.used < 10


def test_without_a_common_target_nothing_is_learnt():
    registration = Registration(ORIGINS, PRIOR, np.array([4.0, 4.0]), jerk=0.1)
    for k in range(10):
        plots = Plotted(
            k % 2, np.array([k % 2]), np.array([2.0 * k]), np.array([[2e4, 0.1]]), R[None], np.zeros((1, 2))
        )
        registration.learn(2.0 * k, plots)
    np.testing.assert_array_equal(registration.bias, 0.0)
    np.testing.assert_allclose(registration.sigma(), PRIOR, rtol=1e-3)
    assert not registration.observed()[0, 0]
