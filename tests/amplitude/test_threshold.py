import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.amplitude.densities import linear
from vidtrack.amplitude.reduction import gate_volume, q2
from vidtrack.amplitude.threshold import ThresholdController, closed_form, optimum
from vidtrack.errors import ConfigError

STAR = [  # dB, cells, closed form, optimum of the exact q2
    (3, 1, 1.0, 1.0),
    (3, 10, 0.3857371287336597, 0.26350967),
    (3, 1000, 2.416507905538507e-05, 1.2223919e-4),
    (5, 3, 0.40073466011275505, 1.0),
    (5, 100, 0.0014376536321132555, 0.00230727645),
    (10, 1000, 8.399434016146147e-05, 6.2249628e-05),
    (13, 10, 0.010445969044137917, 0.0080616862),
    (16, 300, 0.00016865635302773453, 0.000105413397),
    (20, 1, 0.025942832874239402, 0.027431032),
    (20, 10000, 2.243145196000451e-06, 1.44808646e-06),
]


@pytest.mark.parametrize(("db", "cells", "star", "exact"), STAR)
def test_closed_form_and_exact_optimum(db, cells, star, exact):
    p_fa, clamped = closed_form(linear(db), cells)
    assert p_fa == pytest.approx(star, rel=1e-9)
    assert clamped == (star == 1.0)
    assert optimum(linear(db), cells) == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(
    ("snr", "cells", "p_fa", "clamped"),
    [
        (0.3, 100, 1.0, True),
        (0.57, 100, 1.0, True),
        (1.57, 100, 1.0, True),
        (1.6, 10, 1.0, True),
        (1.6, 100, 0.7684090669402387, False),
        (1.7, 1000, 9.565668015386482e-05, False),
    ],
)
def test_where_the_closed_form_does_not_hold_it_is_clamped_and_says_so(snr, cells, p_fa, clamped):
    found, flag = closed_form(snr, cells)
    assert found == pytest.approx(p_fa, rel=1e-9)
    assert flag == clamped


def test_at_low_snr_the_exact_optimum_can_be_inside_although_the_fit_has_none():
    np.testing.assert_allclose(optimum(1.5, [10, 100, 1000]), [1.0, 9.596564e-3, 1.850620e-4], rtol=1e-6)


def test_the_largest_p_fa_is_respected_and_flagged():
    p_fa, clamped = closed_form(10.0, np.array([1.0, 3.0, 100.0]), p_fa_max=0.1)
    np.testing.assert_array_equal(clamped, [True, False, False])
    assert p_fa[0] == 0.1
    assert (optimum(10.0, [0.5, 100.0], p_fa_max=0.1) <= 0.1).all()


@settings(deadline=None)
@given(st.floats(0, 1e4), st.floats(1e-3, 1e9), st.floats(1e-6, 1))
def test_the_closed_form_is_always_a_probability(snr, cells, p_fa_max):
    p_fa, _ = closed_form(snr, cells, p_fa_max)
    assert 0 <= p_fa <= p_fa_max


@pytest.mark.parametrize("db", [2, 5, 10, 16])
def test_the_controller_loses_nothing_against_the_exact_optimum(db):
    snr, cell = linear(db), 4.0
    scale = np.geomspace(0.3, 3e4, 200)
    S = scale[:, None, None] * np.array([[2.0, 0.5], [0.5, 1.0]])
    p_fa = ThresholdController(snr, cell).p_fa(S)
    cells = gate_volume(S, 4.0) / cell
    best = optimum(snr, cells)
    reached, most = (q2(p ** (1 / (1 + snr)), cells * p) for p in (p_fa, best))
    assert (1 - reached / most).max() < 1e-3
    assert np.median(np.abs(p_fa / best - 1)) < 1e-3


def test_the_controller_in_closed_form_is_the_paper_s():
    S = np.array([[[6.0025, 0.0], [0.0, 6.0025]]])
    p_fa = ThresholdController(10.0, 4.0, method="closed-form").p_fa(S)
    np.testing.assert_allclose(p_fa, 0.0017123239598611046, rtol=1e-9)


def test_the_closed_form_is_refused_outside_its_fit():
    with pytest.raises(ConfigError, match="gate of 4"):
        ThresholdController(10.0, 4.0, gate=3.0, method="closed-form")
    with pytest.raises(ConfigError, match="2 dimensions"):
        ThresholdController(10.0, 4.0, method="closed-form").p_fa(np.eye(3)[None])
    with pytest.raises(ConfigError, match="cell_volume"):
        ThresholdController(10.0, 0.0)
    with pytest.raises(ConfigError, match="p_fa_max"):
        ThresholdController(10.0, 1.0, p_fa_max=1.5)


def test_cells_of_positions_widen_with_the_distance():
    controller = ThresholdController(10.0, 150.0 * 0.02, origin=(100.0, 0.0))
    np.testing.assert_allclose(controller.volumes(np.array([[100.0, 2000.0], [1100.0, 0.0]])), [6000.0, 3000.0])
    space = ThresholdController(10.0, 2.0, origin=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(space.volumes(np.array([[3.0, 0.0, 4.0]])), [2.0 * 3.0 * 5.0])
    S = np.tile(1e4 * np.eye(2), (2, 1, 1))
    near, far = controller.p_fa(S, np.array([3000.0, 6000.0]))
    assert far == pytest.approx(ThresholdController(10.0, 6000.0).p_fa(S)[0])
    assert near < far, "more cells in the gate ask for a higher threshold"
