"""The size of a box as evidence."""

import numpy as np

from vidtrack.associate.gate import Pairs
from vidtrack.associate.shape import Shape

BOX = np.array([[10.0, 10.0, 30.0, 20.0]])


def one_pair(d2, limit):
    """A gated pair of track 0 and measurement 0."""
    one, none = np.zeros(1, np.int64), np.zeros(1)
    d2 = np.array([d2])
    return Pairs(one, one, d2, d2, none, none, d2, np.array([limit]), np.array([0, 1]))


def stays(predicted, box, d2=0.0, limit=9.0):
    """Whether one gated pair survives the comparison of its boxes."""
    return len(Shape().weigh(one_pair(d2, limit), np.array(predicted, float), np.array(box, float))) == 1


def test_the_same_box_fits_and_costs_nothing():
    weighed = Shape().weigh(one_pair(2.0, 9.0), BOX, BOX)
    np.testing.assert_array_equal(weighed.cost, [2.0])
    np.testing.assert_array_equal(weighed.log_l, [0.0])


def test_another_size_does_not_fit():
    assert not stays(BOX, [[10, 10, 90, 60]])


def test_a_box_clear_of_the_prediction_does_not_fit():
    assert not stays(BOX, BOX + np.array([25, 0, 0, 0]))


def test_a_track_without_a_box_takes_any_size():
    assert stays([[np.nan] * 4], [[10, 10, 90, 60]])


def test_a_box_of_no_size_fits_nothing():
    assert not stays(BOX, [[10, 10, 0, 20]])
    assert not stays([[10, 10, 0, 20]], BOX)
    assert not stays([[10, 10, 0, 20]], [[10, 10, 0, 20]])
