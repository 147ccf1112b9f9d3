"""The time of day at a site, in words."""

from datetime import UTC, datetime, timedelta, timezone

import pytest

from vidtrack.traffic.clock import Clock

START = datetime(2026, 6, 1, 7, 0, tzinfo=timezone(timedelta(hours=2)))


def test_times_are_told_in_the_zone_of_the_site():
    assert Clock.of(datetime(2026, 6, 1, 5, 0, tzinfo=UTC), START) == Clock(START)
    assert Clock(START).zone == "UTC+02:00"
    assert Clock.of(START, None).zone == "UTC"
    assert Clock.of(None, START).zone == "hours after the first picture"


@pytest.mark.parametrize(
    ("t", "known", "unknown"),
    [(0.04, "07:00:00.0", "0:00:00.0"), (59.97, "07:01:00.0", "0:01:00.0"), (3723.45, "08:02:03.4", "1:02:03.4")],
)
def test_a_moment_has_tenths_of_a_second(t, known, unknown):
    assert Clock(START).moment(t) == known
    assert Clock(None).moment(t) == unknown
