import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.amplitude.reduction import ball, gate_volume, gated, gated_spread, q2, q2_fit
from vidtrack.errors import ConfigError


def test_constants_of_the_gate():
    np.testing.assert_allclose([ball(1), ball(2), ball(3)], [2, np.pi, 4 * np.pi / 3], rtol=1e-14)
    assert gated(2, 4.0) == pytest.approx(0.999664537, abs=5e-10)
    assert gated_spread(2, 4.0) == pytest.approx(0.99731539839327, rel=1e-12)
    np.testing.assert_allclose(gate_volume(np.diag([4.0, 9.0])[None], 4.0), np.pi * 16 * 6)


@pytest.mark.parametrize(
    ("p_d", "clutter", "exact", "fit"),
    [
        (0.1, 0.01, 0.08663065053566976, 0.08765081475060031),
        (0.1, 0.5, 0.02503852061733214, 0.01266288744229075),
        (0.5, 0.1, 0.4200931341426039, 0.4492),
        (0.9, 1.0, 0.6167310031091598, 0.6246),
        (1.0, 2.0, 0.6170190510388537, 0.5731),
        (0.3, 5.0, 0.031252851048570916, 0.0226),
    ],
)
def test_exact_factor_and_fit_for_two_dimensions_and_gate_four(p_d, clutter, exact, fit):
    assert q2(p_d, clutter) == pytest.approx(exact, rel=1e-9)
    assert q2_fit(p_d, clutter) == pytest.approx(fit, rel=1e-9 if len(str(fit)) > 8 else 2e-3)


@pytest.mark.parametrize(
    ("dim", "gate", "exact"),
    [
        (1, 3.0, 0.2847233948766966),
        (1, 5.0, 0.3697954405918951),
        (2, 3.0, 0.31041684388077934),
        (3, 4.0, 0.43388558674964284),
        (4, 5.0, 0.5418103362249694),
    ],
)
def test_exact_factor_in_other_dimensions_and_gates(dim, gate, exact):
    assert q2(0.7, 1.0, dim, gate) == pytest.approx(exact, rel=1e-9)


def test_few_false_plots_agree_with_the_sums_of_the_paper():
    """Equations (17) and (18) summed up to three plots in the gate."""
    assert q2(0.5, 0.01) == pytest.approx(0.4835790966765675, rel=1e-6)


def test_simulation_of_the_definition():
    """E[v' S^-1 v] / M of the combined innovation with the PDAF's own weights, M = 2, g = 4."""
    rng, p_d, clutter, gate, runs = np.random.default_rng(5), 0.7, 1.0, 4.0, 100_000
    target = rng.standard_normal((runs, 2))
    seen = (rng.random(runs) < p_d) & ((target**2).sum(axis=1) < gate**2)
    run = np.concatenate([np.flatnonzero(seen), np.repeat(np.arange(runs), rng.poisson(clutter, runs))])
    false = len(run) - seen.sum()
    radius, angle = gate * np.sqrt(rng.random(false)), 2 * np.pi * rng.random(false)
    v = np.concatenate([target[seen], np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])])
    e = np.exp(-(v**2).sum(axis=1) / 2)
    b = 2 * np.pi * clutter / (np.pi * gate**2) * (1 - p_d * gated(2, gate)) / p_d
    total = b + np.bincount(run, e, runs)
    combined = np.column_stack([np.bincount(run, e * v[:, a], runs) for a in range(2)]) / total[:, None]
    sample = (combined**2).sum(axis=1) / 2
    assert abs(sample.mean() - q2(p_d, clutter)) < 4 * sample.std() / np.sqrt(runs)


def test_without_clutter_only_misses_and_the_gate_cost():
    assert q2(0.7, 0.0) == pytest.approx(0.6978865854442141, rel=1e-12)
    np.testing.assert_allclose(q2([0.0, 1e-300, 0.0], [0.0, 1.0, 5.0]), 0, atol=1e-100)


@settings(max_examples=25)
@given(st.floats(0.01, 1), st.floats(0, 1e6), st.integers(1, 4), st.floats(1.5, 6))
def test_the_factor_lies_between_nothing_and_no_clutter(p_d, clutter, dim, gate):
    value = float(q2(p_d, clutter, dim, gate))
    assert 0 <= value <= p_d * gated(dim, gate) * gated_spread(dim, gate) * (1 + 1e-9)


def test_arrays_broadcast():
    p_d, clutter = np.array([[0.5], [0.9]]), np.array([0.1, 1.0, 5.0])
    value = q2(p_d, clutter)
    assert value.shape == (2, 3)
    assert value[1, 2] == pytest.approx(float(q2(0.9, 5.0)), rel=1e-14)


def test_impossible_gates_are_refused():
    with pytest.raises(ConfigError, match="gate of -1"):
        q2(0.5, 1.0, 2, -1.0)
