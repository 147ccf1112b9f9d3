import numpy as np
import pytest

from vidtrack.papers.p000 import fig1, fig2

CLOSED = {
    4.0: (1.7123239599e-03, 9.8300768308e-04, 5.7638777959e-03),
    2.0: (7.6284705917e-04, 3.9574461048e-04, 2.4011433981e-03),
}
EXACT = {4.0: (1.29251102e-03, 6.69499613e-04, 4.28114532e-03), 2.0: (5.67357784e-04, 2.69418193e-04, 1.71168616e-03)}


@pytest.fixture(scope="module")
def first():
    return fig1.reproduce(None, 0)


@pytest.mark.parametrize("cell", CLOSED)
def test_the_thresholds_of_figure_1(first, cell):
    rows = [row for row in first.rows if row["cell_volume"] == cell]
    assert [row["k"] for row in rows] == list(range(1, 36))
    at = [rows[k - 1] for k in (1, 3, 35)]
    np.testing.assert_allclose([row["p_fa_closed_form"] for row in at], CLOSED[cell], rtol=1e-9)
    np.testing.assert_allclose([row["p_fa_exact"] for row in at], EXACT[cell], rtol=1e-6)


def test_figure_1_is_of_the_same_order_and_costs_little(first):
    assert "1.32 to 1.77 times" in first.verdict
    assert "0.24% below" in first.verdict


def test_figure_2_shows_fewer_lost_tracks_with_the_best_threshold():
    result = fig2.reproduce(400, 1)
    lost = {(row["cell_volume"], row["threshold"]): row["lost_share"] for row in result.rows}
    assert lost[4.0, "P_F*"] < lost[4.0, "fixed 1e-2"] < lost[2.0, "fixed 1e-2"]
    assert result.verdict.startswith("the claim holds")
    assert "experiments of 100 runs" in result.verdict


def test_the_confidence_interval_of_a_median_holds_it():
    rng = np.random.default_rng(2)
    middle, low, high = fig2.median(rng.standard_normal((500, 400)))
    assert (low < middle).all()
    assert ((low < 0) & (high > 0)).mean() == pytest.approx(0.95, abs=0.04)
