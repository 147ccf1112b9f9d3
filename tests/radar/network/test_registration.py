"""Registration: biases from common targets, with true errors."""

import numpy as np
import pytest

from vidtrack.radar.coordinates import to_cartesian, to_polar, wrap
from vidtrack.radar.network.registration import Plotted, Registration, derivatives

ORIGINS = [(0.0, 15e3), (0.0, -15e3)]
SIGMA = np.array([40.0, np.radians(0.3)])
PRIOR = np.array([[100.0, np.radians(1.0), 0.0], [100.0, np.radians(1.0), 1.0]])
R = np.diag(SIGMA**2)


def learnt(
    rng,
    bias,
    origins=ORIGINS,
    prior=PRIOR,
    scans=40,
    targets=5,
    noise=1.0,
    wrong=0,
    sigma=SIGMA,
    begin_s=0.0,
    known=None,
):
    """A registration after radars with biases (S, 3) have seen targets fly straight, `wrong` of them mixed up."""
    registration = known
    if known is None:
        registration = Registration(origins, prior, np.full(len(prior), 4.0), jerk=0.1)
    start, velocity = rng.uniform(-30e3, 30e3, (targets, 2)), rng.normal(0, 150, (targets, 2))
    for k in range(scans):
        for radar in range(len(bias)):
            t = begin_s + 1.7 * radar + 4.0 * k
            xy = start + velocity * t
            z = to_polar(xy - np.array(origins[radar])) + bias[radar, :2]
            z = z + noise * sigma * rng.normal(size=z.shape)
            late = t + bias[radar, 2]
            ids = np.roll(np.arange(targets), radar * wrong)
            track = xy[ids] + 0.3 * noise * sigma[0] * rng.normal(size=xy.shape)
            R = np.tile(np.diag(sigma**2), (targets, 1, 1))
            registration.learn(late, Plotted(radar, ids, np.full(targets, late), z, R, track, velocity[ids]))
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
    found = learnt(np.random.default_rng(1), bias, prior=prior, noise=0.0, sigma=SIGMA / 10)
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
        xy = start + velocity * t
        z = to_polar(xy) + sigma * rng.normal(size=(5, 2))
        R = np.tile(np.diag(sigma**2), (5, 1, 1))
        found.learn(t, Plotted(k % 2, np.arange(5), np.full(5, t), z, R, xy + 0.3 * rng.normal(size=(5, 2)), velocity))
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
            k % 2, np.array([k % 2]), np.array([2.0 * k]), np.array([[2e4, 0.1]]), R[None], *np.zeros((2, 1, 2))
        )
        registration.learn(2.0 * k, plots)
    np.testing.assert_array_equal(registration.bias, 0.0)
    np.testing.assert_allclose(registration.sigma(), PRIOR, rtol=1e-3)
    assert not registration.observed()[0, 0]


@pytest.mark.parametrize("sigma_deg", [0.3, 2.0])
def test_large_errors_of_azimuth_make_no_bias(sigma_deg):
    """Where the target is at most 45 km away an azimuth error of 2 degrees shortens the mean of plots by 27 m."""
    sigma, off = np.array([40.0, np.radians(sigma_deg)]), []
    for seed in range(20):
        rng, found = np.random.default_rng(seed), None
        bias = PRIOR * [1, 1, 0] * rng.normal(size=(2, 3))
        for part in range(4):
            found = learnt(rng, bias, prior=PRIOR * [1, 1, 0], sigma=sigma, begin_s=200.0 * part, known=found)
            found.begin_anew()
        off.append(((found.bias - bias) / np.maximum(found.sigma(), 1e-9))[:, :2])
    assert np.abs(np.mean(off, axis=0)).max() < 4 / np.sqrt(20)
    assert np.mean(np.square(off)) < 1.5


def test_comparisons_of_different_targets_are_given_up_for_the_right_ones():
    rng = np.random.default_rng(6)
    prior = np.array([[100.0, np.radians(10.0), 0.0], [100.0, np.radians(10.0), 0.0]])
    bias = np.array([[0.0, 0.0, 0.0], [50.0, np.radians(5.0), 0.0]])
    found = learnt(rng, bias, prior=prior, scans=3, targets=2, wrong=1)
    assert 0 < found.used < 4
    assert not found.told
    np.testing.assert_array_equal(found.bias, 0.0)  # so few may all be of different targets
    np.testing.assert_array_equal(found.sigma(), prior)
    assert not found.observed()[:, :2].any()
    found.begin_anew()
    found = learnt(rng, bias, begin_s=20.0, known=found)
    assert found.told
    assert found.observed()[1, 1]
    assert (np.abs(found.bias - bias) <= 4 * found.sigma()).all()


def test_a_radar_that_is_turned_is_learnt_anew():
    """By a degree, which is less than three standard deviations of a comparison: single ones do not tell."""
    rng = np.random.default_rng(7)
    prior, bias = PRIOR * [1, 1, 0], np.array([[0.0, 0.0, 0.0], [50.0, np.radians(-0.5), 0.0]])
    found = learnt(rng, bias, prior=prior)
    assert np.degrees(found.bias[1, 1]) == pytest.approx(-0.5, abs=0.2)
    found.begin_anew()
    bias[1, 1] = np.radians(0.5)
    found = learnt(rng, bias, begin_s=300.0, known=found)
    assert np.degrees(found.bias[1, 1]) == pytest.approx(0.5, abs=0.2)


@pytest.mark.parametrize("seed", range(5))
def test_a_right_estimate_is_never_given_up(seed):
    rng, prior = np.random.default_rng(seed), PRIOR * [1, 1, 0]
    found = learnt(rng, prior * rng.normal(size=(2, 3)), prior=prior, scans=150)
    assert found.used > 0.99 * (150 - 2) * 5


def test_errors_larger_than_stated_do_not_contradict_an_estimate_for_ever():
    rng, prior = np.random.default_rng(11), PRIOR * [1, 1, 0]
    bias = np.array([[0.0, 0.0, 0.0], [50.0, np.radians(1.0), 0.0]])
    found = learnt(rng, bias, prior=prior, scans=200, noise=2.0)
    assert found.used > 700  # of 995
    assert np.degrees(found.bias[1, 1]) == pytest.approx(1.0, abs=0.1)


def test_radars_that_share_no_target_do_not_make_the_others_less_sure():
    bias, origins = np.zeros((2, 3)), [*ORIGINS, (90e3, 0.0), (90e3, 9e3), (99e3, 0.0), (99e3, 9e3)]
    two = learnt(np.random.default_rng(8), bias)
    six = learnt(np.random.default_rng(8), bias, origins=origins, prior=PRIOR[[0, 1, 1, 1, 1, 1]])
    np.testing.assert_allclose(six.sigma()[:2], two.sigma(), rtol=1e-6)


def test_derivatives_are_those_of_positions_by_biases():
    rng = np.random.default_rng(9)
    origin, xy, v = rng.normal(0, 9e3, 2), rng.normal(0, 9e3, (7, 2)), rng.normal(0, 200, (7, 2))
    polar = to_polar(xy - origin)
    for kind, step in enumerate((1.0, 1e-4)):
        off = step * np.eye(2)[kind]
        slope = (to_cartesian(polar + off) - to_cartesian(polar - off)) / (2 * step)
        np.testing.assert_allclose(derivatives(origin, xy, v)[:, :, kind], slope, rtol=1e-6, atol=1e-3)
    np.testing.assert_array_equal(derivatives(origin, xy, v)[:, :, 2], -v)  # what is told late was measured before
