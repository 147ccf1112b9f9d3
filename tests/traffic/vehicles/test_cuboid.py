"""The box of a cuboid, and its derivatives."""

import numpy as np
import pytest
from driven import CAMERA, CAR, GROUND, LORRY, edges_of

from vidtrack.traffic.vehicles.cuboid import box_edges


def box(state, heading):
    edge, by_state = np.empty(4), np.zeros((4, 5))
    e = np.array([np.sin(heading), np.cos(heading)])
    scale = box_edges(GROUND.homography, GROUND.pose().up, np.asarray(state, float), e, edge, by_state)
    return edge, by_state, scale


@pytest.mark.parametrize("size", [CAR, LORRY])
@pytest.mark.parametrize("heading", [0.1, 1.0, 2.5, 4.0])
def test_edges_are_those_of_the_projected_corners(size, heading):
    for at in ((1.0, 18.0), (-3.0, 40.0)):
        edge, _, scale = box([*at, *size], heading)
        assert edge == pytest.approx(edges_of([at], [heading], size)[0], abs=0.05)
        assert scale == pytest.approx(CAMERA.focal / at[1], rel=0.3)


def test_derivatives_are_those_of_differences():
    state, step = np.array([2.0, 25.0, *CAR]), 1e-5
    _, by_state, _ = box(state, 0.7)
    for k in range(5):
        change = step * np.eye(5)[k]
        differences = (box(state + change, 0.7)[0] - box(state - change, 0.7)[0]) / (2 * step)
        assert by_state[:, k] == pytest.approx(differences, abs=1e-3)


def test_no_box_behind_the_camera():
    assert np.isnan(box([0.0, -30.0, *CAR], 0.0)[0]).all()
