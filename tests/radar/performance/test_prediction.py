import numpy as np
import pytest

from vidtrack.amplitude.densities import RAYLEIGH, Weibull, detection_probability, linear
from vidtrack.amplitude.reduction import q2, q2_fit
from vidtrack.amplitude.threshold import closed_form, optimum
from vidtrack.errors import ConfigError
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.radar.performance.prediction import (
    Scenario,
    normalised,
    pda_factor,
    position_error,
    predict,
    psn_factor,
    steady_state,
)
from vidtrack.radar.performance.psn_threshold import best_psn_threshold

PAPER_002 = normalised(0.16, 4.0, 0.1)
HYCA = [  # dB, P_FA, clutter, eq. (33) and corrected at k = 1, 2, 50
    (16, 1e-1, RAYLEIGH, (1.8120569568641829, 1.7529279523410881, 1.3353770659952788),
     (1.907101489532544, 1.906828608790755, 1.4173280331511797)),
    (13, 1e-5, RAYLEIGH, (2.2904043936456175, 2.659436458462611, 2.0440746293248426),
     (2.317923730625515, 2.729070371114081, 2.1082419730433934)),
    (16, 1e-3, Weibull(2, np.log(2)), (1.6958934489615747, 1.5874350546370872, 1.2610856069616063),
     (1.7731556774515842, 1.6952478854722612, 1.311185097212699)),
    (16, 1e-3, Weibull(1.5, np.log(2)), (2.044460550007472, 2.159329837409263, 1.5508832244381037),
     (2.1945948758375633, 2.4706226347153946, 1.7812665038099698)),
    (16, 1e-3, Weibull(1, 1), (2.576755234541695, 3.45405281952274, 4.470415725754652),
     (2.806774247497348, 4.115553326717735, 54.55815071955961)),
]  # fmt: skip


@pytest.mark.parametrize(("db", "p_fa", "clutter", "paper", "corrected"), HYCA)
def test_strongest_neighbour_as_printed_and_corrected(db, p_fa, clutter, paper, corrected):
    for mode, expected in (("paper", paper), ("corrected", corrected)):
        factor = psn_factor(PAPER_002, linear(db), p_fa, clutter, mode)
        error = position_error(PAPER_002, predict(PAPER_002, factor, 50))[[0, 1, 49]]
        np.testing.assert_allclose(error, expected, rtol=1e-9)


def test_in_heavy_clutter_the_printed_form_settles_and_the_corrected_one_does_not():
    settles, grows = (psn_factor(PAPER_002, linear(16), 1e-3, Weibull(1, 1), mode) for mode in ("paper", "corrected"))
    assert position_error(PAPER_002, steady_state(PAPER_002, settles)) == pytest.approx(4.4628, abs=1e-4)
    assert steady_state(PAPER_002, grows) is None


@pytest.mark.parametrize(
    ("cell", "star_ke", "star_exact", "fixed_ke", "fixed_exact"),
    [
        (4.0, 2.4166570762929878, 2.470105327642906, 2.5396729587796028, 2.583078269261201),
        (2.0, 2.4769699809379997, 2.5262051833026153, 2.7150811872688294, 2.7351292112746846),
    ],
)
def test_first_scan_of_paper_000(cell, star_ke, star_exact, fixed_ke, fixed_exact):
    scenario = normalised(0.01, 4.0, cell)
    p_d = float(detection_probability(1e-2, 10.0))

    def with_best_threshold(best, q):
        def factor(cells):
            p_fa = best(cells)
            return float(q(detection_probability(p_fa, 10.0), cells * p_fa))

        return factor

    for factor, expected in (
        (with_best_threshold(lambda n: closed_form(10.0, n)[0], q2_fit), star_ke),
        (with_best_threshold(lambda n: optimum(10.0, n), q2), star_exact),
        (pda_factor(scenario, p_d, 1e-2, fit=True), fixed_ke),
        (pda_factor(scenario, p_d, 1e-2), fixed_exact),
    ):
        error = position_error(scenario, predict(scenario, factor, 1))
        assert error[0] == pytest.approx(expected, rel=1e-9)


def test_a_fixed_threshold_in_fine_cells_diverges():
    scenario = normalised(0.01, 4.0, 2.0)
    factor = pda_factor(scenario, float(detection_probability(1e-2, 10.0)), 1e-2)
    assert steady_state(scenario, factor) is None
    assert position_error(scenario, predict(scenario, factor, 35))[-1] == pytest.approx(34.810, abs=1e-3)


def test_with_every_measurement_sure_it_is_the_kalman_filter():
    scenario = normalised(0.16, 4.0, 0.1)
    P = steady_state(scenario, lambda cells: 1.0)
    ahead = scenario.F @ P @ scenario.F.T + scenario.Q
    S = scenario.H @ ahead @ scenario.H.T + scenario.R
    K = ahead @ scenario.H.T @ np.linalg.inv(S)
    np.testing.assert_allclose(P, ahead - K @ S @ K.T, rtol=1e-8)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_any_dimension(dim):
    scenario = normalised(0.16, 4.0, 0.1, dim)
    for factor in (pda_factor(scenario, 0.9, 1e-3), psn_factor(scenario, 40.0, 1e-3)):
        P = predict(scenario, factor, 20)
        assert (np.linalg.eigvalsh(P) > 0).all()
        assert position_error(scenario, P)[-1] > np.sqrt(dim) * 0.5


def test_correlated_measurements_and_another_scan_time():
    R = np.array([[2.0, 0.5], [0.5, 1.0]])
    scenario = Scenario(ConstantVelocity(2, accel=0.3), R, 10 * np.eye(4), 4.0, 1.0, dt=2.0)
    np.testing.assert_allclose(scenario.F[:2, :2], [[1, 2], [0, 1]])
    np.testing.assert_allclose(scenario.Q[:2, :2], 0.09 * np.array([[4, 4], [4, 4]]))
    P = steady_state(scenario, pda_factor(scenario, 0.95, 1e-4))
    assert (np.linalg.eigvalsh(P) > 0).all()


def test_values_out_of_range_are_refused():
    with pytest.raises(ConfigError, match="q is -1"):
        normalised(-1.0, 4.0, 0.1)
    with pytest.raises(ConfigError, match="choose paper or corrected"):
        psn_factor(PAPER_002, 10.0, 0.1, mode="genie")
    with pytest.raises(ConfigError, match="gate 4"):
        pda_factor(normalised(0.16, 3.0, 0.1), 0.9, 0.1, fit=True)


def test_the_best_threshold_of_a_strongest_neighbour_filter_is_the_lowest():
    best = best_psn_threshold(PAPER_002, linear(16), p_fa_max=0.1)
    assert best.p_fa == 0.1
    assert best.error == pytest.approx(1.4173280337, rel=1e-9)
    within = psn_factor(PAPER_002, linear(16), best.p_fa_one_percent)
    assert position_error(PAPER_002, steady_state(PAPER_002, within)) == pytest.approx(1.01 * best.error, rel=1e-3)


def test_where_no_threshold_helps_there_is_no_error_to_show():
    best = best_psn_threshold(PAPER_002, linear(16), Weibull(1, 1))
    assert best.error is None
    assert best.p_fa_one_percent is None
