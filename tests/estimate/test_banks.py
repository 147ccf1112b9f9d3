"""The other banks: unscented, fixed gain, interacting models."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.decision import Decision
from vidtrack.errors import ConfigError
from vidtrack.estimate.fixed_gain import FixedGainBank, alpha_beta, alpha_beta_gamma, steady_prediction
from vidtrack.estimate.imm import USUAL, IMMBank
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.acceleration import ConstantAcceleration
from vidtrack.estimate.motion.turn import CoordinatedTurn
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.estimate.sensor import POSITION
from vidtrack.estimate.unscented import UnscentedBank
from vidtrack.radar.sensors import RangeAzimuth
from vidtrack.scan import Scan


def one_to_one(rows):
    everyone = np.arange(rows)
    return Decision(everyone, everyone, everyone, np.ones(rows), np.zeros(rows))


def missed(rows):
    nobody = np.empty(0, np.int64)
    return Decision(np.arange(rows), nobody, nobody, np.empty(0), np.ones(rows))


def run(bank, z, dt, sigma):
    """Estimates (k, n) of one row over measurements z (k, d) with the first one its birth."""
    R = sigma**2 * np.eye(z.shape[1])
    bank.append(z[:1], R[None], np.ones(1))
    out = [bank.x[0]]
    for k in range(1, len(z)):
        bank.predict(dt)
        bank.update(one_to_one(1), Scan(k * dt, z[k : k + 1], R), POSITION)
        out.append(bank.x[0])
    return np.array(out)


# --- unscented


@given(seed=st.integers(0, 2**32 - 1), dim=st.sampled_from([1, 2, 3]))
@settings(deadline=None)
def test_unscented_equals_kalman_where_all_is_linear(seed, dim):
    rng = np.random.default_rng(seed)
    z = np.cumsum(rng.normal(size=(12, dim)), axis=0)
    model = ConstantVelocity(dim, accel=1.0)
    kalman, unscented = KalmanBank(model), UnscentedBank(model)
    np.testing.assert_allclose(run(unscented, z, 0.5, 1.0), run(kalman, z, 0.5, 1.0), rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(unscented.P, kalman.P, rtol=1e-8, atol=1e-8)


def polar_bank(kind, x, spread):
    bank = kind(ConstantVelocity(2))
    bank.insert(np.array([x]), np.diag([spread**2, 1.0, spread**2, 1.0])[None], np.ones(1))
    return bank


def test_unscented_moments_of_range_and_azimuth_are_the_true_ones():
    """Against a million draws: the points get mean and spread where the derivative does not."""
    bank = polar_bank(UnscentedBank, [300.0, 0.0, 400.0, 0.0], 60.0)
    draws = np.random.default_rng(0).multivariate_normal(bank.x[0], bank.P[0], 1_000_000)
    seen = RangeAzimuth().h(draws, (0, 2))
    zhat, cov = bank.predicted_measurement(RangeAzimuth())
    np.testing.assert_allclose(zhat[0], seen.mean(axis=0), rtol=1e-3)
    np.testing.assert_allclose(np.diag(cov[0]), seen.var(axis=0), rtol=0.05)
    extended = polar_bank(KalmanBank, [300.0, 0.0, 400.0, 0.0], 60.0).predicted_measurement(RangeAzimuth())[0]
    assert abs(extended[0, 0] - seen[:, 0].mean()) > 10 * abs(zhat[0, 0] - seen[:, 0].mean())


@pytest.mark.parametrize("kind", [KalmanBank, UnscentedBank])
@pytest.mark.parametrize("off", [-1e-3, 1e-3])
def test_azimuth_is_followed_across_south(kind, off):
    """A target due south, where azimuth jumps from pi to -pi, measured on either side of the jump."""
    bank = polar_bank(kind, [0.1, 0.0, -1000.0, 0.0], 5.0)
    z = np.array([[1000.0, off - np.sign(off) * np.pi]])
    bank.update(one_to_one(1), Scan(0.0, z, np.diag([1.0, 1e-4]), sensor=RangeAzimuth()), RangeAzimuth())
    assert np.linalg.norm(bank.x[0, [0, 2]] - [0.0, -1000.0]) < 3
    assert np.linalg.eigvalsh(bank.P[0]).min() > 0


# --- fixed gain


@pytest.mark.parametrize("index", [0.01, 0.1, 1.0, 10.0])
def test_kalata_gains_are_those_of_the_settled_kalman_filter(index):
    """The alpha-beta filter is the steady-state Kalman filter of the constant-velocity model (SPEC 003)."""
    P = steady_prediction(ConstantVelocity(1, accel=index), 1.0, 1.0)
    np.testing.assert_allclose(P[:, 0] / (P[0, 0] + 1.0), alpha_beta(index), rtol=1e-9)


@pytest.mark.parametrize(
    ("index", "alpha", "beta", "gamma"),
    [
        (0.01, 0.3500667758363604, 0.07512900372527964, 0.00806184361150503),
        (0.5, 0.7953736626655405, 0.5998269654033102, 0.2261782136582004),
        (2.0, 0.9189033351756488, 1.0230942833890635, 0.5695495231298195),
    ],
)
def test_alpha_beta_gamma_gains(index, alpha, beta, gamma):
    """SPEC 001, `alpha_beta_gamma`, and the settled Kalman filter of the constant-acceleration model."""
    assert alpha_beta_gamma(index) == pytest.approx((alpha, beta, gamma), rel=1e-9)
    P = steady_prediction(ConstantAcceleration(1, change=index), 1.0, 1.0)
    np.testing.assert_allclose(P[:, 0] / (P[0, 0] + 1.0), (alpha, beta, gamma), rtol=1e-7)


def test_the_fixed_gain_filter_is_the_textbook_recursion():
    rng = np.random.default_rng(3)
    z = np.cumsum(rng.normal(size=(30, 1)), axis=0)
    dt, sigma, accel = 0.5, 2.0, 3.0
    found = run(FixedGainBank(ConstantVelocity(1, accel=accel), sigma), z, dt, sigma)
    alpha, beta = alpha_beta(accel * dt**2 / sigma)
    x, v = found[5]
    for k in range(6, 30):
        x += v * dt
        nu = z[k, 0] - x
        x, v = x + alpha * nu, v + beta / dt * nu
        np.testing.assert_allclose(found[k], [x, v], rtol=1e-9)


def test_the_gain_follows_the_time_step():
    bank = FixedGainBank(ConstantVelocity(1, accel=1.0), 1.0)
    run(bank, np.zeros((6, 1)), 0.1, 1.0)
    slow, fast = bank.ahead(1.0)[1], bank.ahead(0.1)[1]
    np.testing.assert_allclose(slow[0], steady_prediction(bank.model, 1.0, 1.0))
    np.testing.assert_allclose(fast[0], steady_prediction(bank.model, 0.1, 1.0))


def test_a_fixed_gain_needs_a_sigma_and_noise_in_metres():
    with pytest.raises(ConfigError, match="sigma is 0"):
        FixedGainBank(ConstantVelocity(2), 0.0)
    with pytest.raises(ConfigError, match="object sizes"):
        FixedGainBank(ConstantVelocity(2, per_size=True), 1.0)


# --- interacting models

QUIET, BRISK = ConstantVelocity(2, accel=0.1, hold_s=1.0), ConstantVelocity(2, accel=20.0, hold_s=1.0)


def test_interacting_copies_of_one_model_are_the_kalman_filter():
    z = np.cumsum(np.random.default_rng(5).normal(size=(20, 2)), axis=0)
    imm, kalman = IMMBank([QUIET, QUIET], [10.0, 5.0]), KalmanBank(QUIET)
    np.testing.assert_allclose(run(imm, z, 0.5, 1.0), run(kalman, z, 0.5, 1.0), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(imm.P, kalman.P, rtol=1e-9, atol=1e-12)


def test_modes_are_mixed_once_for_the_smoother_and_the_prediction(monkeypatch):
    asked, noise = [], ConstantVelocity.process_noise
    monkeypatch.setattr(ConstantVelocity, "process_noise", lambda *of: asked.append(of[0]) or noise(*of))

    def bank():
        made = IMMBank([QUIET, BRISK], [20.0, 4.0])
        made.append(np.array([[0.0, 1.0], [5.0, 5.0]]), np.tile(np.eye(2), (2, 1, 1)), np.ones(2))
        made.predict(1.0)
        made.update(one_to_one(2), Scan(1.0, np.array([[1.0, 1.0], [5.0, 9.0]]), np.eye(2)), POSITION)
        return made

    both, alone = bank(), bank()
    asked.clear()
    both.cross(2.0)
    both.predict(2.0)
    assert asked == [QUIET, BRISK]
    alone.predict(2.0)
    for name in ("x", "P", "mode"):
        np.testing.assert_array_equal(getattr(both, name), getattr(alone, name))
    for changed in (lambda one: one.forget(np.array([1])), lambda one: one.keep(np.array([1]))):
        both.cross(2.0)
        for one in (both, alone):
            changed(one)
            one.predict(2.0)
        np.testing.assert_array_equal(both.x, alone.x)


def test_the_modes_tell_who_manoeuvres():
    """Straight on, then 30 m/s^2 across for 3 s."""
    t = np.arange(0, 13, 0.25)
    y = np.where(t > 10, 15.0 * (t - 10) ** 2, 0.0)
    truth = np.column_stack([50 * t, y])
    z = truth + np.random.default_rng(2).normal(0, 1.0, truth.shape)
    imm = IMMBank([QUIET, BRISK], [20.0, 4.0])
    run(imm, z[:40], 0.25, 1.0)
    assert imm.mode[0, 0] > 0.8
    for k in range(40, len(z)):
        imm.predict(0.25)
        imm.update(one_to_one(1), Scan(t[k], z[k : k + 1], np.eye(2)), POSITION)
    assert imm.mode[0, 1] > 0.9
    quiet, imm_again = KalmanBank(QUIET), IMMBank([QUIET, BRISK], [20.0, 4.0])
    lag = np.abs(run(quiet, z, 0.25, 1.0)[-1, 2] - y[-1])
    assert np.abs(run(imm_again, z, 0.25, 1.0)[-1, 2] - y[-1]) < lag / 3


@given(seed=st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=30)
def test_mode_probabilities_sum_to_one_and_covariances_stay_positive(seed):
    rng = np.random.default_rng(seed)
    bank = IMMBank([QUIET, CoordinatedTurn(2, accel=1.0), ConstantAcceleration(2, change=3.0)], [20.0, 5.0, 5.0])
    rows = int(rng.integers(1, 5))
    bank.append(rng.normal(0, 100, (rows, 2)), np.repeat(np.eye(2)[None], rows, axis=0), np.ones(rows))
    for _ in range(8):
        bank.predict(float(rng.uniform(0, 3)))
        z = bank.x[:, ::2] + rng.normal(0, 3, (rows, 2))
        weight = rng.dirichlet(np.ones(rows + 1), rows)
        row, measurement = np.divmod(np.arange(rows * rows), rows)
        beta = weight[:, :rows].ravel()
        decision = Decision(np.arange(rows), row, measurement, beta, weight[:, -1])
        bank.update(decision if rng.random() < 0.7 else missed(rows), Scan(0.0, z, np.eye(2)), POSITION)
        np.testing.assert_allclose(bank.mode.sum(axis=1), 1.0, rtol=1e-9)
        assert np.linalg.eigvalsh(bank.P).min() > 0
    bank.keep(np.arange(rows - 1))
    assert len(bank) == len(bank.mode) == rows - 1


def test_a_miss_moves_the_modes_towards_their_long_run_share_only():
    bank = IMMBank([QUIET, BRISK], [20.0, 5.0])
    bank.append(np.zeros((1, 2)), np.eye(2)[None], np.ones(1))
    for _ in range(200):
        bank.predict(1.0)
        bank.update(missed(1), Scan(0.0, np.empty((0, 2)), np.eye(2)), POSITION)
    leave = 1 - np.exp(-1 / np.array([20.0, 5.0]))
    np.testing.assert_allclose(bank.mode[0], leave[::-1] / leave.sum(), rtol=1e-6)


@pytest.mark.parametrize(
    ("models", "stay_s", "word"),
    [([QUIET], [1.0], "two models"), ([QUIET, BRISK], [1.0, 0.0], "above zero"),
     ([QUIET, ConstantVelocity(3)], [1.0, 1.0], "dimensions")],
)  # fmt: skip
def test_models_that_cannot_interact_are_refused(models, stay_s, word):
    with pytest.raises(ConfigError, match=word):
        IMMBank(models, stay_s)


def test_rates_between_kinds_of_targets_are_kept_and_stays_are_rates_that_are_alike():
    stays = IMMBank([QUIET, BRISK, QUIET], [20.0, 5.0, 4.0])
    rates = IMMBank([QUIET, BRISK, QUIET], rates=np.array([[0, 0.025, 0.025], [0.1, 0, 0.1], [0.125, 0.125, 0]]))
    np.testing.assert_allclose(stays._switching(2.0), rates._switching(2.0))
    np.testing.assert_allclose(stays._switching(2.0).sum(axis=1), 1.0)
    apart = IMMBank([QUIET, BRISK, QUIET], rates=np.array([[0, 0.1, 0], [0.1, 0, 0], [1.0, 0, 0]]), prior=np.eye(3)[0])
    apart.append(np.zeros((1, 2)), np.eye(2)[None], np.ones(1))
    apart.predict(3.0)
    assert apart.mode[0, 1] > 0 == apart.mode[0, 2]  # nothing leads to the third


def test_modes_can_be_forgotten_but_not_the_kind_of_target():
    rates = np.zeros((4, 4))
    rates[0, 1], rates[1, 0], rates[2, 3], rates[3, 2] = 0.05, 0.2, 0.1, 0.1
    bank = IMMBank([QUIET, BRISK, QUIET, BRISK], rates=rates, prior=[0.8, 0.1, 0.05, 0.05], kinds=[0, 0, 1, 1])
    bank.append(np.zeros((2, 2)), np.tile(np.eye(2), (2, 1, 1)), np.ones(2))
    bank.predict(1.0)
    bank.update(one_to_one(2), Scan(0.0, np.full((2, 2), 9.0), np.eye(2)), POSITION)
    told = bank.mode[1].copy()
    bank.forget(np.array([0]))
    kind = told[:2].sum()  # as the measurement tells it, of both rows alike
    evenly, usual = np.full(4, 0.5), np.array([0.8, 0.2, 0.5, 0.5])  # within each kind, by 20, 5, 10 and 10 s
    unseen = np.repeat([kind, 1 - kind], 2) * (USUAL * usual + (1 - USUAL) * evenly)
    np.testing.assert_allclose(bank.mode, [unseen, told])


def test_straight_flight_tells_the_kind_of_a_target_whose_modes_are_forgotten():
    rates = np.array([[0, 0.001, 0, 0], [0.05, 0, 0, 0], [0, 0, 0, 0.05], [0, 0, 0.05, 0]])
    bank = IMMBank([QUIET, BRISK, QUIET, BRISK], rates=rates, prior=np.full(4, 0.25), kinds=[0, 0, 1, 1])
    bank.append(np.zeros((1, 2)), np.eye(2)[None], np.ones(1))
    for _ in range(30):
        bank.predict(1.0)
        bank.update(one_to_one(1), Scan(0.0, bank.x[:, ::2], np.eye(2)), POSITION)
        bank.forget(np.array([0]))
    assert bank.mode[0, 2:].sum() < 0.05
    assert bank.mode[0, 1] > 0.1 * bank.mode[0, 0]


def test_a_manoeuvre_is_heeded_in_gates_and_weights_and_not_in_what_is_stated():
    """The odds of the second model are doubled where plots are gated; states, errors and NIS are as without."""
    heedful, plain = IMMBank([QUIET, BRISK], [20.0, 5.0], heed=[1.0, 2.0]), IMMBank([QUIET, BRISK], [20.0, 5.0])
    z = np.cumsum(np.random.default_rng(5).normal(size=(20, 2)), axis=0)
    np.testing.assert_array_equal(run(heedful, z, 0.5, 1.0), run(plain, z, 0.5, 1.0))
    np.testing.assert_array_equal(heedful.P, plain.P)
    for one, other in zip(heedful.predicted_measurement(POSITION), plain.predicted_measurement(POSITION), strict=True):
        np.testing.assert_array_equal(one, other)
    usual, agile = plain.modes(POSITION).weight
    np.testing.assert_allclose(heedful.modes(POSITION).weight[1], 2 * agile / (usual + 2 * agile), rtol=1e-12)


@pytest.mark.parametrize("heed", [[1.0], [1.0, 0.0], [1.0, np.nan]])
def test_heed_that_is_none_is_refused(heed):
    with pytest.raises(ConfigError, match="heed"):
        IMMBank([QUIET, BRISK], [20.0, 5.0], heed=heed)


@pytest.mark.parametrize("rates", [np.zeros((2, 2)), -np.ones((2, 2)), np.ones((3, 3))])
def test_rates_that_are_none_are_refused(rates):
    with pytest.raises(ConfigError, match="rate"):
        IMMBank([QUIET, BRISK], rates=rates)
