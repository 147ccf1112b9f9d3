"""JPDA, JPDA* and PDA against all joint events, listed one by one, and in their limits."""

import logging

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from problems import factors, joint_events, likeliest_only, marginals, random_problem, table

from vidtrack.associate.gate import Gate
from vidtrack.associate.jpda import JPDA
from vidtrack.associate.pda import PDA
from vidtrack.associate.problem import Problem
from vidtrack.scan import Scan

small = {"seed": st.integers(0, 2**32 - 1), "rows": st.integers(0, 5), "count": st.integers(0, 6)}
narrow_or_wide = st.sampled_from([0.5, 0.9, 0.9999])


@given(**small, gate=narrow_or_wide)
@settings(max_examples=150, deadline=None)
def test_jpda_is_the_sum_of_all_joint_events(seed, rows, count, gate):
    problem = random_problem(np.random.default_rng(seed), rows, count, gate=gate)
    expected = marginals(joint_events(factors(problem), problem.missed), rows, count)
    np.testing.assert_allclose(table(problem, JPDA().decide(problem)), expected, rtol=0, atol=1e-12)


@given(**small, gate=narrow_or_wide)
@settings(max_examples=100, deadline=None)
def test_jpda_star_is_the_sum_of_the_likeliest_permutations(seed, rows, count, gate):
    problem = random_problem(np.random.default_rng(seed), rows, count, gate=gate)
    events = likeliest_only(joint_events(factors(problem), problem.missed))
    expected = marginals(events, rows, count)
    np.testing.assert_allclose(table(problem, JPDA(star=True).decide(problem)), expected, rtol=0, atol=1e-12)


@given(**small)
@settings(max_examples=50, deadline=None)
def test_pda_is_jpda_of_each_track_by_itself(seed, rows, count):
    problem = random_problem(np.random.default_rng(seed), rows, count)
    factor = factors(problem)
    expected = np.ones((rows, 1 + count))
    for t in range(rows):
        expected[t] = marginals(joint_events(factor[t : t + 1], problem.missed[t : t + 1]), 1, count)
    np.testing.assert_allclose(table(problem, PDA().decide(problem)), expected, rtol=0, atol=1e-12)


def test_reference_of_two_tracks_and_three_measurements():
    """SPEC 001, `jpda_2x3`."""
    cov = np.array([[[2.0, 0.5], [0.5, 1.0]], [[1.5, -0.3], [-0.3, 1.2]]])
    R = 0.1 * np.eye(2)
    scan = Scan(0.0, [[0.6, 0.2], [1.3, 0.9], [3.4, 1.6]], R)
    problem = Problem.gated(Gate(0.99), np.array([[0.0, 0.0], [2.0, 1.0]]), cov - R, scan, 0.9, 0.1)
    expected = [
        [0.08900618454425352, 0.6505776427104959, 0.23298358869556085, 0.027432584049689464],
        [0.08722444225629597, 0.11709736911815688, 0.47914160836780273, 0.3165365802577442],
    ]
    np.testing.assert_allclose(table(problem, JPDA().decide(problem)), expected, rtol=0, atol=1e-9)


def test_tracks_with_separate_gates_get_the_weights_of_pda():
    """SPEC 001, `jpda_equals_pda_when_gates_disjoint`, here for a thousand tracks."""
    rng = np.random.default_rng(1)
    zhat = 100.0 * np.stack(np.divmod(np.arange(1000), 40), axis=1)
    z = np.repeat(zhat, 3, axis=0) + rng.normal(size=(3000, 2))
    problem = Problem.gated(Gate(0.99), zhat, np.tile(np.eye(2), (1000, 1, 1)), Scan(0.0, z, np.eye(2)), 0.8, 0.02)
    np.testing.assert_allclose(JPDA().decide(problem).beta, PDA().decide(problem).beta, rtol=1e-12)


@pytest.mark.parametrize("count", [1, 3, 6])
def test_without_clutter_as_many_measurements_as_possible_are_targets(count):
    """The limit: of the events of zero density only those with the fewest false measurements are left."""
    rng = np.random.default_rng(count)
    problem = random_problem(rng, 4, count, gate=1.0, clutter=0.0)
    events = joint_events(factors(random_like(problem, clutter=1.0)), problem.missed)
    most = max(sum(j >= 0 for j in event) for _, event in events)
    expected = marginals([(w, event) for w, event in events if sum(j >= 0 for j in event) == most], 4, count)
    np.testing.assert_allclose(table(problem, JPDA().decide(problem)), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("clutter", [0.05, 0.0])
def test_targets_that_are_always_seen_miss_as_seldom_as_possible(clutter):
    problem = random_problem(np.random.default_rng(7), 4, 3, gate=1.0, detection=1.0, clutter=clutter)
    events = joint_events(factors(random_like(problem, clutter=1.0)), np.ones(4))
    expected = marginals([(w, event) for w, event in events if event.count(-1) == 1], 4, 3)
    np.testing.assert_allclose(table(problem, JPDA().decide(problem)), expected, rtol=0, atol=1e-9)


def random_like(problem, clutter):
    """The same pairs with another clutter density."""
    rows = np.full(problem.rows, clutter)
    return Problem(problem.pairs, problem.scan, problem.cov, problem.detection, rows, problem.inside)


@pytest.mark.parametrize("method", [PDA(), JPDA(), JPDA(star=True), JPDA(largest=0)])
@pytest.mark.parametrize("clutter", [0.0, 0.1])
def test_targets_that_are_never_seen_always_miss(method, clutter):
    problem = random_problem(np.random.default_rng(3), 4, 5, gate=1.0, detection=0.0, clutter=clutter)
    np.testing.assert_allclose(method.decide(problem).beta0, 1.0, atol=1e-50)


@pytest.mark.parametrize(("rows", "count"), [(3, 60), (60, 3), (9, 10)])
def test_clusters_too_large_to_list_are_exact(rows, count):
    """Long lopsided clusters are cheap: only the shorter side's choices need be remembered."""
    rng = np.random.default_rng(rows)
    problem = random_problem(rng, rows, count, gate=1.0, spread=0.5)
    assert len(problem.pairs) == rows * count
    decision = JPDA().decide(problem)
    weights = table(problem, decision)
    assert not decision.approximate.any()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(weights, by_permanents(factors(problem), problem.missed), rtol=1e-9, atol=1e-12)


def by_permanents(factor, miss):
    """Marginals, measurement by measurement, with all sets of the tracks served so far."""
    if len(factor) > factor.shape[1]:
        ratio = by_permanents((factor / miss[:, None]).T, np.ones(factor.shape[1]))[:, 1:].T
        return np.hstack([1 - ratio.sum(axis=1, keepdims=True), ratio])
    rows, count = factor.shape
    sets = np.arange(1 << rows)
    ahead, behind = np.zeros((count + 1, 1 << rows)), np.zeros((count + 1, 1 << rows))
    ahead[0, 0] = 1.0
    alone = np.prod(np.where(sets[:, None] >> np.arange(rows) & 1, 1.0, miss), axis=1)
    behind[count] = alone
    for j in range(count):
        ahead[j + 1] = ahead[j]
        behind[count - j - 1] = behind[count - j]
        for t in range(rows):
            without = sets[(sets >> t & 1) == 0]
            ahead[j + 1, without | 1 << t] += ahead[j, without] * factor[t, j]
            behind[count - j - 1, without] += behind[count - j, without | 1 << t] * factor[t, count - j - 1]
    weights = np.zeros((rows, 1 + count))
    for t in range(rows):
        without = sets[(sets >> t & 1) == 0]
        weights[t, 0] = (ahead[count, without] * alone[without]).sum()
        for j in range(count):
            weights[t, 1 + j] = (ahead[j, without] * factor[t, j] * behind[j + 1, without | 1 << t]).sum()
    return weights / (ahead[count] * alone).sum()


def test_a_cluster_beyond_the_limit_is_approximated_and_says_so(caplog):
    problem = random_problem(np.random.default_rng(5), 6, 8, gate=1.0)
    exact, close = JPDA().decide(problem), JPDA(largest=100)
    with caplog.at_level(logging.INFO):
        decision = close.decide(problem)
    assert decision.approximate.all()
    assert not exact.approximate.any()
    assert "6 of 6 tracks" in caplog.text
    assert np.abs(decision.beta - exact.beta).max() < 0.1


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(1, 12), count=st.integers(1, 12))
@settings(max_examples=100, deadline=None)
def test_belief_propagation_keeps_rows_and_columns_consistent(seed, rows, count):
    problem = random_problem(np.random.default_rng(seed), rows, count, gate=0.999)
    weights = table(problem, JPDA(largest=0).decide(problem))
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-12)
    assert (weights[:, 1:].sum(axis=0) <= 1 + 1e-9).all()


def test_belief_propagation_is_exact_for_one_track():
    problem = random_problem(np.random.default_rng(2), 1, 5, gate=1.0)
    np.testing.assert_allclose(JPDA(largest=0).decide(problem).beta, PDA().decide(problem).beta, rtol=1e-9)


def test_identical_tracks_share_alike():
    """Twenty tracks at one place, ten measurements: every track the same, each measurement shared out once."""
    zhat, z = np.zeros((20, 2)), np.zeros((10, 2))
    problem = Problem.gated(Gate(0.99), zhat, np.tile(np.eye(2), (20, 1, 1)), Scan(0.0, z, np.eye(2)), 0.9, 1e-3)
    weights = table(problem, JPDA().decide(problem))
    np.testing.assert_allclose(weights, np.broadcast_to(weights[0], weights.shape), rtol=1e-9)
    assert 0.9 < weights[:, 1:].sum(axis=0).max() <= 1 + 1e-9


def test_jpda_star_parts_targets_side_by_side():
    """Two tracks 1 apart, two measurements 1 apart: JPDA draws both to the middle, JPDA* each to its own."""
    zhat = np.array([[0.0, 0.0], [1.0, 0.0]])
    problem = Problem.gated(
        Gate(0.999), zhat, np.tile(4 * np.eye(2), (2, 1, 1)), Scan(0.0, zhat, np.eye(2)), 0.99, 1e-4
    )
    shared, parted = (table(problem, JPDA(star=star).decide(problem)) for star in (False, True))
    assert shared[0, 1] < 0.6
    assert parted[0, 1] > 0.9
    assert parted[1, 2] > 0.9
