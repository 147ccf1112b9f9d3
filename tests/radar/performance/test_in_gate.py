import numpy as np
import pytest

from vidtrack.amplitude.strongest import Strongest
from vidtrack.amplitude.threshold import ThresholdController
from vidtrack.radar.performance.in_gate import AllPlots, Gates, StrongestPlot

R = np.eye(2)
RUNS = 20_000


@pytest.fixture
def gates():
    """The same gate in all runs, and targets where they are expected."""
    rng = np.random.default_rng(1)
    S = np.array([[3.0, 1.0], [1.0, 2.0]])
    zhat = np.full((RUNS, 2), 7.0)
    target = zhat + rng.standard_normal((RUNS, 2)) @ np.linalg.cholesky(S).T
    return Gates(zhat, np.tile(S, (RUNS, 1, 1)), 4.0, target)


def whitened(z, gates):
    return (z - 7.0) @ np.linalg.inv(np.linalg.cholesky(gates.S[0])).T


def test_points_fill_the_gate_evenly(gates):
    v = whitened(gates.uniform(np.random.default_rng(2), np.arange(RUNS)), gates)
    share = (v**2).sum(axis=1) / 16
    assert share.max() < 1
    np.testing.assert_allclose(np.quantile(share, [0.25, 0.5, 0.75]), [0.25, 0.5, 0.75], atol=0.015)
    assert np.abs(v.mean(axis=0)).max() < 0.06


def test_targets_lie_in_their_gate_as_often_as_they_should(gates):
    assert gates.holds_target.mean() == pytest.approx(0.999665, abs=4 * 0.00013)


def test_all_plots_have_the_number_of_clutter_and_of_detections(gates):
    p_fa, cell = 1e-2, 4.0
    plots = AllPlots(10.0, p_fa, cell).draw(np.random.default_rng(3), 0.0, gates, R)
    expected = p_fa * gates.volume[0] / cell + p_fa ** (1 / 11)
    assert len(plots.scan) / RUNS == pytest.approx(expected, abs=4 * np.sqrt(expected / RUNS))
    np.testing.assert_allclose(plots.density, p_fa / cell)
    np.testing.assert_allclose(plots.p_d, p_fa ** (1 / 11))


def test_a_controller_sets_the_threshold_from_each_gate(gates):
    controller = ThresholdController(10.0, 4.0)
    plots = AllPlots(10.0, controller, 4.0).draw(np.random.default_rng(4), 0.0, gates, R)
    np.testing.assert_array_equal(plots.p_fa, controller.p_fa(gates.S))


def test_a_hopeless_gate_shows_nothing(gates):
    plots = AllPlots(10.0, 0.5, 1e-6).draw(np.random.default_rng(5), 0.0, gates, R)
    assert len(plots.scan) == 0


def test_the_strongest_plot_is_what_all_amplitudes_would_give(gates):
    law, cell = Strongest(20.0, 1e-2), 0.5
    cells = gates.volume[0] / cell
    scan = StrongestPlot(law, cell).draw(np.random.default_rng(6), 0.0, gates, R).scan
    none, target, _ = law.priors(cells)
    assert 1 - len(scan) / RUNS == pytest.approx(none, abs=4 * np.sqrt(none / RUNS))
    is_target = (scan.z == gates.target[scan.run]).all(axis=1)
    assert is_target.sum() / RUNS == pytest.approx(target, abs=4 * np.sqrt(target * (1 - target) / RUNS))
    assert (scan.amplitude > law.clutter.threshold(law.p_fa)).all()
    level = np.median(scan.amplitude)  # the strongest is below if all are: no target, or a weaker one, and no clutter
    weaker_target = 1 - gates.holds_target.mean() * law.target.survival(level)
    below = weaker_target * np.exp(-cells * law.clutter.survival(level))
    assert ((scan.amplitude < level).sum() + RUNS - len(scan)) / RUNS == pytest.approx(
        below, abs=4 * 0.5 / np.sqrt(RUNS)
    )
