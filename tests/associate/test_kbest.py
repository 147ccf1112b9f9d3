"""The k best assignments against enumeration."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.associate.kbest import k_best

MANY = 10**9
"""Solutions; more than any search here needs."""


def enumerated(offset, held, start, column, cost, alone):
    """Cost of every assignment of every problem, as {(problem, choices): cost}."""
    rows, alternatives = alone.shape
    found = {}
    for h in range(len(offset)):
        options = [
            [k for k in range(start[i], start[i + 1]) if held[h, column[k]]] + [-1 - a for a in range(alternatives)]
            for i in range(rows)
        ]
        for choice in product(*options):
            columns = [column[k] for k in choice if k >= 0]
            if len(set(columns)) == len(columns) and all(
                k >= 0 or alone[i, -1 - k] < np.inf for i, k in enumerate(choice)
            ):
                costs = [cost[k] if k >= 0 else alone[i, -1 - k] for i, k in enumerate(choice)]
                found[h, choice] = offset[h] + sum(costs)
    return found


def random_problems(rng, problems, rows, columns, ties):
    draw = (lambda *shape: rng.integers(0, 4, shape).astype(float)) if ties else (lambda *shape: rng.normal(size=shape))
    allowed = rng.random((rows, columns)) < 0.7
    row, column = np.argwhere(allowed).T.copy()
    start = np.searchsorted(row, np.arange(rows + 1))
    alone = draw(rows, 2)
    alone[rng.random((rows, 2)) < 0.3] = np.inf
    return draw(problems), rng.random((problems, columns)) < 0.8, start, column, draw(len(row)), alone


@given(
    seed=st.integers(0, 2**32 - 1),
    problems=st.integers(1, 3),
    rows=st.integers(0, 4),
    columns=st.integers(0, 4),
    most=st.sampled_from([1, 5, 10_000]),
    ties=st.booleans(),
)
@settings(max_examples=100, deadline=None)
def test_best_assignments_are_those_of_an_enumeration(seed, problems, rows, columns, most, ties):
    given_problems = random_problems(np.random.default_rng(seed), problems, rows, columns, ties)
    every = enumerated(*given_problems)
    problem, choice, cost = k_best(*given_problems, most, np.inf, MANY)
    expected = np.sort(list(every.values()))[:most]
    np.testing.assert_allclose(cost, expected, rtol=1e-12, atol=1e-12)
    ours = {(h, tuple(c)): w for h, c, w in zip(problem.tolist(), choice.tolist(), cost, strict=True)}
    assert len(ours) == len(cost), "an assignment came twice"
    for key, value in ours.items():
        assert every[key] == pytest.approx(value, abs=1e-12)


def test_what_costs_much_more_than_the_best_is_left_out():
    given_problems = random_problems(np.random.default_rng(5), 3, 4, 4, False)
    every = np.sort(list(enumerated(*given_problems).values()))
    cost = k_best(*given_problems, 10_000, 1.5, MANY)[2]
    np.testing.assert_allclose(cost, every[every <= every[0] + 1.5])


def test_impossible_choices_are_never_made():
    """A column that nobody holds is nobody's, whatever it offers."""
    problem, choice, cost = k_best(
        np.zeros(1), np.array([[False]]), np.array([0, 1]), np.array([0]), np.array([-50.0]), np.array([[1.0, 2.0]]),
        10, np.inf, MANY,
    )  # fmt: skip
    np.testing.assert_array_equal(choice, [[-1], [-2]])
    np.testing.assert_allclose(cost, [1.0, 2.0])
    np.testing.assert_array_equal(problem, [0, 0])


def test_the_work_is_bounded_though_all_assignments_cost_the_same():
    count = 30
    start, column = np.arange(0, count * count + 1, count), np.tile(np.arange(count), count)
    cost, alone = np.zeros(count * count), np.full((count, 2), np.inf)
    found = k_best(np.zeros(1), np.ones((1, count), bool), start, column, cost, alone, 100_000, np.inf, 50)
    assert 1 <= len(found[2]) <= 50, "each that is found has been solved"
    none = k_best(np.zeros(1), np.ones((1, count), bool), start, column, cost, alone, 100_000, np.inf, 0)
    np.testing.assert_array_equal(none[2], [0.0], "the cheapest is always found")
