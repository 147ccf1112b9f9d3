"""How uncertainty grows: by time alone, round while the heading is unknown, stretched along it after."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.decision import Decision
from vidtrack.errors import ConfigError
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.estimate.sensor import POSITION
from vidtrack.scan import Scan

KNOWN, UNKNOWN = np.array([True]), np.array([False])
ONE = np.ones(1)


def noise(model, dt, velocity=(3.0, 4.0), settled=KNOWN, scale=ONE):
    """Q (n, n) of one row that moves at `velocity`."""
    x = np.zeros((1, 4))
    x[0, [1, 3]] = velocity
    hits = np.where(settled, 100, 0)
    return model.process_noise(dt, x, np.zeros((1, 4, 4)), hits, scale)[0]


@given(dt=st.floats(1e-3, 10.0), angle=st.floats(-np.pi, np.pi))
def test_noise_of_two_steps_is_that_of_one_long_step(dt, angle):
    """The same scene at 10 and at 30 frames/s must be equally uncertain: Q(2 dt) = F Q F' + Q."""
    model = ConstantVelocity(accel=2.0, cross=0.7, hold_s=0.5)
    heading = 5 * np.array([np.cos(angle), np.sin(angle)])
    F, Q = model.transition(dt, np.zeros((1, 4)))[0], noise(model, dt, heading)
    np.testing.assert_allclose(F @ Q @ F.T + Q, noise(model, 2 * dt, heading), rtol=1e-9, atol=1e-12 * dt)


def test_noise_of_the_papers_model_is_that_of_a_constant_acceleration():
    dt = 0.4
    G = np.array([[dt**2 / 2], [dt]])
    Q = noise(ConstantVelocity(accel=1.5), dt)
    np.testing.assert_allclose(Q, np.kron(np.eye(2), 1.5**2 * G @ G.T), rtol=1e-12)


@pytest.mark.parametrize("hold_s", [None, 0.5])
@given(angle=st.floats(-np.pi, np.pi))
def test_noise_is_stretched_along_the_heading(hold_s, angle):
    u, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    Q = noise(ConstantVelocity(accel=2.0, cross=0.5, hold_s=hold_s), 0.1, 7 * u)
    for block in (Q[0::2, 0::2], Q[1::2, 1::2]):  # of positions, of velocities
        assert u @ block @ u == pytest.approx(16 * (across @ block @ across), rel=1e-9)
        assert u @ block @ across == pytest.approx(0.0, abs=1e-9 * np.abs(block).max())
        direction = np.linalg.eigh(block)[1][:, 1]
        assert abs(direction @ u) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("velocity", [(3.0, 4.0), (0.0, 1.0), (0.0, 0.0)])
def test_noise_without_a_cross_value_is_round(velocity):
    Q = noise(ConstantVelocity(accel=2.0), 1.0, velocity, UNKNOWN)
    np.testing.assert_allclose(Q[1::2, 1::2], 4.0 * np.eye(2), rtol=1e-12)
    np.testing.assert_allclose(Q[0::2, 0::2], np.eye(2), rtol=1e-12)


def test_noise_grows_with_the_size_of_the_object():
    model = ConstantVelocity(accel=2.0, cross=0.7, per_size=True)
    np.testing.assert_allclose(noise(model, 1.0, scale=np.array([30.0])), 900 * noise(model, 1.0), rtol=1e-12)


def follow(model, velocity, updates, sigma=0.1):
    """The bank after `updates` exact measurements of one straight mover."""
    bank = KalmanBank(model)
    bank.append(np.zeros((1, 2)), sigma**2 * np.eye(2)[None], ONE)
    hit = Decision(np.zeros(1, int), np.zeros(1, int), np.zeros(1, int), ONE, np.zeros(1))
    for k in range(1, updates + 1):
        bank.predict(0.1)
        bank.update(hit, Scan(0.0, 0.1 * k * np.array([velocity]), sigma**2 * np.eye(2)), POSITION)
    return bank


def stretched(bank):
    """Whether the bank's next prediction trusts the heading."""
    _, P = bank.ahead(0.1)
    F = bank.model.transition(0.1, bank.x)[0]
    Q = P[0] - F @ bank.P[0] @ F.T
    return Q[1, 1] > 1.5 * Q[3, 3]


def test_heading_shapes_the_noise_only_after_the_warm_up():
    model = ConstantVelocity(accel=2.0, cross=0.5, warmup=6)
    shapes = [stretched(follow(model, (50.0, 0.0), updates)) for updates in range(1, 10)]
    assert shapes == [False] * 5 + [True] * 4  # the birth is the first of the six


def test_heading_of_a_standing_object_is_never_believed():
    model = ConstantVelocity(accel=2.0, cross=0.5)
    bank = follow(model, (0.0, 0.0), 30)
    assert not stretched(bank)
    assert np.isfinite(bank.ahead(0.1)[1]).all()


def test_second_measurement_gives_the_two_point_estimate():
    """Bar-Shalom and Fortmann: x = [z1, (z1 - z0)/T] when nothing was known of the velocity."""
    bank = KalmanBank(ConstantVelocity(dim=1, accel=1e-6, speed=1e6))
    bank.append(np.array([[3.0]]), np.array([[[4.0]]]), ONE)
    bank.predict(0.5)
    hit = Decision(np.zeros(1, int), np.zeros(1, int), np.zeros(1, int), ONE, np.zeros(1))
    bank.update(hit, Scan(0.0, np.array([[5.0]]), np.array([[4.0]])), POSITION)
    np.testing.assert_allclose(bank.x[0], [5.0, 4.0], rtol=1e-6)
    np.testing.assert_allclose(bank.P[0], [[4.0, 8.0], [8.0, 32.0]], rtol=1e-6)


@pytest.mark.parametrize(
    "bad", [{"dim": 4}, {"accel": 0.0}, {"accel": np.nan}, {"cross": -1.0}, {"speed": np.inf}, {"hold_s": 0.0}]
)
def test_a_model_that_makes_no_sense_is_refused(bad):
    name, value = next(iter(bad.items()))
    with pytest.raises(ConfigError, match=f"{name} is {value}"):
        ConstantVelocity(**bad)
