"""What the border of the picture cuts."""

import numpy as np

from vidtrack.tracking.picture.border import Border

PICTURE = Border(100, 80)
BOXES = np.array([[1.0, 20.0, 10.0, 10.0], [50.0, 1.0, 10.0, 10.0], [95.0, 75.0, 10.0, 10.0], [50.0, 40.0, 10.0, 10.0]])
CUT = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 0]], bool)


def test_a_box_is_cut_on_the_sides_that_reach_the_border():
    np.testing.assert_array_equal(PICTURE.sides(BOXES), CUT)
    np.testing.assert_array_equal(PICTURE.cut(BOXES), [True, True, True, False])


def test_without_a_border_nothing_is_cut():
    assert not Border().sides(BOXES).any()
    assert not Border().outside(BOXES[:, :2] - 1000).any()


def test_a_box_leaves_where_it_moves_towards_the_border_that_cuts_it():
    outwards = np.array([[-5.0, 0.0], [0.0, -5.0], [0.0, 5.0], [5.0, 5.0]])
    np.testing.assert_array_equal(PICTURE.leaving(BOXES, outwards), [True, True, True, False])
    assert not PICTURE.leaving(BOXES, -outwards).any()


def test_cut_boxes_are_drawn_out_to_the_border_and_no_farther():
    drawn = PICTURE.reaching(BOXES - [0.0, 0.0, 8.0, 8.0], CUT)
    np.testing.assert_array_equal(
        drawn, [[0.0, 20.0, 3.0, 2.0], [50.0, 0.0, 2.0, 3.0], [95.0, 75.0, 5.0, 5.0], [50.0, 40.0, 2.0, 2.0]]
    )
