"""The gate against brute force: which pairs, how far apart, whatever the grid behind it does."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import chdtr, chdtri

from vidtrack.associate.gate import Gate, LikelihoodGate
from vidtrack.associate.hard import GNN, NN
from vidtrack.associate.problem import Problem
from vidtrack.errors import ConfigError
from vidtrack.scan import Scan

DISTANCES = ("mahalanobis", "decoupled", "euclidean")
KINDS = [(2, distance) for distance in DISTANCES] + [(1, "mahalanobis"), (3, "mahalanobis")]
"""Dimensions and distance: each pair is a kernel to compile."""


def covariances(rng, count, dim, size):
    root = rng.normal(size=(count, dim, dim)) * size
    return root @ np.swapaxes(root, 1, 2) + 0.1 * size**2 * np.eye(dim)


def brute_force(zhat, cov, scan, distance):
    """d2, NIS and ln|S| (T, M each) straight from the definition."""
    v = scan.z[None] - zhat[:, None]
    S = cov[:, None] + scan.R[None]
    nis = np.einsum("tma,tmab,tmb->tm", v, np.linalg.inv(S), v)
    variance = np.diagonal(S, axis1=2, axis2=3)
    d2 = {"mahalanobis": nis, "decoupled": (v**2 / variance).sum(axis=2), "euclidean": (v**2).sum(axis=2)}
    return d2[distance], nis, np.linalg.slogdet(S)[1]


def check(zhat, cov, scan, gate, run=None):
    pairs = gate.pairs(zhat, cov, scan, run)
    d2, nis, log_s = brute_force(zhat, cov, scan, gate.distance)
    limit = gate.limit(zhat.shape[1])
    inside = d2 <= limit
    if run is not None:
        inside &= run[:, None] == scan.run[None]
    found = np.zeros(inside.shape, bool)
    found[pairs.row, pairs.measurement] = True
    sure = np.abs(d2 - limit) > 1e-9 * max(1.0, limit)  # on the very edge rounding decides
    np.testing.assert_array_equal(found[sure], inside[sure])
    assert found.sum() == len(pairs), "a pair came twice"
    np.testing.assert_allclose(pairs.d2, d2[pairs.row, pairs.measurement], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(pairs.nis, nis[pairs.row, pairs.measurement], rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(pairs.log_s, log_s[pairs.row, pairs.measurement], rtol=1e-9, atol=1e-9)
    order = pairs.row * (inside.shape[1] + 1) + pairs.measurement
    assert (np.diff(order) > 0).all(), "pairs come by track, then by measurement"
    return pairs


@given(
    seed=st.integers(0, 2**32 - 1),
    rows=st.integers(0, 25),
    count=st.integers(0, 25),
    kind=st.sampled_from(KINDS),
    runs=st.integers(1, 3),
    spread=st.sampled_from([0.1, 10.0, 1000.0]),
    probability=st.sampled_from([0.1, 0.95, 0.999]),
)
@settings(max_examples=150, deadline=None)
def test_gate_admits_what_brute_force_admits(seed, rows, count, kind, runs, spread, probability):
    dim, distance = kind
    rng = np.random.default_rng(seed)
    zhat, z = spread * rng.normal(size=(rows, dim)), spread * rng.normal(size=(count, dim))
    scan = Scan(0.0, z, covariances(rng, count, dim, 2.0), run=rng.integers(0, runs, count))
    check(
        zhat,
        covariances(rng, rows, dim, 3.0),
        scan,
        Gate(probability, distance, radius=9.0),
        rng.integers(0, runs, rows),
    )


@pytest.mark.parametrize("distance", DISTANCES)
def test_order_of_the_measurements_does_not_matter(distance):
    rng = np.random.default_rng(4)
    z, R = 20 * rng.normal(size=(60, 2)), covariances(rng, 60, 2, 2.0)
    zhat, cov = 20 * rng.normal(size=(40, 2)), covariances(rng, 40, 2, 3.0)
    shuffled = rng.permutation(60)
    plain = check(zhat, cov, Scan(0.0, z, R), Gate(distance=distance))
    other = check(zhat, cov, Scan(0.0, z[shuffled], R[shuffled]), Gate(distance=distance))
    assert len(plain)
    assert set(zip(plain.row, plain.measurement, strict=True)) == set(
        zip(other.row, shuffled[other.measurement], strict=True)
    )


@pytest.mark.parametrize("distance", ["mahalanobis", "decoupled"])
def test_gate_of_zero_admits_nothing_and_gate_of_one_everything(distance):
    rng = np.random.default_rng(1)
    z = np.vstack([1e3 * rng.normal(size=(20, 2)), np.zeros((1, 2))])
    zhat, cov = np.vstack([1e3 * rng.normal(size=(9, 2)), np.zeros((1, 2))]), covariances(rng, 10, 2, 1.0)
    scan = Scan(0.0, z, np.eye(2))
    assert len(Gate(0.0, distance).pairs(zhat, cov, scan)) == 0
    assert len(Gate(1.0, distance).pairs(zhat, cov, scan)) == 10 * 21


def test_share_of_true_measurements_inside_is_the_gate_probability():
    rng = np.random.default_rng(8)
    S = covariances(rng, 1, 2, 3.0)
    R = 0.5 * np.linalg.eigvalsh(S[0]).min() * np.eye(2)
    scan = Scan(0.0, rng.multivariate_normal([5.0, -4.0], S[0], 20_000), R)
    pairs = Gate(0.95).pairs(np.array([[5.0, -4.0]]), S - R, scan)
    assert len(pairs) / 20_000 == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / 20_000))


def test_runs_never_meet():
    rng = np.random.default_rng(2)
    run = np.repeat(np.arange(50), 4)
    z = rng.normal(size=(200, 2))
    pairs = check(z + 0.1, covariances(rng, 200, 2, 1.0), Scan(0.0, z, np.eye(2), run=run), Gate(0.999), run)
    assert len(pairs) > 200
    np.testing.assert_array_equal(run[pairs.row], run[pairs.measurement])


def test_ten_thousand_measurements_at_one_point():
    zhat = np.array([[7.0, 7.0], [300.0, 7.0]])
    scan = Scan(0.0, np.full((10_000, 2), 7.0), np.eye(2))
    pairs = Gate().pairs(zhat, np.tile(np.eye(2), (2, 1, 1)), scan)
    np.testing.assert_array_equal(pairs.measurement, np.arange(10_000))
    assert (pairs.row == 0).all()
    np.testing.assert_array_equal(pairs.start, [0, 10_000, 10_000])


def test_a_far_outlier_does_not_hide_the_near_ones():
    rng = np.random.default_rng(5)
    z = np.vstack([rng.normal(size=(300, 2)), [[1e9, -1e9]]])
    check(z[:100], covariances(rng, 100, 2, 0.5), Scan(0.0, z, 0.1 * np.eye(2)), Gate())


def test_only_keeps_the_pairs_of_the_mask():
    rng = np.random.default_rng(6)
    z = rng.normal(size=(12, 2))
    pairs = Gate().pairs(z, covariances(rng, 12, 2, 1.0), Scan(0.0, z, np.eye(2)))
    odd = pairs.only(pairs.measurement % 2 == 1)
    assert (odd.measurement % 2 == 1).all()
    for row in range(12):
        assert (odd.row[odd.start[row] : odd.start[row + 1]] == row).all()
    assert odd.start[-1] == len(odd)


@pytest.mark.parametrize("bad", [{"probability": 1.5}, {"probability": -0.1}, {"distance": "cosine"}, {"radius": 0.0}])
def test_a_gate_that_makes_no_sense_is_refused(bad):
    value = next(iter(bad.values()))
    with pytest.raises(ConfigError, match=str(value)):
        Gate(**bad)


# Paper 004's argument in numbers: two targets, one going up and one going right, meet. S1 = diag(1, 36) and
# S2 = diag(36, 1); the truth is that track 0 made measurement 0 and track 1 measurement 1.
ZHAT = np.array([[0.0, 0.0], [-4.0, 6.0]])
S = np.array([np.diag([1.0, 36.0]), np.diag([36.0, 1.0])])
Z = np.array([[0.0, 8.0], [4.0, 6.0]])
QUARTER = np.array([[1.0, -1.0], [1.0, 1.0]]) / np.sqrt(2)  # turns by 45 degrees


def crossing(turn, distance, rule):
    """d2 (2, 2) and the measurement each track takes, of the crossing turned by `turn`."""
    R = 0.5 * np.eye(2)
    scan = Scan(0.0, Z @ turn.T, R)
    problem = Problem.gated(Gate(0.99999, distance), ZHAT @ turn.T, turn @ S @ turn.T - R, scan)
    taken = np.full(2, -1)
    decision = rule.decide(problem)
    taken[decision.row] = decision.measurement
    return problem.pairs.d2.reshape(2, 2), taken.tolist()


@pytest.mark.parametrize("rule", [NN(), GNN()])
def test_plain_distance_swaps_the_crossing_pair(rule):
    d2, taken = crossing(np.eye(2), "euclidean", rule)
    np.testing.assert_allclose(d2, [[64, 52], [20, 64]], rtol=1e-12)
    assert taken == [1, 0]


@pytest.mark.parametrize("rule", [NN(), GNN()])
@pytest.mark.parametrize("turn", [np.eye(2), QUARTER])
def test_confidence_region_keeps_the_crossing_pair_at_any_angle(rule, turn):
    d2, taken = crossing(turn, "mahalanobis", rule)
    np.testing.assert_allclose(d2, [[16 / 9, 17], [40 / 9, 16 / 9]], rtol=1e-9)
    assert taken == [0, 1]


@pytest.mark.parametrize("rule", [NN(), GNN()])
def test_decoupled_distance_keeps_the_crossing_along_the_axes_and_swaps_it_at_45_degrees(rule):
    assert crossing(np.eye(2), "decoupled", rule)[1] == [0, 1]
    d2, taken = crossing(QUARTER, "decoupled", rule)
    np.testing.assert_allclose(d2, np.array([[64, 52], [20, 64]]) / 18.5, rtol=1e-9)  # Euclid over the equal variances
    assert taken == [1, 0]


def test_correlated_region_refuses_what_the_axes_admit():
    """SPEC 001, `gates`: with S = [[4, 3], [3, 4]] the innovation (3, -3) is at d2 = 18, per axis only at 4.5."""
    cov = np.array([[[3.5, 3.0], [3.0, 3.5]]])
    z = np.array([[3.0, -3.0], [4.5, 4.5], [5.5, 0.0], [2.0, 2.0]])
    scan = Scan(0.0, z, 0.5 * np.eye(2))
    everything = Gate(1.0).pairs(np.zeros((1, 2)), cov, scan)
    np.testing.assert_allclose(everything.d2, [18.0, 5.785714285714285, 17.285714285714285, 1.1428571428571428])
    assert Gate(0.99).limit(2) == pytest.approx(9.21034037197618, rel=1e-12)
    assert Gate(0.99).limit(2) == pytest.approx(chdtri(2, 0.01))
    np.testing.assert_array_equal(Gate(0.99).pairs(np.zeros((1, 2)), cov, scan).measurement, [1, 3])


def test_likelihood_gate_admits_what_is_likelier_than_a_miss_and_a_new_target():
    """SPEC 001, `gates`: P_D = 0.9, 0.001 new targets per unit of area, S = [[4, 3], [3, 4]]."""
    cov = np.array([[[3.5, 3.0], [3.0, 3.5]]])
    scan = Scan(0.0, np.array([[3.0, -3.0], [4.5, 4.5], [5.5, 0.0], [2.0, 2.0]]), 0.5 * np.eye(2))
    gate = LikelihoodGate(detection_probability=0.9, new_density=1e-3)
    pairs = gate.pairs(np.zeros((1, 2)), cov, scan)
    np.testing.assert_allclose(pairs.limit, [12.58829543076271], rtol=1e-12)
    np.testing.assert_array_equal(pairs.measurement, [1, 3])
    np.testing.assert_allclose(gate.inside(pairs.limit, 2), chdtr(2, pairs.limit))
    hopeless = LikelihoodGate(detection_probability=0.1, new_density=1.0)
    assert len(hopeless.pairs(np.zeros((1, 2)), cov, scan)) == 0


@pytest.mark.parametrize(
    ("clutter", "usual", "wider"),
    [
        (1e-6, 19.119, 19.119 + 2 * np.log(10)),  # few false ones: the whole loss counts
        (5e-5, 11.295, 15.901),
        (3e-4, 7.712, 10.505),  # between: one false measurement on average, pi d2 sqrt|S| clutter = 1
        (1e-3, 5.304, 5.304),  # dense: no wider
    ],
)
def test_refusing_a_measurement_costs_more_while_a_gate_holds_few_false_ones(clutter, usual, wider):
    """S = 101 I, P_D = .9: d2 = 2 ln(.9 / (.1 clutter 2 pi 101)), and 2 ln 10 more."""
    scan = Scan(0.0, np.zeros((1, 2)), np.eye(2))
    for loss, limit in ((1.0, usual), (10.0, wider)):
        gate = LikelihoodGate(detection_probability=None, new_density=None, new_share=0.0, loss=loss)
        pairs = gate.pairs(np.zeros((1, 2)), 100 * np.eye(2)[None], scan, detection=0.9, clutter=clutter)
        np.testing.assert_allclose(pairs.limit, [limit], atol=1e-3)


@pytest.mark.parametrize(
    "bad",
    [
        {"detection_probability": 0.0},
        {"new_density": -1.0},
        {"loss": 0.5},
        {"loss": np.inf},
        {"distance": "euclidean"},
        {"probability": 2.0},
    ],
)
def test_a_likelihood_gate_that_makes_no_sense_is_refused(bad):
    with pytest.raises(ConfigError, match=str(next(iter(bad.values())))):
        LikelihoodGate(**bad)
