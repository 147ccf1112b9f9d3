"""The real thing: GStreamer's RTSP server, killed, frozen, delayed, and asked with the wrong password."""

import json
import os
import time
from threading import Thread

import numpy as np
import pytest
from cameras import RtspCamera, needs_rtsp, wait_for, within

from vidtrack.config import LiveSettings, Settings
from vidtrack.errors import SourceError
from vidtrack.live.run import LiveRun
from vidtrack.video.live.address import parse_address
from vidtrack.video.live.connection import Connection, Refused
from vidtrack.video.live.source import LiveSource

pytestmark = needs_rtsp
SETTINGS = LiveSettings(timeout_s=1.0, backoff_s=0.05, backoff_longest_s=0.2)
LOGIN = "user:se%40cret@"


@pytest.fixture(scope="module")
def camera():
    with RtspCamera("--login", "user:se@cret") as camera:
        yield camera


def open_source(url, settings=SETTINGS):
    return LiveSource(parse_address(url, settings.timeout_s), settings)


def watch(source, seconds):
    """Frames that come in a stretch of time."""
    until = time.monotonic() + seconds
    return [frame for frame in iter(lambda: next(source) if time.monotonic() < until else until, until) if frame]


def next_frame(source, seconds=20.0):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        if (frame := next(source)) is not None:
            return frame
    raise AssertionError("no frame")


def test_pictures_at_the_camera_rate(camera):
    with open_source(camera.url(LOGIN)) as source:
        frames = watch(source, 1.5)
        assert (source.width, source.height, source.fps) == (320, 240, 25.0)
    steps = np.diff([frame.time_s for frame in frames])
    assert len(frames) > 10
    assert np.all(steps > 0)
    assert np.median(steps) == pytest.approx(0.04, abs=0.02)


def test_frozen_and_thawed(camera):
    with open_source(camera.url(LOGIN)) as source:
        before = next_frame(source)
        camera.tell("freeze")
        wait_for(lambda: next(source) is None and source.stats.stalls > 0)
        camera.tell("thaw")
        watch(source, 0.3)
        after = next_frame(source)
        assert after.time_s - before.time_s > 0.9
        assert "nothing came for 1 s" in source.stats.problems[0][1]
        assert source.stats.reconnects == 1


def test_a_delay_is_no_gap_in_the_times(camera):
    with open_source(camera.url(LOGIN)) as source:
        watch(source, 0.5)
        camera.tell("delay 600")
        frames = watch(source, 1.0)
        camera.tell("delay 0")
        frames += watch(source, 1.0)
        assert source.stats.reconnects == 0
        assert source.stats.frames_read + source.stats.frames_dropped >= 40
        assert source.latency_s(frames[-1].time_s) < 1.0


@pytest.mark.parametrize(
    ("login", "path", "error", "message"),
    [
        ("user:wr0ng@", "cam", Refused, "refuses the user or the password"),
        ("", "cam", Refused, "refuses the user or the password"),
        (LOGIN, "other", SourceError, "knows no such path"),
    ],
)
def test_what_cannot_be_opened_says_why(camera, caplog, login, path, error, message):
    with within(5.0), pytest.raises(error, match=message) as caught:
        open_source(camera.url(login, path))
    for text in (str(caught.value), caplog.text):
        assert "wr0ng" not in text
        assert "cret" not in text


def test_frozen_when_it_is_opened():
    with RtspCamera() as camera:
        address = parse_address(camera.url(), 30.0)
        other = Connection(address, 30.0)  # for as long as it stays, the server keeps its pipeline
        next(other.packets())
        camera.tell("freeze")
        with within(20.0), pytest.raises(SourceError, match="no answer in 1 s"):
            open_source(camera.url())
        other.close()


def test_nobody_there():
    with RtspCamera() as gone:
        url = gone.url()
    with pytest.raises(SourceError, match="connection refused"):
        open_source(url)


def test_killed_and_restarted_with_another_size():
    with RtspCamera() as first, open_source(first.url()) as source:
        before = next_frame(source)
        first.kill()
        wait_for(lambda: next(source) is None and len(source.stats.problems) > 2)
        with RtspCamera("--size", "160x120", port=first.port):
            after = next_frame(source)
        assert after.shape == before.shape == (240, 320)
        assert after.time_s > before.time_s
        assert source.stats.reconnects == 1
        assert "160x120 now" in " ".join(what for _, what in source.stats.problems)


def test_a_run_outlives_every_restart(compiled, tmp_path):
    """Killed at random moments; VIDTRACK_LONG=1 does it 20 times instead of 3."""
    restarts = 20 if os.environ.get("VIDTRACK_LONG") else 3
    random = np.random.default_rng(restarts)
    camera = RtspCamera("--size", "320x240")

    def restart():
        nonlocal camera
        for k in range(restarts):
            time.sleep(0.3 + random.random())
            camera.kill()
            camera = RtspCamera("--size", ("240x180", "320x240")[k % 2], port=camera.port)
            wait_for(lambda k=k: run.board.now().reading["reconnects"] > k, 30.0)
        run.stop()

    with LiveRun(camera.url(), Settings(live=SETTINGS), tmp_path / "out") as run:
        restarting = Thread(target=restart)
        restarting.start()
        steps = [(step.time_s, int(np.count_nonzero(step.tracks.status))) for step in run]
        restarting.join()
    camera.kill()
    times, tracks = np.array(steps).T
    assert np.all(np.diff(times) > 0)
    assert tracks.max() <= 3  # there is one ball
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert found["reconnects"] == restarts
    assert found["tracks"] <= 3 * (restarts + 1)
