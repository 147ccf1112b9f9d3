"""The solver of bordered bands beside numpy's, which knows no bands."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.traffic.vehicles.band import (
    BAND,
    SIZE,
    eliminate,
    factor,
    invert,
    move_path,
    product,
    solve_back,
    solve_one,
)


def bordered(knots, seed):
    """A positive definite matrix (2 K + SIZE) of a band and its border, a right side, and the band as it is kept."""
    rng, n = np.random.default_rng(seed), 2 * knots
    lower = np.tril(np.triu(rng.normal(scale=0.3, size=(n, n)), -BAND))
    lower[np.diag_indices(n)] = rng.uniform(1, 2, n)
    border = np.hstack([rng.normal(size=(SIZE, n)), np.tril(rng.normal(size=(SIZE, SIZE))) + 3 * np.eye(SIZE)])
    factors = np.vstack([np.hstack([lower, np.zeros((n, SIZE))]), border])
    whole = factors @ factors.T
    band = np.zeros((n, BAND + 1))
    for i in range(n):
        for d in range(min(i, BAND) + 1):
            band[i, d] = whole[i, i - d]
    return whole, rng.normal(size=n + SIZE), band


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 12), st.integers(0, 1000))
def test_a_bordered_band_is_solved_as_a_full_matrix_is(knots, seed):
    matrix, wanted, band = bordered(knots, seed)
    n = 2 * knots
    path_alone, coupling = matrix[:n, :n].copy(), matrix[:n, n:].copy()
    right = np.column_stack([coupling, wanted[:n]])
    whole, rest, inverse = matrix[n:, n:].copy(), wanted[n:].copy(), np.empty((SIZE, SIZE))
    factor(band, right)
    eliminate(right, whole, rest)
    invert(whole, inverse)
    step, path = product(inverse, rest), np.zeros((knots, 2))
    most = move_path(band, right, step, path)

    def close(found, expected):
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())

    solution = np.linalg.solve(matrix, wanted)
    close(np.append(path, step), solution)
    close(most, np.abs(solution[:n]).max())
    close(inverse, np.linalg.inv(matrix)[n:, n:])
    solve_back(band, right)
    close(right[:, :SIZE], np.linalg.solve(path_alone, coupling))
    one = wanted[:n].copy()
    solve_one(band, one)
    close(one, np.linalg.solve(path_alone, wanted[:n]))
