"""Entries into zones, one moment after the other."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.traffic.zone_entries import Entry, ZoneEntries, contains

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])


def entries(track, x, step_s=0.25, zones=None):
    """The entries of one track that is at (x, 5) at each moment."""
    looking = ZoneEntries(zones or {"square": SQUARE})
    found = []
    for k, place in enumerate(x):
        here = [] if place is None else [[place, 5.0]]
        found += looking.step(step_s * k, np.array([track] * len(here), np.int64), np.array(here).reshape(-1, 2))
    return found


def test_a_vehicle_enters_once_halfway_between_two_positions():
    assert entries(7, [-3, -1, 1, 5, 9, 11, 13]) == [Entry(0.375, "square", 7, True)]


def test_one_whose_track_begins_inside_is_told_as_such():
    assert entries(7, [5, 6, 20]) == [Entry(0.0, "square", 7, False)]


def test_a_vehicle_that_jitters_on_the_border_enters_once_and_one_that_comes_back_again():
    assert len(entries(7, [-1, 1, -1, 1, -1, 1])) == 1
    assert len(entries(7, [-1, 1, *[-1] * 5, 1])) == 2


def test_a_position_that_is_not_known_is_in_no_zone():
    assert entries(7, [np.nan, np.nan]) == []


def test_zones_may_overlap():
    wide = SQUARE * [4, 1]
    assert [one.zone for one in entries(7, [-1, 5, 15, 35, 45], zones={"a": SQUARE, "b": wide})] == ["a", "b"]


def test_it_forgets_tracks_that_are_gone():
    looking = ZoneEntries({"square": SQUARE})
    for number in range(100):
        looking.step(number / 10, np.array([number]), np.array([[5.0, 5.0]]))
    assert len(looking._id) == 1


@given(st.lists(st.tuples(st.floats(-5, 15), st.floats(-5, 15)), min_size=1, max_size=20))
def test_a_triangle_contains_what_is_on_the_inner_side_of_all_its_sides(points):
    corners, xy = np.array([[0.0, 0.0], [10.0, 1.0], [3.0, 9.0]]), np.array(points)
    sides = np.roll(corners, -1, axis=0) - corners
    from_corner = xy[:, None] - corners
    cross = sides[:, 0] * from_corner[..., 1] - sides[:, 1] * from_corner[..., 0]
    clear = np.abs(cross).min(axis=1) > 1e-6
    assert np.array_equal(contains(corners, xy)[clear], (cross > 0).all(axis=1)[clear])
