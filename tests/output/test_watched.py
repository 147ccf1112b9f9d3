"""Pauses between pictures are found at any rate."""

import numpy as np
import pytest

from vidtrack.output.watched import Watched


def spans(times, usual_s=0.04):
    watched = Watched(usual_s)
    for t in times:
        watched.add(float(t))
    return watched.spans


@pytest.mark.parametrize("period", [0.02, 0.04, 0.5, 1.9])
def test_pictures_at_a_steady_rate_are_one_span(period):
    times = np.arange(50) * period
    assert spans(times) == [[0.0, pytest.approx(times[-1])]]


def test_an_outage_ends_a_span():
    times = np.concatenate([np.arange(0, 10, 0.04), np.arange(100, 110, 0.04), np.arange(113, 115, 0.04)])
    assert spans(times) == [[0.0, 9.96], [100.0, 109.96], [113.0, 114.96]]


def test_dropped_frames_are_no_outage():
    assert len(spans([0.0, 0.04, 1.9, 3.8, 3.84])) == 1


def test_a_slow_camera_is_watched_after_a_few_pictures():
    found = spans(np.arange(1000) * 5.0)
    assert len(found) < 6
    assert found[-1][1] == 4995.0


def test_a_nominal_rate_tells_that_from_the_first_picture_on():
    assert spans(np.arange(9) * 5.0, usual_s=5.0) == [[0.0, 40.0]]


def test_nothing_came():
    assert spans([]) == []
