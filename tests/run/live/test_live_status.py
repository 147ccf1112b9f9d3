"""What a run says of itself now is of now."""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from datetime import datetime
from zoneinfo import ZoneInfo

import pytest
from numba.core.compiler_lock import global_compiler_lock
from synthetic_steps import make_step

from vidtrack.config.settings import OutputSettings
from vidtrack.output import status
from vidtrack.output.status import Account, StatusBoard, trouble_of
from vidtrack.video.live.stats import LiveStats


@pytest.fixture
def new():
    """Of a camera whose pictures are 2 s old when they are tracked; none is yet."""
    return StatusBoard(
        "cam",
        lambda: Account("running", {}, [], {"video": "no space"}),
        lambda time_s: 2.0,
        OutputSettings(),
        zone=ZoneInfo("Asia/Tokyo"),
    )


@pytest.fixture
def board(new):
    new.step(make_step(3, [(7, "c", 50, 50)], shape=(100, 200)))
    return new


def test_before_the_first_frame_it_says_that_kernels_are_compiled(new):
    def asked():
        """As by the page, in another thread than the tracker's."""
        with ThreadPoolExecutor(1) as thread:
            return thread.submit(lambda: trouble_of(asdict(new.now()), 10.0)).result()

    assert asked() == "no frames"
    with global_compiler_lock:
        assert asked() == "compiling"
        new.step(make_step(3, [], shape=(100, 200)))
        assert new.now().state == "running"


def test_tracks_and_rates_of_a_camera_that_is_down_are_not_shown(board, monkeypatch):
    now = board.now()
    assert ([track["track_id"] for track in now.tracks], now.fps_out, now.failing) == ([7], 0.2, {"video": "no space"})
    later_s = time.monotonic() + 6
    monkeypatch.setattr(status.time, "monotonic", lambda: later_s)
    now = board.now()
    assert (now.tracks, now.fps_out, now.frame) == ([], 0.0, 3)
    assert now.frame_age_s == pytest.approx(6, abs=1)


def test_the_rate_of_pictures_ends_with_them():
    stats = LiveStats()
    for k in range(50):
        stats.arrived(100 + k / 25)
    assert stats.rate(102.0) == pytest.approx(24.5, abs=0.1)
    assert stats.rate(113.0) == 0.0
    stats.arrived(200.0)
    stats.arrived(200.5)
    assert stats.rate(201.0) == 1.0  # without the pause before


def test_the_picture_has_the_time_of_day_of_its_capture(board, monkeypatch):
    written = []
    monkeypatch.setattr("vidtrack.output.annotated_picture.draw_clock", lambda pen, clock: written.append(clock))
    unix_s = datetime(2026, 11, 22, 12, 0, 1, tzinfo=ZoneInfo("UTC")).timestamp()
    monkeypatch.setattr(status.time, "time", lambda: unix_s)
    assert board.picture().startswith(b"\xff\xd8")
    assert written == ["2026-11-22 20:59:59"]
