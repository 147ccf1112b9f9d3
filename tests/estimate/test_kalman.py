"""The Kalman bank against the textbook filter, one row at a time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.decision import Decision
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.estimate.sensor import POSITION
from vidtrack.scan import Scan


def covariances(rng, count, dim, size=1.0):
    root = size * rng.normal(size=(count, dim, dim))
    return root @ np.swapaxes(root, 1, 2) + 0.1 * size**2 * np.eye(dim)


def filled_bank(rng, rows, dim, **model):
    """A bank of random states whose headings are known."""
    bank = KalmanBank(ConstantVelocity(dim=dim, **model))
    bank.append(rng.normal(size=(rows, dim)), covariances(rng, rows, dim), np.ones(rows))
    bank.x = 10 * rng.normal(size=(rows, 2 * dim))
    bank.P = covariances(rng, rows, 2 * dim)
    bank.hits = np.full(rows, 20)
    return bank


def one_to_one(rows):
    everyone = np.arange(rows)
    return Decision(everyone, everyone, everyone, np.ones(rows), np.zeros(rows))


def missed(rows):
    nobody = np.empty(0, np.int64)
    return Decision(np.arange(rows), nobody, nobody, np.empty(0), np.ones(rows))


@pytest.mark.parametrize("dim", [2, 3])
def test_covariance_of_predicted_positions_is_the_product_with_the_matrix_that_selects_them(dim):
    bank = filled_bank(np.random.default_rng(dim), 7, dim)
    zhat, cov = bank.predicted_measurement(POSITION)
    H = POSITION.H(bank.x, bank.model.position)[0]
    assert (zhat == bank.x @ H.T).all()
    assert np.allclose(cov, H @ bank.P @ H.T, rtol=1e-15)


def kalman_step(x, P, F, Q, H, z, R):
    """Textbook predict and update of one filter."""
    x, P = F @ x, F @ P @ F.T + Q
    S = H @ P @ H.T + R
    K = P @ H.T @ np.linalg.inv(S)
    return x + K @ (z - H @ x), (np.eye(len(x)) - K @ H) @ P


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(1, 8), dim=st.sampled_from([1, 2, 3]), dt=st.floats(0, 3))
@settings(max_examples=100, deadline=None)
def test_each_row_is_the_textbook_filter(seed, rows, dim, dt):
    rng = np.random.default_rng(seed)
    bank = filled_bank(rng, rows, dim, accel=1.5)
    z, R = 10 * rng.normal(size=(rows, dim)), covariances(rng, rows, dim)
    F = np.kron(np.eye(dim), [[1.0, dt], [0.0, 1.0]])
    G = np.kron(np.eye(dim), [[dt**2 / 2], [dt]])
    H = np.kron(np.eye(dim), [[1.0, 0.0]])
    expected = [kalman_step(bank.x[t], bank.P[t], F, 1.5**2 * G @ G.T, H, z[t], R[t]) for t in range(rows)]
    bank.predict(dt)
    bank.update(one_to_one(rows), Scan(0.0, z, R), POSITION)
    for t, (x, P) in enumerate(expected):
        np.testing.assert_allclose(bank.x[t], x, rtol=1e-12, atol=1e-12 * np.abs(x).max())
        np.testing.assert_allclose(bank.P[t], P, rtol=1e-12, atol=1e-12 * np.abs(P).max())
        np.testing.assert_array_equal(bank.P[t], bank.P[t].T)


def test_predicted_measurement_is_the_projected_state():
    rng = np.random.default_rng(0)
    bank = filled_bank(rng, 5, 2)
    zhat, cov = bank.predicted_measurement(POSITION)
    np.testing.assert_array_equal(zhat, bank.x[:, [0, 2]])
    np.testing.assert_allclose(cov, bank.P[:, [0, 2]][:, :, [0, 2]], rtol=1e-15)


@given(
    seed=st.integers(0, 2**32 - 1),
    weights=st.lists(st.floats(0.05, 1.0), min_size=1, max_size=4),
    miss=st.floats(0.0, 1.0),
)
@settings(max_examples=100, deadline=None)
def test_soft_weights_give_the_moments_of_the_mixture(seed, weights, miss):
    rng = np.random.default_rng(seed)
    bank = filled_bank(rng, 1, 2)
    share = np.array([miss, *weights])
    share /= share.sum()
    count = len(weights)
    z, R = 10 * rng.normal(size=(count, 2)), covariances(rng, count, 2)
    H, F = np.kron(np.eye(2), [[1.0, 0.0]]), np.eye(4)
    branches = [(bank.x[0], bank.P[0])]
    branches += [kalman_step(bank.x[0], bank.P[0], F, np.zeros((4, 4)), H, z[j], R[j]) for j in range(count)]
    mean = sum(w * x for w, (x, _) in zip(share, branches, strict=True))
    cov = sum(w * (P + np.outer(x - mean, x - mean)) for w, (x, P) in zip(share, branches, strict=True))
    decision = Decision(np.zeros(1, int), np.zeros(count, int), np.arange(count), share[1:], share[:1])
    bank.update(decision, Scan(0.0, z, R), POSITION)
    np.testing.assert_allclose(bank.x[0], mean, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(bank.P[0], cov, rtol=1e-10, atol=1e-10 * np.abs(cov).max())


def test_a_missed_row_stays_as_predicted_and_rows_do_not_mix():
    rng = np.random.default_rng(3)
    bank = filled_bank(rng, 3, 2)
    x, P = bank.x.copy(), bank.P.copy()
    only_the_second = Decision(np.arange(3), np.array([1]), np.array([0]), np.ones(1), np.array([1.0, 0.0, 1.0]))
    bank.update(only_the_second, Scan(0.0, np.zeros((1, 2)), np.eye(2)), POSITION)
    np.testing.assert_array_equal(bank.x[[0, 2]], x[[0, 2]])
    np.testing.assert_allclose(bank.P[[0, 2]], P[[0, 2]], rtol=1e-15)
    assert np.linalg.norm(bank.x[1] - x[1]) > 0
    np.testing.assert_array_equal(bank.hits, [20, 21, 20])


def test_successors_come_from_their_parents():
    """One row continued twice, by a measurement and by a miss, and another one ended: a hypothesis tree's step."""
    rng = np.random.default_rng(4)
    bank, single = filled_bank(rng, 2, 2), filled_bank(np.random.default_rng(4), 2, 2)
    scan = Scan(0.0, np.ones((1, 2)), np.eye(2))
    x, P = bank.x.copy(), bank.P.copy()
    bank.update(
        Decision(np.array([1, 1]), np.array([0]), np.array([0]), np.ones(1), np.array([0.0, 1.0])), scan, POSITION
    )
    single.update(
        Decision(np.arange(2), np.array([1]), np.array([0]), np.ones(1), np.array([1.0, 0.0])), scan, POSITION
    )
    np.testing.assert_allclose(bank.x, [single.x[1], x[1]])
    np.testing.assert_allclose(bank.P, [single.P[1], P[1]])


@pytest.mark.parametrize(("accel", "sigma", "T"), [(1.0, 1.0, 1.0), (3.0, 5.0, 0.04), (24.5, 5.0, 1 / 7.7)])
def test_steady_state_gains_are_those_of_kalata(accel, sigma, T):
    """SPEC trap 11: with Q = accel^2 G G' the filter becomes the alpha-beta filter of tracking index L."""
    bank = KalmanBank(ConstantVelocity(dim=1, accel=accel))
    bank.append(np.zeros((1, 1)), np.full((1, 1, 1), sigma**2), np.ones(1))
    for _ in range(1000):
        bank.predict(T)
        bank.update(one_to_one(1), Scan(0.0, np.zeros((1, 1)), np.full((1, 1), sigma**2)), POSITION)
    L = accel * T**2 / sigma
    r = (4 + L - np.sqrt(8 * L + L**2)) / 4
    alpha = 1 - r**2
    beta = 2 * (2 - alpha) - 4 * np.sqrt(1 - alpha)
    gain = bank.P[0, :, 0] / sigma**2  # K = P H' / R with the updated P
    np.testing.assert_allclose(gain, [alpha, beta / T], rtol=1e-9)


def test_a_million_updates_stay_positive_definite():
    """100 rows, 5000 steps each, twice, with measurement noises from 1e-6 to 1e6 in one scan."""
    rng = np.random.default_rng(1)
    bank, rows = filled_bank(rng, 100, 2, accel=0.5, hold_s=0.5), np.arange(100)
    R = np.array([1e-6, 1.0, 1e3, 1e6])[:, None, None] * np.eye(2)
    scan = Scan(0.0, rng.normal(size=(4, 2)), R)
    turns = [Decision(rows, rows, (rows + k) % 4, np.ones(100), np.zeros(100)) for k in range(4)]
    for dt in (0.04, 10.0):
        worst = np.inf
        for k in range(5000):
            bank.predict(dt)
            bank.update(turns[k % 4], scan, POSITION)
            worst = min(worst, (bank.P[:, 0, 0] * bank.P[:, 1, 1] - bank.P[:, 0, 1] * bank.P[:, 1, 0]).min())
        assert np.isfinite(bank.x).all()
        assert worst > 0
        np.testing.assert_array_equal(bank.P, np.swapaxes(bank.P, 1, 2))
        assert (np.linalg.eigvalsh(bank.P) > 0).all()


@given(
    st.lists(st.sampled_from([0.0, 1e-9, 1e-3, 0.04, 1.0, 60.0, 3600.0]), min_size=1, max_size=30), st.integers(0, 1000)
)
@settings(max_examples=60, deadline=None)
def test_any_time_steps_keep_the_covariances(steps, seed):
    rng = np.random.default_rng(seed)
    bank = filled_bank(rng, 3, 2, accel=2.0, cross=0.7, hold_s=0.5)
    for dt in steps:
        bank.predict(dt)
        bank.update(one_to_one(3), Scan(0.0, bank.x[:, [0, 2]] + rng.normal(size=(3, 2)), np.eye(2)), POSITION)
    assert np.isfinite(bank.x).all()
    assert (np.linalg.eigvalsh(bank.P) > 0).all()


def test_no_time_changes_nothing_and_an_hour_makes_it_vague():
    bank = filled_bank(np.random.default_rng(5), 3, 2, accel=1.0)
    x, P = bank.ahead(0.0)
    np.testing.assert_array_equal(x, bank.x)
    np.testing.assert_allclose(P, bank.P, rtol=1e-15)
    _, later = bank.ahead(3600.0)
    assert (np.diagonal(later, axis1=1, axis2=2) > np.diagonal(bank.P, axis1=1, axis2=2)).all()
    assert (later[:, 0, 0] > 1e6).all()


def test_looking_ahead_changes_nothing():
    bank = filled_bank(np.random.default_rng(6), 3, 2)
    x, P = bank.x.copy(), bank.P.copy()
    ahead = bank.ahead(2.0)
    np.testing.assert_array_equal(bank.x, x)
    np.testing.assert_array_equal(bank.P, P)
    bank.predict(2.0)
    np.testing.assert_array_equal(bank.x, ahead[0])
    np.testing.assert_array_equal(bank.P, ahead[1])


def test_keep_drops_the_other_rows():
    bank = filled_bank(np.random.default_rng(7), 4, 2)
    x = bank.x.copy()
    bank.keep(np.array([True, False, False, True]))
    assert len(bank) == 2
    np.testing.assert_array_equal(bank.x, x[[0, 3]])
    bank.keep(np.zeros(2, bool))
    bank.predict(0.1)
    bank.update(missed(0), Scan(0.0, np.zeros((1, 2)), np.eye(2)), POSITION)
    assert len(bank) == 0


def test_a_look_ahead_is_that_of_the_states_there_are():
    """The last one is kept; other states, or another time, must not be given it."""
    bank = filled_bank(np.random.default_rng(5), 3, 2)
    first = bank.ahead(0.5)
    assert bank.ahead(0.5)[0] is first[0]
    assert not np.allclose(bank.ahead(0.7)[0], first[0])
    bank.x = bank.x + 1.0
    np.testing.assert_allclose(bank.ahead(0.5)[0], first[0] + np.array([1.5, 1.0, 1.5, 1.0]))
    before = bank.P
    bank.P = 2 * bank.P
    assert not np.allclose(bank.ahead(0.5)[1], first[1])
    bank.P = before
    bank.predict(0.5)
    np.testing.assert_allclose(bank.x, first[0] + np.array([1.5, 1.0, 1.5, 1.0]))
