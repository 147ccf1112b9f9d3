import numpy as np
import pytest

from vidtrack.associate.hard import GNN, NN
from vidtrack.papers.p004 import fig1, fig2, fig3


def test_fig1_the_nearest_target_is_not_the_most_probable():
    distance, density = fig1.compare(fig1.Z)
    assert distance.argmin() == 1
    assert density.argmax() == 0
    normal = np.exp(-0.5 * (3.6 / 2.4) ** 2) / (2.4 * np.sqrt(2 * np.pi))
    assert density[0] == pytest.approx(normal, rel=1e-12)


def test_fig2_the_region_is_long_along_the_motion_and_takes_the_farther_measurement():
    _, cov = fig2.predicted()
    assert cov[0, 0] > 4 * cov[1, 1]
    assert cov[0, 1] == pytest.approx(0, abs=1e-12)
    rows = fig2.reproduce(None, 0).rows
    assert [row["chosen_by_distance"] for row in rows] == [0, 1]
    assert [row["chosen_by_region"] for row in rows] == [1, 0]
    assert [row["inside_0.95_region"] for row in rows] == [1, 0]


def test_fig3_axis_aligned_numbers_are_exact():
    frame = fig3.Frame.turned(0.0)
    assert frame.d2("euclidean") == pytest.approx(np.array([[64, 52], [20, 64]]), rel=1e-9)
    region = np.array([[16 / 9, 17], [40 / 9, 16 / 9]])
    assert frame.d2("mahalanobis") == pytest.approx(region, rel=1e-9)
    assert frame.d2("decoupled") == pytest.approx(region, rel=1e-9)


def test_fig3_turned_by_45_degrees_eq_8_is_plain_distance_and_the_full_covariance_does_not_change():
    frame = fig3.Frame.turned(np.pi / 4)
    assert frame.d2("decoupled") == pytest.approx(np.array([[64, 52], [20, 64]]) / 18.5, rel=1e-9)
    assert frame.d2("mahalanobis") == pytest.approx(np.array([[16 / 9, 17], [40 / 9, 16 / 9]]), rel=1e-9)


@pytest.mark.parametrize("method", [NN, GNN])
@pytest.mark.parametrize(
    ("turn", "distance", "taken"),
    [
        (0.0, "euclidean", [1, 0]),
        (0.0, "decoupled", [0, 1]),
        (0.0, "mahalanobis", [0, 1]),
        (np.pi / 4, "euclidean", [1, 0]),
        (np.pi / 4, "decoupled", [1, 0]),
        (np.pi / 4, "mahalanobis", [0, 1]),
    ],
)
def test_fig3_who_takes_what(method, turn, distance, taken):
    assert fig3.Frame.turned(turn).taken(distance, method) == taken
