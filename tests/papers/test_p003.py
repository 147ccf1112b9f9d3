"""The experiments of paper 003, with fewer runs than `vidtrack reproduce` has.

Expected means and standard errors are of an independent program with 100 runs each (SPEC 003).
"""

import numpy as np
import pytest

from vidtrack.papers.p003 import fig7, fig8, fig9, fig10, table2
from vidtrack.papers.p003.comparison import COMPARISONS, mean_abs, run
from vidtrack.papers.p003.experiment import SCANS, TIMES, polar
from vidtrack.papers.p003.scenario import WAYS, study
from vidtrack.simulate.radar_scenarios import altitude, incoming, speed

RUNS = 25
NORMAL, GLINT, RECONSTRUCTION = COMPARISONS
EXPECTED = {
    "measurement": (3.961, 0.019),
    "Kalman, 49 m/s²": (2.438, 0.020),
    "alpha-beta, 49 m/s²": (2.438, 0.020),
    "bootstrap, 49 m/s²": (2.437, 0.020),
    "bootstrap, 24.5 m/s²": (2.527, 0.025),
    "SIR of fig. 3, 49 m/s²": (4.342, 0.047),
    "SIR of fig. 3, 24.5 m/s²": (4.769, 0.056),
    "SIS of table 1": (5.967, 0.033),
    "Kalman, 2 m/s²": (14.273, 0.033),
    "Kalman, 1 m/s²": (28.601, 0.032),
}
EXPECTED_GLINT = {
    "measurement": (5.593, 0.056),
    "Kalman, 49 m/s²": (3.709, 0.051),
    "bootstrap, 49 m/s²": (2.751, 0.026),
    "SIR of fig. 3, 49 m/s²": (5.200, 0.080),
}
"""Mean absolute range errors [m] after 3 s, and their standard errors."""


@pytest.fixture(scope="module")
def normal():
    return run(NORMAL, RUNS, np.random.default_rng(11))


@pytest.fixture(scope="module")
def glint():
    return run(GLINT, RUNS, np.random.default_rng(12))


def within(errors, title, expected, expected_se):
    mean, se = mean_abs(errors[title])
    return abs(mean - expected) < 4 * np.hypot(se, expected_se)


@pytest.mark.parametrize("title", EXPECTED)
def test_mean_errors_with_normal_noise(normal, title):
    assert within(normal, title, *EXPECTED[title])


@pytest.mark.parametrize("title", EXPECTED_GLINT)
def test_mean_errors_with_glint(glint, title):
    assert within(glint, title, *EXPECTED_GLINT[title])


def test_without_resampling_the_particles_lose_the_target(normal):
    assert mean_abs(normal["SIS, 24.5 m/s²"])[0] > 20


def test_glint_is_where_a_particle_filter_wins(glint):
    assert mean_abs(glint["bootstrap, 49 m/s²"])[0] < 0.85 * mean_abs(glint["Kalman, 49 m/s²"])[0]


def test_the_paper_s_numbers_come_out_of_poorly_tuned_competitors():
    errors = run(RECONSTRUCTION, RUNS, np.random.default_rng(13))
    found = {title: mean_abs(error)[0] for title, error in errors.items()}
    assert found["alpha-beta, 3.24 m/s²"] == pytest.approx(5.69, abs=0.15)
    assert found["Kalman, 1.37 m/s²"] == pytest.approx(12.94, abs=0.15)
    assert found["SIS of table 1"] == pytest.approx(7.67, abs=0.5)
    assert found["measurement"] == pytest.approx(2.51, abs=0.1)
    assert found["Kalman, 35 m/s²"] == pytest.approx(1.66, abs=0.1)


def test_the_speed_manoeuvre_is_that_of_the_specification():
    """Closed form: from 60 km, 2.5 g from 10 s on for 6.118 s."""
    truth = polar(speed(None)[0].flight)
    k = [0, 77, 78, 100, 124, 125, 230]
    expected = [60000, 58000, 57973.81922225502, 57293.22571576151, 56322.50611717828, 56277.054114021885,
                51504.32684129461]  # fmt: skip
    np.testing.assert_allclose(truth[k, 0], expected, rtol=1e-12)
    assert len(truth) == SCANS
    assert TIMES[-1] == pytest.approx(30.0)


@pytest.mark.parametrize(
    ("flight", "expected"),
    [
        (incoming, [(1.539, 1.537, 2.101), (0.01231, 0.01232, 0.01655), (0.01232, 0.01231, 0.01687)]),
        (altitude, [(2.269, 2.275, 3.875), (0.01233, 0.01232, 0.01723), (0.02147, 0.02148, 0.03774)]),
    ],
)
def test_mean_errors_of_flights(flight, expected):
    """By channel; of the tuned Kalman filter, the bootstrap filter and the paper's, 100 runs each."""
    each = study(flight(None)[0].flight, RUNS, np.random.default_rng(14))
    names = ("Kalman, tuned", "particles, bootstrap", "particles, the paper's")
    for channel, values in enumerate(expected):
        found = [each.mean_abs(name, channel) for name in names]
        np.testing.assert_allclose(found, values, rtol=0.12)


@pytest.mark.parametrize("figure", [fig7, fig8, fig9, fig10])
def test_figures_have_a_row_for_every_filter_and_a_verdict(figure):
    result = figure.reproduce(2, 0)
    assert {row["filter"] for row in result.rows} == {way.name for way in WAYS}
    assert len({tuple(row) for row in result.rows}) == 1
    assert "Kalman" in result.verdict
    assert "nan" not in result.verdict


def test_table_2_shows_the_paper_s_numbers_beside_ours():
    result = table2.reproduce(1, 0)
    paper = {row["filter"]: row["paper"] for row in result.rows}
    assert paper["SIR of fig. 3"] == 2.51
    assert paper["Kalman"] == 12.94
    assert paper["bootstrap"] is None
    assert "does not hold" in result.verdict
