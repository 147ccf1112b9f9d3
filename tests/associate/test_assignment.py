"""The sparse assignment against SciPy's dense one, and the rules built on it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from vidtrack.associate.assignment import assign
from vidtrack.associate.gate import Pairs
from vidtrack.associate.hard import GNN, NN, GreedyGNN
from vidtrack.associate.problem import Problem
from vidtrack.scan import Scan

FORBIDDEN = 1e6


def sparse(cost, allowed):
    """Row starts, columns and costs of the allowed entries of a matrix."""
    row, column = np.argwhere(allowed).T.copy()
    return np.searchsorted(row, np.arange(len(cost) + 1)), column, cost[row, column]


def total(taken, cost, miss):
    return sum(miss[t] if j < 0 else cost[t, j] for t, j in enumerate(taken))


@given(
    seed=st.integers(0, 2**32 - 1),
    rows=st.integers(0, 12),
    columns=st.integers(0, 12),
    density=st.sampled_from([0.0, 0.2, 0.6, 1.0]),
    ties=st.booleans(),
    cheap_miss=st.booleans(),
)
@settings(max_examples=300, deadline=None)
def test_total_cost_is_that_of_the_hungarian_algorithm(seed, rows, columns, density, ties, cheap_miss):
    rng = np.random.default_rng(seed)
    draw = rng.integers(-3, 4, (rows, columns)) if ties else 10 * rng.normal(size=(rows, columns))
    cost = draw.astype(float)
    allowed = rng.random((rows, columns)) < density
    miss = (rng.integers(-2, 3, rows) if ties else rng.normal(size=rows)) + (0.0 if cheap_miss else 40.0)
    taken = assign(*sparse(cost, allowed), miss, columns)

    real = taken[taken >= 0]
    assert len(set(real.tolist())) == len(real), "a column served two rows"
    assert all(allowed[t, j] for t, j in enumerate(taken) if j >= 0), "a pair that was not offered"
    dense = np.full((rows, columns + rows), FORBIDDEN)
    dense[:, :columns][allowed] = cost[allowed]
    dense[np.arange(rows), columns + np.arange(rows)] = miss
    assert total(taken, cost, miss) == pytest.approx(dense[linear_sum_assignment(dense)].sum(), abs=1e-9)


def test_a_thousand_rows_that_all_want_the_same_columns():
    rng = np.random.default_rng(0)
    cost = rng.random((1000, 10))
    taken = assign(*sparse(cost, np.ones(cost.shape, bool)), np.full(1000, 5.0), 10)
    assert sorted(taken[taken >= 0]) == list(range(10))
    row, column = linear_sum_assignment(cost)
    assert total(taken, cost, np.full(1000, 5.0)) == pytest.approx(cost[row, column].sum() + 990 * 5.0)


def pairs(d2, limit, log_s=0.0):
    """Gated pairs of a matrix d2 (T, M); NaN is outside the gate."""
    d2 = np.asarray(d2, float)
    row, measurement = np.argwhere(d2 <= limit).T.copy()
    start = np.searchsorted(row, np.arange(len(d2) + 1))
    spread = np.broadcast_to(log_s, d2.shape)[row, measurement]
    return Pairs(
        row,
        measurement,
        d2[row, measurement],
        d2[row, measurement],
        spread.astype(float),
        -0.5 * (d2[row, measurement] + spread + 2 * np.log(2 * np.pi)),
        d2[row, measurement] + spread,
        np.full(len(d2), limit),
        start,
    )


def taken(rule, pairs, measurements):
    rows = len(pairs.limit)
    scan = Scan(0.0, np.zeros((measurements, 2)), np.eye(2))
    decision = rule.decide(
        Problem(pairs, scan, np.zeros((rows, 2, 2)), np.full(rows, 0.9), np.full(rows, 1e-5), np.full(rows, 0.99))
    )
    result = np.full(len(pairs.limit), -1)
    result[decision.row] = decision.measurement
    np.testing.assert_array_equal(decision.beta0, result < 0)
    return result.tolist()


def test_optimum_beats_greed():
    """SPEC 001, `greedy_vs_optimal`: the cheapest pair first costs 10.0, the best pairs together 3.5."""
    d2 = np.array([[1.0, 2.0], [1.5, 9.0]])
    found = taken(GNN(), pairs(d2, 9.21), 2)
    assert found == [1, 0]
    assert d2[[0, 1], found].sum() == 3.5


def test_a_good_pair_and_a_miss_beat_two_bad_pairs():
    """SPEC 001, `gnn_nonassignment`: a miss costs the gate, 1.0 + 9.21 = 10.21 < 9.1 + 1.2 = 10.3."""
    assert taken(GNN(), pairs([[1.0, 9.1], [1.2, np.nan]], 9.21), 2) == [0, -1]


def test_maximum_cardinality_serves_as_many_tracks_as_possible():
    """The other convention of `gnn_nonassignment`: 9.1 + 1.2 = 10.3, but nobody misses."""
    assert taken(GNN("maximum-cardinality"), pairs([[1.0, 9.1], [1.2, np.nan]], 9.21), 2) == [1, 0]


def test_greedy_rules_take_the_first_that_comes():
    """SPEC 001, `greedy_vs_optimal` and `fig2`; in track order the first track chooses before the nearer second."""
    assert taken(GreedyGNN(), pairs([[1.0, 2.0], [1.5, 9.0]], 9.21), 2) == [0, 1]
    d2 = [[3.25, 1.53, 4.16, 162.0], [21.25, 3.33, 1.16, 117.0]]
    assert taken(GreedyGNN(), pairs(d2, 9.21), 4) == [1, 2]
    late = [[2.0, 3.0], [1.0, 4.0]]
    assert taken(GreedyGNN("cost"), pairs(late, 9.21), 2) == [1, 0]
    assert taken(GreedyGNN("track"), pairs(late, 9.21), 2) == [0, 1]


def test_worked_example_of_the_survey():
    """SPEC 001, `fig2`: tracks 0 and 1 take measurements 1 and 2; 3 is outside every gate."""
    d2 = [[3.25, 1.53, 4.16, 162.0], [21.25, 3.33, 1.16, 117.0]]
    assert taken(NN(), pairs(d2, 9.21), 4) == [1, 2]
    assert taken(GNN(), pairs(d2, 9.21), 4) == [1, 2]


def test_nn_shares_a_measurement_and_gnn_does_not():
    d2 = [[1.0, 5.0], [0.5, 6.0]]
    assert taken(NN(), pairs(d2, 9.21), 2) == [0, 0]
    assert sorted(taken(GNN(), pairs(d2, 9.21), 2)) == [0, 1]


def test_uncertain_track_yields_to_the_certain_one():
    """Equal d2: the likelihood is that of the track with the smaller region, hence ln|S|."""
    log_s = np.array([[4.0], [0.0]])
    assert taken(GNN(), pairs([[2.0], [2.0]], 9.21, log_s), 1) == [-1, 0]


@pytest.mark.parametrize("rule", [NN(), GNN(), GNN("maximum-cardinality"), GreedyGNN(), GreedyGNN("track")])
def test_without_pairs_everybody_misses(rule):
    assert taken(rule, pairs(np.full((3, 2), np.nan), 9.21), 2) == [-1, -1, -1]
    assert taken(rule, pairs(np.empty((0, 2)), 9.21), 2) == []


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(1, 10), count=st.integers(1, 10))
@settings(max_examples=100, deadline=None)
def test_gnn_leaves_no_track_beside_a_measurement_that_nobody_took(seed, rows, count):
    """Every pair inside the gate beats a miss, whatever ln|S|."""
    rng = np.random.default_rng(seed)
    d2 = np.where(rng.random((rows, count)) < 0.4, 9.21 * rng.random((rows, count)), np.nan)
    gated = pairs(d2, 9.21, 3 * rng.normal(size=(rows, count)))
    found = np.array(taken(GNN(), gated, count))
    idle = ~np.isin(np.arange(count), found)
    assert not (np.isfinite(d2) & (found < 0)[:, None] & idle[None]).any()
