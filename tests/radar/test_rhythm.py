"""The rules by which times tell days, clocks that begin anew, and passes of an antenna."""

import numpy as np
import pytest

from vidtrack.radar.rhythm import begins_again, midnights, one_target_each, passes, whole_days


@pytest.mark.parametrize(
    ("back_to_s", "expected"),
    [
        ([1000], True),
        ([1000 + 790], True),  # 2 % of the 40,000 s before
        ([1000 + 810], False),
        ([1000, 9000], True),
        ([1000, 9000, 9000], False),
    ],
)
def test_a_clock_begins_again_near_where_it_began_in_half_of_its_steps_back(back_to_s, expected):
    pieces = [np.arange(1000, 41_001, 10), *(np.arange(t, 41_001, 10) for t in back_to_s)]
    back = np.cumsum([len(piece) for piece in pieces])[:-1]
    assert begins_again(np.concatenate(pieces).astype(float), back) is expected


@pytest.mark.parametrize(("back_to_s", "expected"), [(5, True), (6, False)])
def test_a_clock_that_began_just_before_begins_again_within_seconds(back_to_s, expected):
    assert begins_again(np.array([0.0, 10, 20, back_to_s]), np.array([3])) is expected


@pytest.mark.parametrize(
    ("first_s", "last_s", "expected"),
    [(0, 86_396, True), (60, 86_340, True), (64, 86_396, False), (0, 86_336, False), (30_000, 86_396, False)],
)
def test_days_are_whole_from_midnight_to_midnight(first_s, last_s, expected):
    assert whole_days(np.arange(first_s, last_s + 1, 4.0)) is expected


@pytest.mark.parametrize(
    ("times_s", "days"),
    [
        ([86_398, 2, 86_399, 3], [0, 1, 0, 1]),
        ([2, 86_398], [1, 0]),
        ([86_398, 70], [0, 0]),  # not within a minute
        ([86_401, 2], [0, 0]),  # no times of day
        ([20, 86_390, 75, 80], [0, 0, 0, 0]),  # one wrong time, of which only the step to it is within a minute
        ([86_390, 2, 86_300, 86_301], [0, 0, 0, 0]),
        ([86_399, 1, 43_200, 2, 3], [0, 1, 1, 1, 1]),  # one wrong time beside a midnight
        ([86_397, 100, 86_399, 2, 3], [0, 0, 0, 1, 1]),
        ([80_000, 83_000, 500], [0, 0, 1]),  # within three usual steps
    ],
)
def test_midnights_are_counted_forth_and_back(times_s, days):
    step_s = 3000 if times_s[0] == 80_000 else 1
    lead = [times_s[0] + step_s * k for k in range(-9, 0)] if days[0] == 0 else []
    assert midnights(np.array([*lead, *times_s], float)).tolist() == [0] * len(lead) + days


def test_rows_in_another_order_tell_no_midnights():
    shuffled = np.random.default_rng(0).permutation(np.arange(86_200, 86_600) % 86_400).astype(float)
    assert not midnights(shuffled).any()


@pytest.mark.parametrize(("times_s", "expected"), [([0, 4, 8, 0, 4, 8], True), ([0, 4, 8, 0, 4, 4], False)])
def test_a_target_is_seen_once_at_a_time(times_s, expected):
    assert one_target_each(np.array(times_s, float), np.array([3])) is expected


def _swept(count, left=0, back=1.0):
    """Times and azimuths of passes of four steps, `left` of them to the left; each begins so far back from the last."""
    azimuth = np.array([0.0, 0.1, 0.2, 0.3])
    passed = [azimuth[::-1] if k < left else azimuth + 0.3 * k * (1 - back) for k in range(count)]
    return np.concatenate([10.0 * k + np.arange(4) for k in range(count)]), np.concatenate(passed)


@pytest.mark.parametrize(
    ("given", "found"),
    [
        (_swept(20), True),
        (_swept(11), True),
        (_swept(10), False),  # nine gaps
        (_swept(20, left=20), False),
        (_swept(40, left=2), True),
        (_swept(40, left=8), False),
        (_swept(20, back=-1.0), False),  # the next pass begins to the right
    ],
)
def test_passes_go_to_the_right_and_begin_back_on_the_left(given, found):
    number = passes(*given, 1.0)
    assert (number is not None) is found
    if found:
        assert number.tolist() == [k for k in range(len(given[0]) // 4) for _ in range(4)]
