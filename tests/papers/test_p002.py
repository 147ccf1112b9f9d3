import numpy as np
import pytest

from vidtrack.papers.p002 import fig1, fig2


@pytest.fixture(scope="module", params=[fig1, fig2])
def figure(request):
    return request.param, request.param.reproduce(500, 3)


def test_the_table_has_every_scan_of_every_case(figure):
    module, result = figure
    assert len(result.rows) == 50 * len(module.CASES)
    assert {row["case"] for row in result.rows} == {case.name for case in module.CASES}


def test_the_corrected_prediction_is_nearer_to_the_first_scan_s_error(figure):
    _, result = figure
    for row in result.rows:
        if row["k"] == 1:
            assert abs(row["actual_all"] - row["corrected"]) < 4 * row["actual_all_se"]
            assert row["paper_33"] < row["corrected"]


def test_the_plain_strongest_neighbour_loses_more(figure):
    _, result = figure
    assert all(row["snf_lost_share"] > row["lost_share"] for row in result.rows)


def test_heavy_clutter_loses_tracks_that_the_printed_prediction_promises():
    result = fig2.reproduce(300, 4)
    heavy = result.rows[-1]
    assert heavy["case"] == "b = 1, c = 1"
    assert heavy["paper_33"] == pytest.approx(4.470, abs=1e-3)
    assert heavy["corrected"] == pytest.approx(54.558, abs=1e-3)
    assert heavy["lost_share"] > 0.25
    assert np.isfinite([row["actual_kept"] for row in result.rows]).all()
