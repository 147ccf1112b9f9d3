"""Covariance intersection: never too small, whatever the correlation."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.estimate.intersection import intersection


def covariance(rng, count, n=4):
    A = rng.normal(size=(count, n, n))
    return A @ A.transpose(0, 2, 1) + 0.1 * np.eye(n)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_fused_covariance_is_never_below_the_true_one(seed):
    rng = np.random.default_rng(seed)
    joint = covariance(rng, 1, 8)[0]  # of both errors, with any correlation
    P1, P2 = joint[None, :4, :4], joint[None, 4:, 4:]
    zero, unit = np.zeros((1, 4)), np.eye(4)
    _, P = intersection(zero, P1, zero, P2)
    gain = np.stack([intersection(e[None], P1, zero, P2)[0][0] for e in unit], axis=1)
    both = np.hstack([gain, unit - gain])
    assert np.linalg.eigvalsh(P[0] - both @ joint @ both.T).min() > -1e-9 * np.trace(P[0])


def test_no_other_weight_has_a_smaller_determinant():
    rng = np.random.default_rng(4)
    P1, P2 = covariance(rng, 50), covariance(rng, 50)
    zero = np.zeros((50, 4))
    _, P = intersection(zero, P1, zero, P2)
    weights = np.linspace(0, 1, 201)[:, None, None, None]
    each = np.linalg.det(np.linalg.inv(weights * np.linalg.inv(P1) + (1 - weights) * np.linalg.inv(P2))).min(axis=0)
    assert (np.linalg.det(P) <= each * (1 + 1e-9)).all()


def test_the_same_estimate_twice_is_no_more_than_once():
    rng = np.random.default_rng(0)
    P, x = covariance(rng, 3), rng.normal(size=(3, 4))
    found, cov = intersection(x, P, x, P)
    np.testing.assert_allclose(found, x)
    np.testing.assert_allclose(cov, P)
