"""The joint state of targets that share a measurement, against sampling and known formulas."""

import numpy as np
import pytest
import scipy  # its parts are imported when they are asked for
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.decision import Decision
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.estimate.sensor import POSITION, POSITION_VELOCITY
from vidtrack.scan import Scan
from vidtrack.tracking.unresolved.correlations import Correlations
from vidtrack.tracking.unresolved.joint import Joint, equivalent, exchange_probability


def covariance(size, seed, scale=1.0):
    root = np.random.default_rng(seed).normal(size=(size, size))
    return scale * (root @ root.T + 0.5 * np.eye(size))


def two(seed=0, scale=1.0):
    """Two targets in the plane with correlated errors."""
    x = np.random.default_rng(seed).normal(size=8) * 3
    return Joint(x, covariance(8, seed, scale), 2)


@given(st.floats(-6, 6), st.floats(0.1, 5), st.floats(0.5, 6))
def test_an_interval_gives_the_moments_of_the_truncated_normal(mean, sigma, limit):
    joint = Joint(np.array([mean, 0.0]), np.diag([sigma**2, 1.0]), 1)
    found = joint.within(np.array([1.0, 0.0]), limit)
    low, high = (-limit - mean) / sigma, (limit - mean) / sigma
    if scipy.stats.multivariate_normal().cdf(high) - scipy.stats.multivariate_normal().cdf(low) < 1e-4:
        return
    expected = scipy.stats.truncnorm.stats(low, high, mean, sigma)
    np.testing.assert_allclose([found.x[0], found.P[0, 0]], expected, rtol=1e-5, atol=1e-7)
    assert found.P[1, 1] == 1.0


def test_a_condition_that_is_met_for_certain_changes_nothing():
    joint = two(1)
    h = joint.difference(0, 1)[0]
    far = joint.within(h, abs(h @ joint.x) + 12 * np.sqrt(h @ joint.P @ h))
    np.testing.assert_allclose(far.x, joint.x, atol=1e-12)
    np.testing.assert_allclose(far.P, joint.P, atol=1e-12)


def test_a_condition_moves_what_is_correlated_as_a_sample_shows():
    joint = two(2)
    h = joint.difference(0, 1)[1]
    limit = 0.7 * np.sqrt(h @ joint.P @ h)
    sample = np.random.default_rng(0).multivariate_normal(joint.x, joint.P, 400_000)
    sample = sample[np.abs(sample @ h) < limit]
    found = joint.within(h, limit)
    np.testing.assert_allclose(found.x, sample.mean(axis=0), atol=0.05)
    np.testing.assert_allclose(found.P, np.cov(sample.T), atol=0.15)


def test_one_target_is_updated_as_by_a_kalman_filter():
    x, P, R, z = np.array([1.0, 2, 3, 4]), covariance(4, 3), covariance(2, 4), np.array([2.0, 2.5])
    joint = Joint(x, P, 2)
    found = joint.updated(z, R)
    bank = KalmanBank(ConstantVelocity())
    bank.insert(x[None], P[None], np.ones(1))
    bank.update(
        Decision(np.array([0]), np.array([0]), np.array([0]), np.ones(1), np.zeros(1)), Scan(0, z[None], R), POSITION
    )
    np.testing.assert_allclose(found.x, bank.x[0])
    np.testing.assert_allclose(found.P, bank.P[0])
    S = P[::2, ::2] + R
    assert joint.log_likelihood(z[None], R[None])[0] == pytest.approx(
        scipy.stats.multivariate_normal(x[::2], S).logpdf(z)
    )


@pytest.mark.parametrize("count", [2, 3])
def test_the_shared_measurement_has_the_moments_of_the_centre_of_power(count):
    """Echoes of Swerling I targets: exponential powers of the same mean."""
    rng = np.random.default_rng(5)
    places = rng.normal(size=(count, 2)) * 10
    state = np.zeros((count, 4))
    state[:, ::2] = places
    power = rng.exponential(size=(400_000, count))
    centre = power @ places / power.sum(axis=1, keepdims=True)
    R = np.eye(2)
    certain = Joint(state.ravel(), 1e-9 * np.eye(4 * count), 2)
    at = certain.middle + np.array([1.0, -2.0])
    expected = scipy.stats.multivariate_normal(centre.mean(axis=0), np.cov(centre.T) + R).logpdf(at)
    assert certain.log_likelihood(at[None], R[None])[0] == pytest.approx(expected, abs=0.02)


def test_a_shared_measurement_says_nothing_of_the_difference():
    joint = Joint(np.zeros(8), np.kron(np.eye(2), covariance(4, 6)), 2)
    found = joint.updated(np.array([5.0, -3.0]), np.eye(2))
    apart = joint.difference(0, 1)
    np.testing.assert_allclose(apart @ found.x, 0, atol=1e-9)
    np.testing.assert_allclose(apart @ found.P @ apart.T, apart @ joint.P @ apart.T)
    assert (np.linalg.eigvalsh(joint.P - found.P) > -1e-9).all()


@given(st.integers(0, 10_000))
def test_the_equivalent_measurement_makes_the_same_update(seed):
    joint = two(seed, scale=100.0)
    found = joint.updated(joint.middle + np.array([3.0, 1.0]), 5 * np.eye(2))
    x, P, x1, P1 = joint.x[:4], joint.P[:4, :4], found.x[:4], found.P[:4, :4]
    z, R = equivalent(x, P, x1, P1)
    bank = KalmanBank(ConstantVelocity())
    bank.insert(x[None], P[None], np.ones(1))
    bank.update(
        Decision(np.array([0]), np.array([0]), np.array([0]), np.ones(1), np.zeros(1)),
        Scan(0.0, z[None], R[None], POSITION_VELOCITY), POSITION_VELOCITY,
    )  # fmt: skip
    np.testing.assert_allclose(bank.x[0], x1, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(bank.P[0], P1, rtol=1e-4, atol=1e-4 * np.abs(P).max())


def test_exchange_is_certain_as_far_as_the_difference_is_known():
    known = Joint(np.array([0.0, 0, 100, 0]), np.diag([1.0, 1, 1, 1]), 1)
    R = np.ones((2, 1, 1))
    assert exchange_probability(known, np.array([[0.0], [100.0]]), R) < 1e-12
    assert exchange_probability(known, np.array([[100.0], [0.0]]), R) > 1 - 1e-12
    alike = Joint(np.zeros(4), np.diag([1e4, 1, 1e4, 1]), 1)
    assert exchange_probability(alike, np.array([[0.0], [100.0]]), R) == pytest.approx(0.5)


@given(st.integers(0, 1000))
def test_both_orders_of_an_exchange_sum_to_one(seed):
    joint, z = two(seed), np.random.default_rng(seed + 1).normal(size=(2, 2))
    R = np.tile(np.eye(2), (2, 1, 1))
    assert exchange_probability(joint, z, R) + exchange_probability(joint, z[::-1], R) == pytest.approx(1)
    one = np.array([z[0], [np.nan, np.nan]])
    both = [
        scipy.stats.multivariate_normal(joint.x[k : k + 4 : 2], joint.P[k : k + 4 : 2, k : k + 4 : 2] + np.eye(2)).pdf(
            z[0]
        )
        for k in (0, 4)
    ]
    assert exchange_probability(joint, one, R) == pytest.approx(both[1] / sum(both), abs=1e-9)


def test_correlations_come_back_as_they_were_kept_and_move_with_the_states():
    joint, ids = two(7), np.array([9, 4])
    kept = Correlations()
    P = np.stack([joint.P[:4, :4], joint.P[4:, 4:]])
    kept.keep(ids, joint, P)
    again = kept.joint(ids, joint.x.reshape(2, 4), P)
    np.testing.assert_allclose(again.P, joint.P, atol=1e-9)
    swapped = kept.joint(ids[::-1], joint.x.reshape(2, 4)[::-1], P[::-1])
    np.testing.assert_allclose(swapped.P[:4, 4:], joint.P[4:, :4], atol=1e-9)
    F = np.kron(np.eye(2), [[1, 2.0], [0, 1]])
    kept.predict(2.0)
    moved = kept.joint(ids, joint.x.reshape(2, 4), F @ P @ F.T)
    np.testing.assert_allclose(moved.P, np.kron(np.eye(2), F) @ joint.P @ np.kron(np.eye(2), F).T, atol=1e-8)
    other = kept.joint(np.array([9, 5]), joint.x.reshape(2, 4), P)
    assert not other.P[:4, 4:].any()


@given(st.integers(0, 1000), st.floats(0.01, 1))
def test_correlations_are_reduced_where_a_track_has_become_surer_alone(seed, share):
    joint, ids = two(seed), np.array([1, 2])
    kept = Correlations()
    P = np.stack([joint.P[:4, :4], joint.P[4:, 4:]])
    kept.keep(ids, joint, P)
    found = kept.joint(ids, np.zeros((2, 4)), share * P).P
    assert np.linalg.eigvalsh(found).min() > 0
    np.testing.assert_allclose(found[:4, :4], share * P[0])


@given(st.integers(0, 1000), st.floats(0.2, 3))
def test_correlations_stay_possible_whatever_the_covariances_become(seed, scale):
    joint, ids = two(seed), np.array([1, 2])
    kept = Correlations()
    P = np.stack([covariance(4, seed + 1, scale), covariance(4, seed + 2, scale)])
    kept.keep(ids, joint, P)
    assert np.linalg.eigvalsh(kept.joint(ids, np.zeros((2, 4)), P).P).min() > 0
