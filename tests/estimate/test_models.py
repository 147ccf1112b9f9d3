"""Motion models with an acceleration or a turn rate in the state."""

import numpy as np
import pytest
import scipy  # its parts are imported when they are asked for
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.errors import ConfigError
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.acceleration import ConstantAcceleration, Singer
from vidtrack.estimate.motion.turn import CoordinatedTurn

ONE = np.ones(1)


def noise(model, dt):
    """Q (n, n) of one row."""
    n = model.states
    return model.process_noise(dt, np.zeros((1, n)), np.zeros((1, n, n)), np.zeros(1, int), ONE)[0]


def transition(model, dt):
    return model.transition(dt, np.zeros((1, model.states)))[0]


def test_an_acceleration_moves_position_and_velocity():
    x = np.array([1.0, 2.0, 3.0, 4.0, 0.5, -1.0])  # x, vx, y, vy, ax, ay
    moved = transition(ConstantAcceleration(2), 2.0) @ x
    np.testing.assert_allclose(moved, [1 + 4 + 1, 3, 3 + 8 - 2, 2, 0.5, -1])


@pytest.mark.parametrize(
    "model",
    [ConstantAcceleration(3, change=2.0, hold_s=0.5), Singer(3, accel=2.0, hold_s=4.0)],
    ids=["constant acceleration", "singer"],
)
@given(dt=st.floats(1e-2, 5.0))
def test_noise_of_two_steps_is_that_of_one_long_step(model, dt):
    F, Q = transition(model, dt), noise(model, dt)
    np.testing.assert_allclose(F @ F, transition(model, 2 * dt), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(F @ Q @ F.T + Q, noise(model, 2 * dt), rtol=1e-7, atol=1e-12)


def test_singer_noise_is_the_integral_of_its_white_noise():
    model, dt = Singer(1, accel=3.0, hold_s=2.0), 1.7

    def contribution(s):
        F = transition(model, s)
        return F[:, 2:] @ F[:, 2:].T * 2 * 3.0**2 / 2.0

    np.testing.assert_allclose(noise(model, dt), scipy.integrate.quad_vec(contribution, 0, dt)[0], rtol=1e-9)


def test_singer_lies_between_constant_velocity_and_constant_acceleration():
    brief, lasting = transition(Singer(1, hold_s=1e-3), 1.0), transition(Singer(1, hold_s=1e6), 1.0)
    np.testing.assert_allclose(brief[:2, :2], [[1, 1], [0, 1]])
    assert abs(brief[:2, 2]).max() < 2e-3
    np.testing.assert_allclose(lasting, transition(ConstantAcceleration(1), 1.0), atol=1e-6)


@given(w=st.floats(-2, 2) | st.floats(-1e-5, 1e-5), vx=st.floats(-30, 30), vy=st.floats(-30, 30), dt=st.floats(0.01, 3))
def test_a_turn_keeps_the_speed_and_turns_the_heading(w, vx, vy, dt):
    x = np.array([[5.0, vx, -3.0, vy, w]])
    moved = transition_of(CoordinatedTurn(2), x, dt)
    turn = np.array([[np.cos(w * dt), -np.sin(w * dt)], [np.sin(w * dt), np.cos(w * dt)]])
    np.testing.assert_allclose(moved[[1, 3]], turn @ [vx, vy], atol=1e-9)
    if abs(w) > 1e-3:  # it stays on its circle
        centre = np.array([5.0, -3.0]) + np.array([-vy, vx]) / w
        assert np.linalg.norm(moved[[0, 2]] - centre) == pytest.approx(np.hypot(vx, vy) / abs(w), rel=1e-6, abs=1e-9)


def transition_of(model, x, dt):
    """F x of one row."""
    return model.transition(dt, x)[0] @ x[0]


@pytest.mark.parametrize("dim", [2, 3])
@given(seed=st.integers(0, 2**32 - 1), scale=st.sampled_from([1e-7, 1e-3, 1.0]))
def test_the_jacobian_of_a_turn_is_its_derivative(dim, seed, scale):
    rng = np.random.default_rng(seed)
    model = CoordinatedTurn(dim)
    x = rng.normal(0, 10, (1, model.states))
    x[0, -1] = scale * rng.normal()
    F = model.transition(0.7, x)
    J = model.jacobian(0.7, x, F)[0]
    step = 1e-5
    for column in range(model.states):
        e = np.zeros((1, model.states))
        e[0, column] = step
        slope = (transition_of(model, x + e, 0.7) - transition_of(model, x - e, 0.7)) / (2 * step)
        np.testing.assert_allclose(J[:, column], slope, atol=1e-5)


@pytest.mark.parametrize(
    "model",
    [ConstantAcceleration(3), Singer(3), CoordinatedTurn(3), CoordinatedTurn(2)],
    ids=lambda m: type(m).__name__,
)
def test_a_bank_of_any_model_stays_positive_definite(model):
    rng = np.random.default_rng(0)
    bank = KalmanBank(model)
    bank.append(rng.normal(size=(5, model.dim)), np.repeat(np.eye(model.dim)[None], 5, axis=0), np.ones(5))
    for dt in (0.0, 0.1, 5.0, 60.0):
        bank.predict(dt)
        assert np.linalg.eigvalsh(bank.P).min() > 0
        np.testing.assert_array_equal(bank.P, np.swapaxes(bank.P, 1, 2))


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: ConstantAcceleration(4), "dim"),
        (lambda: ConstantAcceleration(2, change=0.0), "change"),
        (lambda: Singer(2, hold_s=-1.0), "hold_s"),
        (lambda: Singer(2, accel=np.nan), "accel"),
        (lambda: CoordinatedTurn(1), "dim"),
        (lambda: CoordinatedTurn(2, turn=0.0), "turn"),
    ],
)
def test_a_model_that_cannot_be_is_refused_by_name(make, word):
    with pytest.raises(ConfigError, match=word):
        make()
