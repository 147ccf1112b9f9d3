"""Which plots are of two targets: the resolution cell, and the likelihoods against sampling and enumeration."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.associate.gate import Gate
from vidtrack.associate.problem import Problem
from vidtrack.errors import ConfigError
from vidtrack.scan import Scan
from vidtrack.tracking.unresolved.cell import SIZES, USUAL, PolarCell
from vidtrack.tracking.unresolved.claims import Placed, _two, claims
from vidtrack.tracking.unresolved.correlations import Correlations
from vidtrack.tracking.unresolved.joint import Joint

FAR = np.array([0.0, 20_000.0])
R = np.diag([100.0**2, 40.0**2])


def pair(apart, sigma=50.0):
    """Two targets at FAR, `apart` (2,) metres from each other."""
    x = np.zeros((2, 4))
    x[:, ::2] = FAR + np.array([[0.5], [-0.5]]) * apart
    return x, np.tile(np.diag([sigma**2, 100.0, sigma**2, 100.0]), (2, 1, 1))


def decided(x, P, plots, cell=None, clutter=1e-9, detection=0.9):
    scan = Scan(0.0, np.asarray(plots, float).reshape(-1, 2), R)
    problem = Problem.gated(Gate(0.9999), x[:, ::2], P[:, ::2, ::2], scan, detection, clutter)
    placed = Placed(scan.z, scan.R, x, P)
    every = np.arange(len(x))
    cell = cell or PolarCell((0.0, 0.0), (150.0, np.radians(1.5)))
    return claims(problem, every, every + 1, np.zeros(len(x), int), placed, Correlations(), cell)[0].tolist()


def test_one_plot_between_two_near_targets_is_of_both_and_two_plots_are_of_one_each():
    x, P = pair(np.array([200.0, 20.0]))
    assert decided(x, P, [FAR]) == [0, 0]
    assert decided(x, P, [x[0, ::2], x[1, ::2]]) == [-1, -1]
    assert decided(x, P, np.empty((0, 2))) == [-1, -1]
    assert decided(x, P, [FAR, FAR + np.array([30_000, 0])]) == [0, 0]


def test_targets_that_the_radar_resolves_share_nothing():
    x, P = pair(np.array([1500.0, 0.0]))
    assert decided(x, P, [x[0, ::2]]) == [-1, -1]
    x, P = pair(np.array([0.0, 600.0]))
    assert decided(x, P, [FAR]) == [-1, -1]


def test_three_targets_share_a_plot():
    x, P = pair(np.array([200.0, 20.0]))
    x, P = np.concatenate([x, x[:1]]), np.concatenate([P, P[:1]])
    x[2, ::2] = FAR
    assert decided(x, P, [FAR]) == [0, 0, 0]


def test_axes_are_those_of_range_and_azimuth():
    cell = PolarCell((100.0, 0.0), (150.0, 0.01))
    np.testing.assert_allclose(cell.axes(np.array([100.0, 5000.0])), [[0, 1], [1, 0]], atol=1e-12)
    np.testing.assert_allclose(cell.sides(np.array([100.0, 5000.0]), R, 4.0), [150.0, 50.0])
    learnt = PolarCell((0.0, 0.0), (None, None))
    np.testing.assert_allclose(learnt.sides(FAR, R, 4.0), [160.0, 400.0])
    space = PolarCell((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)).axes(np.array([3.0, 4.0, 12.0]))
    np.testing.assert_allclose(space @ space.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(space[0], np.array([3, 4, 12]) / 13)
    assert space[1, 2] == 0


def test_probability_of_one_cell_is_the_share_of_a_sample():
    rng = np.random.default_rng(0)
    x, P = pair(np.array([300.0, 60.0]), 80.0)
    joint = Joint(x.ravel(), np.kron(np.eye(2), P[0]), 2)
    cell = PolarCell((0.0, 0.0), (150.0, np.radians(1.5)))
    sample = rng.multivariate_normal(joint.x, joint.P, 200_000) @ joint.difference(0, 1).T
    inside = (np.abs(sample[:, 1]) < 150) & (np.abs(sample[:, 0]) < 20_000 * np.radians(1.5))
    assert cell.shared(joint, 0, 1, R, 4.0) == pytest.approx(inside.mean(), abs=0.005)
    within = cell.confined(joint, R)
    np.testing.assert_allclose(joint.difference(0, 1) @ within.x, sample[inside].mean(axis=0), atol=3)


@given(st.lists(st.tuples(st.floats(-300, 300), st.floats(-100, 100)), max_size=4))
def test_events_of_two_resolved_targets_are_all_summed(offsets):
    x, P = pair(np.array([100.0, 0.0]))
    plots = FAR + np.array(offsets).reshape(-1, 2)
    scan = Scan(0.0, plots, R)
    problem = Problem.gated(Gate(0.9999), x[:, ::2], P[:, ::2, ::2], scan, 0.9, 1e-9)
    gated = list(zip(problem.pairs.row, problem.pairs.measurement, problem.log_ratio, strict=True))
    ratio = [{-1: problem.log_missed[t]} | {int(a): r for row, a, r in gated if row == t} for t in range(2)]
    events = [ratio[0][a] + ratio[1][b] for a, b in product(*ratio) if a != b or a < 0]
    assert _two(problem, 0, 1) == pytest.approx(np.logaddexp.reduce(events))


@pytest.mark.parametrize(("true", "within"), [(2.0, (1, 3.5)), (6.0, (4.5, 8))])
def test_the_size_of_the_cell_is_learnt_from_close_targets(true, within):
    rng = np.random.default_rng(1)
    cell = PolarCell((0.0, 0.0), (None, None))
    assert SIZES[cell.probability.argmax()] == USUAL
    for _ in range(150):
        apart = rng.uniform(-1, 1, 2) * 8 * np.sqrt(np.diagonal(R))
        x, P = pair(apart, 20.0)
        merged = (np.abs(apart) < true * np.sqrt(np.diagonal(R))).all()
        noise = rng.multivariate_normal(np.zeros(2), R, 2)
        decided(x, P, [FAR + noise[0]] if merged else x[:, ::2] + noise, cell)
    assert within[0] < cell.probability @ SIZES < within[1]


@pytest.mark.parametrize("size", [(0.0, 1.0), (None, -1.0)])
def test_a_cell_without_extent_is_refused(size):
    with pytest.raises(ConfigError, match="resolution cell"):
        PolarCell((0.0, 0.0), size)
