"""Times always increase and follow the stamps wherever these are sane."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from vidtrack.video.clock import LONGEST_WAIT, increasing_times, nominal_rate, stamp_rate

stamp = st.one_of(st.none(), st.integers(-100_000, 100_000))


def repaired(stamps, period=10.0):
    pairs = list(increasing_times(zip(stamps, range(len(stamps)), strict=True), period))
    assert [item for _, item in pairs] == list(range(len(stamps)))
    return [time for time, _ in pairs]


@given(st.lists(stamp, max_size=60), st.integers(1, 5000))
def test_times_always_increase_from_0(stamps, period):
    times = repaired(stamps, period)
    assert times[:1] in ([], [0])
    assert (np.diff(times) > 0).all()


@given(st.sets(st.integers(-(10**9), 10**9), min_size=1, max_size=60), st.integers(1, 5000))
def test_increasing_stamps_are_kept_to_the_digit(stamps, period):
    stamps = sorted(stamps)
    assert repaired(stamps, period) == [stamp - stamps[0] for stamp in stamps]


@given(st.lists(st.integers(1, 1000), min_size=4, max_size=40), stamp, st.data())
def test_one_bad_stamp_moves_no_other_time(steps, wrong, data):
    """Unless it lies between the two before it: then the second of these may be the wrong one."""
    stamps = np.cumsum(steps).tolist()
    bad = data.draw(st.integers(2, len(stamps) - 2))
    assume(wrong is None or not stamps[bad - 2] < wrong < stamps[bad - 1])
    assume(wrong != stamps[bad + 1])  # of two equal stamps the first is kept
    times = repaired([*stamps[:bad], wrong, *stamps[bad + 1 :]])
    del times[bad], stamps[bad]
    assert times == [stamp - stamps[0] for stamp in stamps]


@pytest.mark.parametrize(
    ("stamps", "times"),
    [
        ([], []),
        ([7], [0]),
        ([None] * 20, [10 * i for i in range(20)]),
        ([5] * 20, [10 * i for i in range(20)]),
        ([0, 10, 10, 20, 30], [0, 10, 15, 20, 30]),
        ([0, 0, 20, 20, 40, 40], [0, 10, 20, 30, 40, 50]),
        ([0, 10, None, 500, 510], [0, 10, 20, 500, 510]),
        ([0, 10, 9999, 30, 40], [0, 10, 20, 30, 40]),
        ([9999, 0, 10, 20], [0, 10, 20, 30]),
        ([50, 60, 0, 10, 20], [0, 10, 20, 30, 40]),
        ([None, None, 90, 100], [0, 10, 20, 30]),
    ],
)
def test_repair(stamps, times):
    assert repaired(stamps) == pytest.approx(times)


def test_few_items_are_held_back():
    seen = []

    def source():
        for i in range(100):
            seen.append(i)
            yield None, i

    next(increasing_times(source(), 1.0))
    assert len(seen) <= LONGEST_WAIT + 1


def test_rate_ignores_gaps_and_rounding():
    assert stamp_rate([0, 33, 67, 100, 133, 5000, 5033]) == pytest.approx(30 / 1000, rel=0.01)
    assert stamp_rate([0, 0, 80, 80, 160, 160]) == pytest.approx(25 / 1000)
    assert stamp_rate([3, 1, 2, 0]) == 1
    assert stamp_rate([5, 5, 5]) is None
    assert stamp_rate([]) is None


@pytest.mark.parametrize(
    ("header", "measured", "trusted"),
    [
        (30000 / 1001, 29.8, 30000 / 1001),
        (0, 25, 25),
        (1000, 25, 25),
        (60, 30, 30),
        (25, None, 25),
        (0, None, None),
        (1000, None, None),
        (1000, 1000, None),
    ],
)
def test_nominal_rate(header, measured, trusted):
    assert nominal_rate(header, measured) == trusted
