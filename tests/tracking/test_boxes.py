"""Boxes that are placed in the picture and that follow what was seen of them."""

import numpy as np
import pytest

from vidtrack.errors import ScanError
from vidtrack.tracking.boxes import absolute, box_scan, follow

NOBODY = np.zeros(2, bool)


def test_boxes_are_placed_by_the_first_two_axes_of_their_points():
    box = np.array([[-2.0, -1.0, 4.0, 2.0]])
    np.testing.assert_array_equal(absolute(box, np.array([[10.0, 20.0, 99.0]])), [[8.0, 19.0, 4.0, 2.0]])
    np.testing.assert_array_equal(box, [[-2.0, -1.0, 4.0, 2.0]])


def test_a_box_moves_by_its_share_and_stays_where_nothing_was_taken():
    box = np.array([[0.0, 0.0, 4.0, 2.0], [0.0, 0.0, 4.0, 2.0]])
    seen = np.array([[9.0, 9.0, 9.0, 9.0], [1.0, 2.0, 8.0, 4.0]])
    follow(box, seen, np.array([1, -1]), NOBODY, 0.25, np.array([9, 9]))
    np.testing.assert_array_equal(box, [[0.25, 0.5, 5.0, 2.5], [0.0, 0.0, 4.0, 2.0]])


def test_a_first_box_and_one_to_be_taken_at_once_are_taken_whole():
    box = np.array([[np.nan] * 4, [0.0, 0.0, 4.0, 2.0]])
    seen = np.array([[1.0, 2.0, 8.0, 4.0], [3.0, 4.0, 5.0, 6.0]])
    follow(box, seen, np.array([0, 1]), np.array([False, True]), 0.25, np.array([9, 9]))
    np.testing.assert_array_equal(box, seen)


def test_a_box_scan_measures_the_centres_of_its_boxes():
    scan = box_scan(2, [[10, 20, 40, 20], [0, 0, 2, 4]], score=[1, 0])
    np.testing.assert_array_equal(scan.z, [[30, 30], [1, 2]])
    np.testing.assert_array_equal(absolute(scan.box, scan.z), [[10, 20, 40, 20], [0, 0, 2, 4]])
    np.testing.assert_allclose(np.sqrt(scan.R[:, 0, 0]), [0.05 * 40, 0.5])
    assert scan.score.tolist() == [1.0, 0.0]


def test_an_empty_list_of_boxes_is_a_scan():
    assert box_scan(0.0, []).box.shape == (0, 4)


@pytest.mark.parametrize("boxes", [[1, 2, 3, 4], [[1, 2, 3]], [[30, 30, -20, 5]], [[0, 0, np.nan, 5]]])
def test_what_is_no_box_is_refused(boxes):
    with pytest.raises(ScanError, match=r"box|measurement 0 is not finite"):
        box_scan(0.0, boxes)
