"""Boxes that are placed in the picture and that follow what was seen of them."""

import numpy as np

from vidtrack.tracking.boxes import absolute, follow

NOBODY = np.zeros(2, bool)


def test_boxes_are_placed_by_the_first_two_axes_of_their_points():
    box = np.array([[-2.0, -1.0, 4.0, 2.0]])
    np.testing.assert_array_equal(absolute(box, np.array([[10.0, 20.0, 99.0]])), [[8.0, 19.0, 4.0, 2.0]])
    np.testing.assert_array_equal(box, [[-2.0, -1.0, 4.0, 2.0]])


def test_a_box_moves_by_its_share_and_stays_where_nothing_was_taken():
    box = np.array([[0.0, 0.0, 4.0, 2.0], [0.0, 0.0, 4.0, 2.0]])
    seen = np.array([[9.0, 9.0, 9.0, 9.0], [1.0, 2.0, 8.0, 4.0]])
    follow(box, seen, np.array([1, -1]), NOBODY, np.array([0.25, 0.25]))
    np.testing.assert_array_equal(box, [[0.25, 0.5, 5.0, 2.5], [0.0, 0.0, 4.0, 2.0]])


def test_a_first_box_and_one_to_be_taken_at_once_are_taken_whole():
    box = np.array([[np.nan] * 4, [0.0, 0.0, 4.0, 2.0]])
    seen = np.array([[1.0, 2.0, 8.0, 4.0], [3.0, 4.0, 5.0, 6.0]])
    follow(box, seen, np.array([0, 1]), np.array([False, True]), np.array([0.25, 0.25]))
    np.testing.assert_array_equal(box, seen)
