import numpy as np
import pytest

from vidtrack.amplitude.densities import RAYLEIGH, Weibull, linear
from vidtrack.amplitude.strongest import Strongest
from vidtrack.amplitude.threshold import ThresholdController
from vidtrack.associate.pda import PDA
from vidtrack.associate.strongest import PSN, StrongestNeighbour
from vidtrack.radar.performance.in_gate import AllPlots, StrongestPlot
from vidtrack.radar.performance.monte_carlo import Outcome, root_mean_square, simulate
from vidtrack.radar.performance.prediction import normalised, position_error, predict, psn_factor

RUNS = 1500
PAPER_002 = normalised(0.16, 4.0, 0.1)


def share_differs(found, runs, reference, reference_runs):
    """Difference of two shares in their combined standard error, from the pooled share."""
    pooled = (found * runs + reference * reference_runs + 0.5) / (runs + reference_runs + 1)
    return abs(found - reference) / np.sqrt(pooled * (1 - pooled) * (1 / runs + 1 / reference_runs))


def strongest(db, p_fa, clutter, associate, runs=RUNS, seed=1):
    law = Strongest(linear(db), p_fa, clutter)
    rng = np.random.default_rng(seed)
    return simulate(PAPER_002, StrongestPlot(law, 0.1), associate(law), scans=50, runs=runs, rng=rng)


def psn(law):
    return PSN(law.snr, law.clutter)


@pytest.mark.parametrize(
    ("db", "p_fa", "clutter", "lost", "strayed", "kept"),
    [  # kept: k, error and its standard error in 10,000 runs
        (16, 1e-1, RAYLEIGH, 0.0009, 0.0041, ((1, 1.893, 0.017), (3, 1.699, 0.030), (10, 1.398, 0.015))),
        (13, 1e-3, RAYLEIGH, 0.0031, 0.0153, ((1, 2.231, 0.017), (3, 2.475, 0.037), (10, 1.882, 0.027))),
        (16, 1e-3, Weibull(1, 1), 0.3835, 0.6211, ((1, 2.469, 0.024), (3, 3.966, 0.056), (10, 4.582, 0.079))),
    ],
)
def test_a_strongest_neighbour_filter_errs_as_the_reference(db, p_fa, clutter, lost, strayed, kept):
    outcome = strongest(db, p_fa, clutter, psn)
    assert share_differs(outcome.lost(20.0).mean(), RUNS, lost, 10_000) < 4
    assert share_differs(outcome.strayed(20.0).mean(), RUNS, strayed, 10_000) < 4
    rms, se = root_mean_square(outcome.error[:, ~outcome.strayed(20.0)])
    for k, reference, reference_se in kept:
        assert abs(rms[k - 1] - reference) < 4 * np.hypot(se[k - 1], reference_se)


def test_the_corrected_prediction_is_the_filter_s_error_and_the_printed_one_is_too_low():
    """At the first scan no run is lost yet, so nothing is left out."""
    law = Strongest(linear(16), 1e-1)
    outcome = simulate(PAPER_002, StrongestPlot(law, 0.1), psn(law), scans=1, runs=20_000, rng=np.random.default_rng(2))
    rms, se = root_mean_square(outcome.error)
    expected = root_mean_square(outcome.expected)[0]
    printed, corrected = (
        position_error(PAPER_002, predict(PAPER_002, psn_factor(PAPER_002, law.snr, 1e-1, mode=mode), 1))
        for mode in ("paper", "corrected")
    )
    assert abs(rms[0] - corrected[0]) < 4 * se[0]
    assert rms[0] - printed[0] > 6 * se[0]
    assert expected[0] == pytest.approx(corrected[0], rel=0.01)


def test_the_plain_strongest_neighbour_is_lost_in_most_runs():
    outcome = strongest(16, 1e-1, RAYLEIGH, lambda law: StrongestNeighbour())
    assert share_differs(outcome.lost(20.0).mean(), RUNS, 0.756, 2000) < 4


@pytest.mark.parametrize(
    ("cell", "controlled", "lost", "first", "median"),
    [
        (4.0, True, 0.0230, 2.455, 0.963),
        (4.0, False, 0.1143, 2.558, 1.057),
        (2.0, True, 0.0225, 2.468, 0.981),
        (2.0, False, 0.2830, 2.688, 1.508),
    ],
)
def test_a_data_association_filter_with_a_fixed_and_with_the_best_threshold(cell, controlled, lost, first, median):
    threshold = ThresholdController(10.0, cell, method="closed-form") if controlled else 1e-2
    outcome = simulate(
        normalised(0.01, 4.0, cell), AllPlots(10.0, threshold, cell), PDA(),
        scans=35, runs=RUNS, rng=np.random.default_rng(3),
    )  # fmt: skip
    assert share_differs(outcome.lost(10.0).mean(), RUNS, lost, 4000) < 4
    rms, se = root_mean_square(outcome.error[:1])
    assert abs(rms[0] - first) < 4 * np.hypot(se[0], 0.015 * first)
    spread = 1.25 * np.std(outcome.error[-1][outcome.error[-1] < 5]) / np.sqrt(RUNS)
    assert abs(np.median(outcome.error[-1]) - median) < 4 * 1.2 * spread


def test_the_same_seed_gives_the_same_runs_and_another_does_not():
    first, again, other = (strongest(16, 1e-3, RAYLEIGH, psn, runs=50, seed=s).error for s in (4, 4, 5))
    np.testing.assert_array_equal(first, again)
    assert (first != other).all()


def test_lost_and_strayed_are_told_apart():
    error = np.array([[1.0, 1.0, 30.0, 1.0], [1.0, 25.0, 1.0, 1.0]])
    outcome = Outcome(error, error, error, outside=np.array([0, 0, 4, 5]))
    np.testing.assert_array_equal(outcome.lost(20.0), [False, True, False, True])
    np.testing.assert_array_equal(outcome.strayed(20.0), [False, True, True, False])
