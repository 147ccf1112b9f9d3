"""What the border of the picture cuts."""

import numpy as np

from vidtrack.tracking.picture.border import Border

PICTURE = Border(100, 80)
BOXES = np.array([[1.0, 20.0, 10.0, 10.0], [50.0, 1.0, 10.0, 10.0], [95.0, 75.0, 10.0, 10.0], [50.0, 40.0, 10.0, 10.0]])
CUT = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 0]], bool)


def states(xy, var):
    """States [x, vx, y, vy] at rest and their covariances."""
    x, P = np.zeros((len(xy), 4)), np.zeros((len(xy), 4, 4))
    x[:, ::2], P[:, 0, 0], P[:, 2, 2] = xy, var[:, 0], var[:, 1]
    return x, P


def test_a_box_is_cut_on_the_sides_that_reach_the_border():
    np.testing.assert_array_equal(PICTURE.sides(BOXES), CUT)
    np.testing.assert_array_equal(PICTURE.cut(BOXES), [True, True, True, False])


def test_without_a_border_nothing_is_cut():
    assert not Border().sides(BOXES).any()
    assert (Border().in_view(*states(BOXES[:, :2] - 1000, BOXES[:, 2:])) == 1).all()


def test_the_probability_to_be_in_view_is_the_share_of_the_position_within_the_border():
    xy = np.array([[50.0, 40.0], [99.5, 40.0], [99.5, 79.5], [-30.0, 40.0], [3.0, 70.0]])
    var = np.array([[4.0, 4.0], [4.0, 4.0], [9.0, 1.0], [25.0, 25.0], [16.0, 100.0]])
    found = PICTURE.in_view(*states(xy, var))
    np.testing.assert_allclose(found[:4], [1, 0.5, 0.25, 0], atol=1e-8)
    drawn = xy[4] + np.sqrt(var[4]) * np.random.default_rng(1).normal(size=(100_000, 2))
    within = np.all((drawn > -0.5) & (drawn < [99.5, 79.5]), axis=1)
    assert abs(found[4] - within.mean()) < 0.006


def test_cut_boxes_are_drawn_out_to_the_border_and_no_farther():
    drawn = PICTURE.reaching(BOXES - [0.0, 0.0, 8.0, 8.0], CUT)
    np.testing.assert_array_equal(
        drawn, [[0.0, 20.0, 3.0, 2.0], [50.0, 0.0, 2.0, 3.0], [95.0, 75.0, 5.0, 5.0], [50.0, 40.0, 2.0, 2.0]]
    )
