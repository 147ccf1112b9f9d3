"""Slices of a video: equal, without gaps, each with its warm-up."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.run.slices.cuts import OVERLAP_S, cuts

SECONDS = st.floats(1.0, 1e5)


@given(SECONDS, SECONDS, st.floats(0.0, 1e4), st.none() | st.floats(0.0, 300.0))
def test_slices_cover_the_span_once(length_s, slice_s, begin_s, warm_s):
    found = cuts(begin_s, None, begin_s + length_s, max(slice_s, length_s / 500), warm_s)
    assert found[0].begin_s == found[0].from_s == begin_s
    assert found[-1].end_s is None
    assert all(before.end_s == after.begin_s for before, after in pairwise(found))
    assert [one.number for one in found] == list(range(len(found)))
    for one in found[1:]:
        assert begin_s - 1e-6 <= one.from_s <= one.begin_s - min(warm_s or 0.0, one.begin_s - begin_s) + 1e-6
        assert one.from_s <= max(one.kept_from_s, begin_s) + 1e-6


@given(st.floats(0.0, 1000.0))
def test_slices_that_go_on_from_each_other_share_no_frame(time_s):
    found = cuts(0.0, 1000.0 + 1e-9, 1e9, 77.0, None)
    assert [one.holds(time_s) for one in found].count(True) == 1


def test_both_neighbours_track_the_overlap():
    first, second = cuts(0.0, 100.0, 1e9, 50.0, 20.0)
    assert (first.to_s, second.kept_from_s, second.from_s) == (50 + OVERLAP_S, 50 - OVERLAP_S, 30.0)
    assert second.to_s == 100 + OVERLAP_S


@pytest.mark.parametrize(("length_s", "count"), [(10.0, 1), (149.0, 1), (151.0, 2), (1000.0, 10)])
def test_the_length_is_as_near_to_the_wanted_one_as_it_divides(length_s, count):
    assert len(cuts(0.0, None, length_s, 100.0, 10.0)) == count
