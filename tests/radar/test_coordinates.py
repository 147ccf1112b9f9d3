"""Polar and Cartesian coordinates, and the unbiased conversion between them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.radar.coordinates import to_cartesian, to_polar, unbiased, wrap


def test_azimuth_is_clockwise_from_north_and_z_is_up():
    polar = np.array([[100.0, 0.0, 0.0], [100.0, np.pi / 2, 0.0], [100.0, np.pi, 0.0], [100.0, 0.3, np.pi / 2]])
    expected = [[0, 100, 0], [100, 0, 0], [0, -100, 0], [0, 0, 100]]
    assert to_cartesian(polar) == pytest.approx(np.array(expected, float), abs=1e-12)
    assert to_cartesian(polar[:3, :2]) == pytest.approx(np.array(expected, float)[:3, :2], abs=1e-12)


@settings(deadline=None)
@given(st.floats(1, 1e6), st.floats(-3.141, 3.141), st.floats(-1.5, 1.5))
def test_there_and_back(r, azimuth, elevation):
    polar = np.array([[r, azimuth, elevation]])
    assert to_polar(to_cartesian(polar)) == pytest.approx(polar, rel=1e-9, abs=1e-9)
    assert to_polar(to_cartesian(polar[:, :2])) == pytest.approx(polar[:, :2], rel=1e-9, abs=1e-9)


@settings(deadline=None)
@given(st.floats(-1000, 1000))
def test_a_wrapped_angle_is_the_same_direction(angle):
    wrapped = wrap(np.array([angle]))
    assert abs(wrapped[0]) <= np.pi + 1e-9
    assert np.exp(1j * wrapped) == pytest.approx(np.exp(1j * angle), abs=1e-9)


def converted(dim, sigma_angle):
    """Errors (N, dim) of converted measurements of one target, their covariances, and the plain conversion's errors."""
    rng = np.random.default_rng(1)
    true = np.array([[50_000.0, 0.7, 0.4]])[:, :dim]
    sigma = np.array([30.0, sigma_angle, sigma_angle])[:dim]
    z = true + sigma * rng.standard_normal((200_000, dim))
    position, cov = unbiased(z, np.broadcast_to(np.diag(sigma**2), (len(z), dim, dim)))
    return position - to_cartesian(true), cov, to_cartesian(z) - to_cartesian(true)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_conversion_is_unbiased_where_the_plain_one_is_not(dim):
    error, cov, plain = converted(dim, sigma_angle=0.15)
    standard_error = error.std(axis=0) / np.sqrt(len(error))
    assert (np.abs(error.mean(axis=0)) < 4 * standard_error).all()
    assert np.abs(plain.mean(axis=0) / standard_error).max() > 20
    assert (np.linalg.eigvalsh(cov[:1000]) > 0).all()


@pytest.mark.parametrize("dim", [2, 3])
def test_the_conversion_knows_its_error(dim):
    error, cov, _ = converted(dim, sigma_angle=0.03)
    nees = np.einsum("ni,ni->n", error, np.linalg.solve(cov, error[..., None])[..., 0])
    assert nees.mean() == pytest.approx(dim, rel=0.01)


@pytest.mark.parametrize("dim", [2, 3])
def test_with_small_errors_the_covariance_is_the_linearised_one(dim):
    z = np.array([[20_000.0, -2.0, 0.3]])[:, :dim]
    sigma = np.array([10.0, 1e-3, 2e-3])[:dim]
    step = 1e-4 * sigma
    J = np.stack(
        [
            (to_cartesian(z + step * e) - to_cartesian(z - step * e))[0] / (2 * s)
            for e, s in zip(np.eye(dim), step, strict=True)
        ],
        axis=1,
    )
    _, cov = unbiased(z, np.diag(sigma**2)[None])
    assert cov[0] == pytest.approx(J @ np.diag(sigma**2) @ J.T, rel=1e-3, abs=1e-2)
