"""Particle filters: resampling, weights, angles, and that they are Kalman filters where all is linear and normal."""

import numpy as np
import pytest
from scipy.special import chdtri

from vidtrack.decision import Decision
from vidtrack.errors import ConfigError
from vidtrack.estimate.error_signal import ErrorSignalBank, cycle
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.turn import CoordinatedTurn
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.estimate.particle import Glint, ParticleBank
from vidtrack.estimate.resampling import Resampling, choose
from vidtrack.estimate.sensor import POSITION
from vidtrack.estimate.uniform_bins import RANGE_M, UniformBinsBank
from vidtrack.radar.sensors import RangeAzimuth
from vidtrack.scan import Scan

SCHEMES = [kind for kind in Resampling if kind != Resampling.NONE]
MODEL = ConstantVelocity(1, accel=2.0)
NOBODY = np.empty(0, np.int64)


def one_to_one(rows):
    everyone = np.arange(rows)
    return Decision(everyone, everyone, everyone, np.ones(rows), np.zeros(rows))


def bank_of(kind, rows=1, x=(0.0, 0.0), P=((4.0, 0.0), (0.0, 1.0)), model=MODEL, **options):
    bank = kind(model, **options)
    bank.insert(np.tile(np.array(x, float), (rows, 1)), np.tile(np.array(P, float), (rows, 1, 1)), np.ones(rows))
    return bank


def scan_of(z, sigma=1.0, t=0.0):
    z = np.atleast_2d(np.asarray(z, float))
    return Scan(t, z, sigma**2 * np.eye(z.shape[1]))


# --- resampling


@pytest.mark.parametrize("kind", SCHEMES)
def test_each_particle_goes_on_as_often_as_its_weight_says_on_average(kind):
    """Chi-square of the total counts of 2,000 resamplings; multinomial counts reach its mean, the others stay below."""
    weight = np.array([0.02, 0.3, 0.0, 0.08, 0.25, 0.15, 0.2])
    chosen, count = np.empty(7, np.int64), np.uint64(5)
    times = 2000
    total = np.zeros(7)
    for _ in range(times):
        count = choose(int(kind), weight, chosen, np.uint64(count))
        total += np.bincount(chosen, minlength=7)
    some = weight > 0
    expected = times * 7 * weight[some]
    assert total[2] == 0
    assert ((total[some] - expected) ** 2 / expected).sum() < chdtri(5, 0.001)


@pytest.mark.parametrize("kind", [Resampling.RESIDUAL, Resampling.SYSTEMATIC])
def test_counts_are_at_most_one_off_or_at_least_the_whole_part(kind):
    rng = np.random.default_rng(1)
    for seed in range(50):
        weight = rng.dirichlet(np.full(40, 0.3))
        chosen = np.empty(40, np.int64)
        choose(int(kind), weight, chosen, np.uint64(seed))
        count = np.bincount(chosen, minlength=40)
        assert (count >= np.floor(40 * weight - 1e-9)).all()
        if kind == Resampling.SYSTEMATIC:
            assert (count <= np.ceil(40 * weight + 1e-9)).all()


@pytest.mark.parametrize("kind", SCHEMES)
@pytest.mark.parametrize("heavy", [0, 3, 9])
def test_a_particle_with_all_the_weight_is_all_that_goes_on(kind, heavy):
    chosen = np.empty(10, np.int64)
    choose(int(kind), np.eye(10)[heavy], chosen, np.uint64(1))
    assert (chosen == heavy).all()


X_IN = [[0, 1], [30, 2], [5, 3], [-40, 4], [-10, 5], [26, 6], [24, 7]]
W_IN = [0.1, 0.2, 0.3, 0.1, 0.1, 0.1, 0.1]
X_OUT = [[0, 1], [5, 3], [-10, 5], [24, 7], [0, 1], [5, 3], [-10, 5]]
W_OUT = np.array([1, 3, 1, 1, 1, 3, 1]) / 11


def test_error_signal_resampling_is_that_of_the_paper():
    """SPEC 003: survivors in their order with their weights, copied from the first on, normalised."""
    x, w = np.array(X_IN, float), np.array(W_IN)
    chosen = np.empty(7, np.int64)
    assert cycle(np.abs(x[:, 0]) < 25, chosen) == 4
    np.testing.assert_array_equal(x[chosen], X_OUT)
    np.testing.assert_allclose(w[chosen] / w[chosen].sum(), W_OUT, rtol=1e-12)


def test_the_error_signal_bank_does_the_same():
    """The same vector through an update whose measurement is exact enough for alpha and too poor to weigh."""
    bank = bank_of(ErrorSignalBank, number=7, alpha=25e-6)
    bank.particles[0], bank.log_weight[0] = X_IN, np.log(W_IN)
    bank.update(one_to_one(1), scan_of([0.0], sigma=1e6), POSITION)
    np.testing.assert_array_equal(bank.particles[0], X_OUT)
    np.testing.assert_allclose(np.exp(bank.log_weight[0]), W_OUT, rtol=1e-8)


def test_without_a_survivor_particles_are_thrown_around_the_measurement_and_keep_their_velocities():
    bank = bank_of(ErrorSignalBank, rows=2, x=(0.0, 7.0), number=500)
    velocity = bank.particles[..., 1].copy()
    bank.update(one_to_one(2), scan_of([[1000.0], [0.5]], sigma=2.0), POSITION)
    thrown = bank.particles[0, :, 0]
    assert 990 < thrown.min() < 991 < 1009 < thrown.max() < 1010
    np.testing.assert_array_equal(bank.particles[0, :, 1], velocity[0])
    np.testing.assert_allclose(np.exp(bank.log_weight[0]), 1 / 500)
    assert np.abs(bank.particles[1, :, 0] - 0.5).max() < 10


# --- weights


@pytest.mark.parametrize("kind", Resampling)
def test_in_the_linear_normal_case_the_estimates_are_those_of_kalman(kind):
    """Mean over 40 rows of 4,000 particles, within four standard errors; SIS only for the few scans it lives."""
    rng = np.random.default_rng(2)
    rows, scans = 40, 4 if kind == Resampling.NONE else 25
    particle = bank_of(ParticleBank, rows, number=4000, resampling=kind, seed=3)
    kalman = bank_of(KalmanBank, rows)
    z = np.cumsum(rng.normal(size=(scans, 1, 1)), axis=0)
    for k in range(scans):
        for bank in (particle, kalman):
            bank.predict(0.7)
            bank.update(one_to_one(rows), scan_of(np.tile(z[k], (rows, 1)), t=k), POSITION)
    off = particle.x - kalman.x
    assert np.abs(off.mean(axis=0) / (off.std(axis=0) / np.sqrt(rows))).max() < 4
    assert off.std() < 0.1
    np.testing.assert_allclose(particle.P.mean(axis=0), kalman.P[0], rtol=0.03)


def test_shared_out_measurements_mix_as_in_kalman():
    """Weights of a PDA: the mixture's moments, and a miss that keeps the prediction."""
    nowhere = Decision(np.arange(2), np.zeros(2, np.int64), np.arange(2), np.array([0.5, 0.2]), np.array([0.3, 1.0]))
    for spread in (True, False):
        decision = Decision(*[getattr(nowhere, name) for name in ("parent", "row", "measurement", "beta", "beta0")],
                            spread=spread)  # fmt: skip
        particle, kalman = bank_of(ParticleBank, 2, number=400_000), bank_of(KalmanBank, 2)
        for bank in (particle, kalman):
            bank.update(decision, scan_of([[-2.0], [3.0]]), POSITION)
        tolerance = 0.02 if spread else 0.3  # without spread the two weaken a doubtful measurement differently
        np.testing.assert_allclose(particle.x, kalman.x, atol=tolerance)
        np.testing.assert_allclose(particle.P, kalman.P, atol=tolerance * 3)
        assert particle.hits.tolist() == [2, 1]


def test_several_measurements_taken_as_one_are_their_mean():
    decision = Decision(np.zeros(1, np.int64), np.zeros(2, np.int64), np.arange(2), np.array([0.4, 0.6]),
                        np.zeros(1), spread=False)  # fmt: skip
    together, alone = (bank_of(ParticleBank, number=1000, resampling=Resampling.NONE) for _ in range(2))
    together.update(decision, scan_of([[-2.0], [3.0]]), POSITION)
    alone.update(one_to_one(1), scan_of([[1.0]]), POSITION)
    np.testing.assert_allclose(together.log_weight, alone.log_weight, rtol=1e-9)


def test_successors_of_one_row_part_ways():
    bank = bank_of(ParticleBank, number=3000)
    branches = Decision(np.zeros(2, np.int64), np.arange(2), np.arange(2), np.ones(2), np.zeros(2))
    bank.update(branches, scan_of([[-2.0], [3.0]]), POSITION)
    np.testing.assert_allclose(bank.x[:, 0], [-1.6, 2.4], atol=0.15)
    assert len(bank) == 2
    bank.predict(1.0)
    assert len(np.intersect1d(bank.particles[0, :, 1], bank.particles[1, :, 1])) == 0


@pytest.mark.parametrize("off", [5.0, 12.0, -30.0])
@pytest.mark.parametrize("kind", SCHEMES)
def test_a_measurement_in_the_tail_gives_the_estimates_of_kalman(kind, off):
    """Up to thirteen standard deviations from all particles; bootstrap filters keep a single one, without errors."""
    particle, kalman = (bank_of(bank, 12, **options) for bank, options in (
        (ParticleBank, {"number": 2000, "resampling": kind}), (KalmanBank, {})
    ))  # fmt: skip
    for bank in (particle, kalman):
        bank.predict(1.0)
        bank.update(one_to_one(12), scan_of(np.full((12, 1), off), sigma=0.5), POSITION)
    sigma = np.sqrt(np.diagonal(kalman.P[0]))
    np.testing.assert_allclose(particle.x.mean(axis=0) / sigma, kalman.x[0] / sigma, atol=0.05 * abs(off))
    np.testing.assert_allclose(particle.P.mean(axis=0), kalman.P[0], rtol=0.25, atol=0.05)
    lost = bank_of(ParticleBank, number=2000, resampling=kind, least=0)
    lost.predict(1.0)
    lost.update(one_to_one(1), scan_of([abs(off) + 7], sigma=0.5), POSITION)
    assert lost.P[0, 0, 0] < 0.25 * kalman.P[0, 0, 0]


def test_measurements_in_the_tail_mix_by_their_weights():
    """One of a PDA's measurements is far off: the mixture of both, and of a miss, has the moments of Kalman's."""
    decision = Decision(np.arange(2), np.array([0, 0, 1]), np.array([0, 1, 1]), np.array([0.3, 0.5, 0.4]),
                        np.array([0.2, 0.6]))  # fmt: skip
    particles, kalman = (
        [bank_of(ParticleBank, 2, number=20_000, seed=seed) for seed in range(16)],
        bank_of(KalmanBank, 2),
    )
    for bank in (*particles, kalman):
        bank.update(decision, scan_of([[-1.0], [9.0]], sigma=0.3), POSITION)
    np.testing.assert_allclose(np.mean([bank.x for bank in particles], axis=0), kalman.x, atol=0.15)
    np.testing.assert_allclose(np.mean([bank.P for bank in particles], axis=0), kalman.P, rtol=0.06, atol=0.15)
    for bank in particles:
        np.testing.assert_allclose(np.exp(bank.log_weight), 1 / 20_000)


def test_a_miss_beside_a_measurement_in_the_tail_keeps_both_modes():
    """Half of the particles are at -20 and half at 20, a plot at 60 has .4: .6 of the weight stays near the modes."""
    bank = bank_of(ParticleBank, number=10_000)
    bank.particles[0, :5000, 0] -= 20
    bank.particles[0, 5000:, 0] += 20
    decision = Decision(
        np.zeros(1, np.int64), np.zeros(1, np.int64), np.zeros(1, np.int64), np.array([0.4]), np.array([0.6])
    )
    bank.update(decision, scan_of([60.0]), POSITION)
    x, weight = bank.particles[0, :, 0], np.exp(bank.log_weight[0])
    assert weight[np.abs(x + 20) < 10].sum() == pytest.approx(0.3, abs=0.01)
    assert weight[np.abs(x - 20) < 10].sum() == pytest.approx(0.3, abs=0.01)
    assert weight[np.abs(x) < 10].sum() == 0


def test_measurements_in_the_tail_that_act_as_one_are_their_mean():
    decision = Decision(np.zeros(1, np.int64), np.zeros(2, np.int64), np.arange(2), np.array([0.4, 0.6]),
                        np.zeros(1), spread=False)  # fmt: skip
    together, alone = (bank_of(ParticleBank, number=5000) for _ in range(2))
    together.update(decision, scan_of([[8.0], [13.0]]), POSITION)
    alone.update(one_to_one(1), scan_of([[11.0]]), POSITION)
    np.testing.assert_allclose(together.x, alone.x, atol=1e-6)


def test_a_target_that_turns_is_followed_with_true_errors():
    """The mean NEES of 60 turns, which 2 is right for, is below 4."""
    rng = np.random.default_rng(6)
    rows, turn_s = 60, np.arange(1, 4)
    bank = ParticleBank(ConstantVelocity(2, accel=8.0), seed=2)
    bank.insert(
        np.tile([0.0, 200.0, 0.0, 0.0], (rows, 1)), np.tile(np.diag([25.0, 4, 25, 4]), (rows, 1, 1)), np.ones(rows)
    )
    rate = 20.0 / 200.0
    for t in turn_s:
        place = 2000 * np.array([np.sin(rate * t), 1 - np.cos(rate * t)])
        bank.predict(1.0)
        z = place + 5 * rng.standard_normal((rows, 2))
        bank.update(one_to_one(rows), Scan(float(t), z, 25 * np.eye(2)), POSITION)
    off = bank.x[:, [0, 2]] - place
    P = bank.P[:, [0, 2]][:, :, [0, 2]]
    nees = np.einsum("ni,ni->n", off, np.linalg.solve(P, off[..., None])[..., 0]).mean()
    assert nees < 4


@pytest.mark.parametrize("bank", [
    bank_of(ParticleBank, number=100), bank_of(ParticleBank, number=100, resampling=Resampling.NONE),
    bank_of(ParticleBank, number=100, glint=Glint(0.1)), bank_of(ErrorSignalBank, number=100),
])  # fmt: skip
@pytest.mark.parametrize("z", [1e5, -1e150, 1e300])
def test_a_measurement_that_no_particle_explains_leaves_finite_weights(bank, z):
    for _ in range(3):
        bank.predict(1.0)
        bank.update(one_to_one(1), scan_of([z], sigma=1e-3), POSITION)
        assert np.isfinite(bank.x).all()
        assert np.exp(bank.log_weight[0]).sum() == pytest.approx(1.0)
        assert not np.isnan(bank.log_weight).any()


def test_weights_survive_a_thousand_scans_without_resampling():
    bank = bank_of(ParticleBank, number=50, resampling=Resampling.NONE)
    for _ in range(1000):
        bank.predict(0.1)
        bank.update(one_to_one(1), scan_of([0.0], sigma=0.1), POSITION)
    assert np.exp(bank.log_weight[0]).sum() == pytest.approx(1.0)
    assert (np.linalg.eigvalsh(bank.P[0]) >= 0).all()


def test_glint_makes_an_outlier_harmless():
    """The posterior's mean against the integral on a fine grid."""
    x = np.linspace(-12, 12, 200_001)
    narrow, wide = (np.exp(-0.5 * ((9.0 - x) / s) ** 2) / s for s in (1.0, 5.0))
    law = np.exp(-0.5 * x**2 / 4) * (0.9 * narrow + 0.1 * wide)
    bank = bank_of(ParticleBank, number=200_000, glint=Glint(0.1))
    bank.update(one_to_one(1), scan_of([9.0]), POSITION)
    assert bank.x[0, 0] == pytest.approx((law * x).sum() / law.sum(), abs=0.03)
    assert bank.x[0, 0] < 2
    assert bank_of(KalmanBank).x[0, 0] + 9.0 * 4 / 5 > 7


# --- sensors and motion


@pytest.mark.parametrize("kind", [ParticleBank, ErrorSignalBank])
@pytest.mark.parametrize("off", [-1e-3, 1e-3])
def test_azimuth_is_followed_across_south(kind, off):
    """A target due south, where azimuth jumps from pi to -pi, measured on either side of the jump."""
    bank = bank_of(kind, x=(0.1, 0, -1000, 0), P=np.diag([25.0, 1, 25, 1]), model=ConstantVelocity(2), number=4000)
    sensor = RangeAzimuth()
    zhat, cov = bank.predicted_measurement(sensor)
    assert abs(abs(zhat[0, 1]) - np.pi) < 1e-3
    assert np.sqrt(cov[0, 1, 1]) == pytest.approx(5e-3, rel=0.1)
    z = np.array([[1000.0, off - np.sign(off) * np.pi]])
    bank.update(one_to_one(1), Scan(0.0, z, np.diag([1.0, 1e-4]), sensor=sensor), sensor)
    assert np.linalg.norm(bank.x[0, [0, 2]] - [0.0, -1000.0]) < 3
    assert np.linalg.eigvalsh(bank.P[0]).min() > 0


@pytest.mark.parametrize("model", [ConstantVelocity(2, accel=1.0, hold_s=1.0), CoordinatedTurn(2, accel=1.0)])
def test_ahead_changes_nothing_and_says_what_predict_does(model):
    bank = ParticleBank(model, 20_000)
    bank.append(np.array([[100.0, 200.0]]), 25 * np.eye(2)[None], np.ones(1))
    before = bank.particles.copy()
    x, P = bank.ahead(2.0)
    np.testing.assert_array_equal(bank.particles, before)
    bank.predict(2.0)
    sigma = np.sqrt(np.diag(P[0]))
    np.testing.assert_allclose(bank.x[0], x[0], atol=0.05 * sigma.max())
    np.testing.assert_allclose(np.sqrt(np.diag(bank.P[0])), sigma, rtol=0.03)
    assert bank.cross(2.0).shape == bank.P.shape


@pytest.mark.parametrize("kind", [ParticleBank, ErrorSignalBank])
def test_the_seed_decides_and_threads_do_not(kind, monkeypatch):
    def run(seed, part):
        monkeypatch.setattr("vidtrack.estimate.particle.BLOCK", part)
        bank = bank_of(kind, 10, number=300, seed=seed)
        for k in range(5):
            bank.predict(0.5)
            bank.update(one_to_one(10), scan_of(np.full((10, 1), 0.1 * k)), POSITION)
        return bank.particles

    whole = run(1, 10**9)
    np.testing.assert_array_equal(whole, run(1, 1))
    assert not np.array_equal(whole, run(2, 1))


def test_rows_come_and_go():
    bank = bank_of(ParticleBank, 3, number=10)
    bank.append(np.array([[50.0]]), np.eye(1)[None], np.ones(1))
    bank.keep(np.array([3, 0]))
    assert bank.x[:, 0].tolist() == [50.0, 0.0]
    assert bank.particles.shape == (2, 10, 2)
    bank.predict(0.0)
    assert abs(bank.x[0, 0] - 50) < 3


# --- table 1


def test_uniform_bins_know_only_the_measurement():
    """2,000 particles on 20 km are 10 m apart: the mean error is larger than the measurement's own (SPEC 003: 5.97)."""
    rng = np.random.default_rng(4)
    bank = UniformBinsBank(ConstantVelocity(1), [RANGE_M])
    bank.append(np.full((400, 1), 60e3), np.full((400, 1, 1), 25.0), np.ones(400))
    z = 60e3 + 5 * rng.standard_normal((400, 1))
    bank.update(one_to_one(400), scan_of(z, sigma=5.0), POSITION)
    assert np.abs(bank.x[:, 0] - 60e3).mean() == pytest.approx(5.97, abs=0.9)
    assert (np.linalg.eigvalsh(bank.P) > 0).all()
    bank.update(Decision(np.arange(400), NOBODY, NOBODY, np.empty(0), np.ones(400)), scan_of(z), POSITION)
    assert np.abs(bank.x[:, 0] - 60e3).mean() == pytest.approx(5.97, abs=0.9)


def test_uniform_bins_count_azimuth_from_north_all_around():
    sensor = RangeAzimuth()
    bank = UniformBinsBank(ConstantVelocity(2), [RANGE_M, np.radians([0, 90, 180, 270, 360])], number=20_000)
    bank.append(np.array([[-20e3, 1.0]]), np.eye(2)[None], np.ones(1))
    z = np.array([[20e3, -np.pi / 2 - 0.1]])
    bank.update(one_to_one(1), Scan(0.0, z, np.diag([100.0**2, 0.01**2]), sensor=sensor), sensor)
    np.testing.assert_allclose(bank.x[0, [0, 2]], 20e3 * np.array([-np.cos(0.1), -np.sin(0.1)]), atol=60)


# --- misuse


def test_impossible_settings_are_refused():
    with pytest.raises(ConfigError, match="1 particles"):
        ParticleBank(MODEL, 1)
    with pytest.raises(ConfigError, match=r"least is 1\.5"):
        ParticleBank(MODEL, least=1.5)
    with pytest.raises(ConfigError, match="factor"):
        ParticleBank(MODEL, glint=Glint(0.1, 0.5))
    with pytest.raises(ConfigError, match="alpha is 0"):
        ErrorSignalBank(MODEL, alpha=0.0)
    with pytest.raises(ConfigError, match="ascending"):
        UniformBinsBank(MODEL, [(3.0, 1.0)])
