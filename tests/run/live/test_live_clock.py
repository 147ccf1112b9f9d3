"""Capture times: the camera's spacing where its stamps can be believed, the arrival's truth where not."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.video.live.clock import CaptureClock


def times(stamps, arrivals, patient=False):
    clock = CaptureClock(patient)
    return np.array([clock.time_s(s, a) for s, a in zip(stamps, arrivals, strict=True)])


def test_jitter_of_the_network_is_not_seen():
    stamps = np.arange(200) / 25
    late = np.abs(np.random.default_rng(1).normal(0, 0.03, 200))
    got = times(stamps + 1000, stamps + 50 + late)
    steps = np.diff(got[50:])
    assert np.abs(steps - 0.04).max() < 0.005
    assert np.abs(np.diff(np.sort(stamps + late)) - 0.04).max() > 0.03


def test_a_hiccup_keeps_the_spacing():
    stamps = np.arange(100) / 25
    arrivals = stamps.copy()
    arrivals[50:75] = arrivals[75]  # a second's worth comes at once
    got = times(stamps, arrivals)
    assert np.abs(np.diff(got) - 0.04).max() < 3e-3


def test_a_pause_of_the_camera_is_a_gap():
    stamps = np.arange(100) / 25
    arrivals = stamps + np.where(np.arange(100) >= 50, 4.0, 0.0)
    got = times(stamps, arrivals)
    assert got[50] - got[49] == pytest.approx(4.04)
    assert np.abs(np.diff(got[50:]) - 0.04).max() < 1e-9


def test_stamps_that_begin_anew_or_jump_ahead_do_not_matter():
    stamps = np.concatenate([np.arange(50) / 25 + 900, np.arange(50) / 25, np.arange(50) / 25 + 7000])
    arrivals = np.arange(150) / 25
    assert np.abs(np.diff(times(stamps, arrivals)) - 0.04).max() < 1e-9


def test_a_patient_reader_that_is_late_believes_the_stamps():
    stamps = np.arange(100) / 25
    got = times(stamps, stamps * 3, patient=True)
    assert np.abs(np.diff(got) - 0.04).max() < 1e-3


def test_without_stamps_the_arrival_counts():
    assert times([None, None, None], [5.0, 5.1, 5.4]).tolist() == [5.0, 5.1, 5.4]


@given(
    st.lists(
        st.tuples(st.none() | st.floats(-1e6, 1e6), st.floats(0, 10)),
        min_size=1,
        max_size=50,
    )
)
def test_times_always_increase_and_never_lie_in_the_future(pairs):
    clock = CaptureClock()
    now, before = 100.0, -np.inf
    for stamp, step in pairs:
        now += step
        t = clock.time_s(stamp, now)
        assert t > before
        assert t <= now + 1e-4 * len(pairs)
        before = t
