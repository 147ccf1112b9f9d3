"""Gate and likelihood of interacting multiple models: brute force, and one mode as the gate has it."""

import numpy as np
import pytest

from vidtrack.associate.gate import Gate, LikelihoodGate
from vidtrack.associate.mixture import LEAST_MODE, mixture_pairs
from vidtrack.estimate.bank import Modes
from vidtrack.scan import Scan


def spd(rng, *shape, dim=2):
    root = rng.normal(size=(*shape, dim, dim))
    return root @ np.swapaxes(root, -1, -2) + np.eye(dim)


def problem(seed, modes=3, rows=5, measurements=8):
    rng = np.random.default_rng(seed)
    weight = rng.dirichlet(np.full(modes, 0.4), rows).T
    zhat = rng.normal(0, 4, (modes, rows, 2))
    scan = Scan(0.0, rng.normal(0, 4, (measurements, 2)), spd(rng, measurements))
    return Modes(weight, zhat, spd(rng, modes, rows)), scan


def log_normal(v, S):
    return -0.5 * (v @ np.linalg.solve(S, v) + np.log(np.linalg.det(2 * np.pi * S)))


@pytest.mark.parametrize("seed", range(10))
def test_pairs_are_those_in_the_gate_of_any_mode_and_weighed_by_all(seed):
    modes, scan = problem(seed)
    gate = Gate(0.9)
    expected = {}
    for t in range(5):
        for j in range(len(scan)):
            v, S = scan.z[j] - modes.zhat[:, t], modes.cov[:, t] + scan.R[j]
            d2 = np.array([a @ np.linalg.solve(B, a) for a, B in zip(v, S, strict=True)])
            if np.any((d2 <= gate.limit(2)) & (modes.weight[:, t] >= LEAST_MODE)):
                each = [w * np.exp(log_normal(a, B)) for w, a, B in zip(modes.weight[:, t], v, S, strict=True)]
                expected[t, j] = np.log(sum(each))
    pairs, _ = mixture_pairs(gate, modes, scan)
    found = zip(pairs.row.tolist(), pairs.measurement.tolist(), strict=True)
    assert list(found) == sorted(expected)
    np.testing.assert_allclose(pairs.log_l, [expected[key] for key in sorted(expected)], rtol=1e-10)
    np.testing.assert_array_equal(pairs.start, np.searchsorted(pairs.row, np.arange(6)))


def test_one_mode_is_the_gate_itself():
    modes, scan = problem(3, modes=1)
    alone = Gate(0.99).pairs(modes.zhat[0], modes.cov[0], scan)
    mixed, _ = mixture_pairs(Gate(0.99), modes, scan)
    for name in ("row", "measurement", "d2", "nis", "log_s", "log_l", "cost", "limit", "start"):
        np.testing.assert_allclose(getattr(mixed, name), getattr(alone, name), rtol=1e-12)


def test_a_measurement_that_only_a_manoeuvre_explains_is_admitted_as_likely_as_it_is():
    """A seldom wide mode beside a usual narrow one: their common moments would refuse what the wide one expects."""
    modes = Modes(np.array([[0.9], [0.1]]), np.zeros((2, 1, 2)), np.stack([np.eye(2)[None], 100 * np.eye(2)[None]]))
    scan = Scan(0.0, np.array([[14.0, 0.0]]), np.eye(2))
    weight, _, cov = modes
    moments = np.einsum("rt,rtij->tij", weight, cov)
    assert not len(Gate(0.999).pairs(np.zeros((1, 2)), moments, scan))
    pairs, _ = mixture_pairs(Gate(0.999), modes, scan)
    assert len(pairs) == 1
    assert pairs.log_l[0] == pytest.approx(np.log(0.1) + log_normal(scan.z[0], cov[1, 0] + np.eye(2)), rel=1e-6)


def test_an_empty_scan_and_no_tracks():
    modes, scan = problem(0)
    assert not len(mixture_pairs(Gate(), modes, Scan(0.0, np.empty((0, 2)), np.empty((0, 2, 2))))[0])
    none = Modes(np.empty((3, 0)), np.empty((3, 0, 2)), np.empty((3, 0, 2, 2)))
    assert not len(mixture_pairs(Gate(), none, scan)[0])


def test_the_share_inside_and_the_limit_are_of_all_modes_and_not_of_the_first():
    """Of targets drawn from mixtures the gate admits the share that it states, also where the first mode is rare."""
    rng = np.random.default_rng(0)
    gate = LikelihoodGate(detection_probability=None, new_density=None)
    zhat = np.array([[0.0, 0.0], [3.0, 0.0], [-2.0, 1.0]])[:, None]
    cov = np.stack([0.5 * np.eye(2), np.diag([20.0, 5.0]), 300 * np.eye(2)])[:, None]
    for weight in ([0.9, 0.07, 0.03], [0.001, 0.2, 0.799], [0.03, 0.965, 0.005]):
        mode = rng.choice(3, 4000, p=weight)
        root = np.linalg.cholesky(cov[mode, 0] + np.eye(2))
        z = zhat[mode, 0] + np.einsum("nij,nj->ni", root, rng.standard_normal((4000, 2)))
        scan, modes = Scan(0.0, z, np.eye(2)), Modes(np.array(weight)[:, None], zhat, cov)
        pairs, share = mixture_pairs(gate, modes, scan, detection=0.8, clutter=3e-4)
        assert share[0] == pytest.approx(len(pairs) / len(z), abs=0.02)
        assert pairs.d2.max() <= pairs.limit[0] + 1e-9


def test_a_fixed_share_is_that_of_the_mixture():
    modes, scan = problem(1)
    np.testing.assert_allclose(mixture_pairs(Gate(0.9), modes, scan)[1], 0.9, rtol=1e-12)
