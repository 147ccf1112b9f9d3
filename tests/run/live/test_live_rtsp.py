"""The real thing: GStreamer's RTSP server, killed, frozen, delayed, and asked with the wrong password."""

import json
import os
from itertools import islice
from time import monotonic

import numpy as np
import pytest
from cameras import HANG_S, RtspCamera, coming, needs_rtsp, wait_for, within
from live_runs import frames, play

from vidtrack.config.live import LiveSettings
from vidtrack.config.settings import Settings
from vidtrack.errors import SourceError
from vidtrack.run.live.run import LiveRun
from vidtrack.video.live.address import parse_address
from vidtrack.video.live.connection import Connection, Refused
from vidtrack.video.live.source import LiveSource

pytestmark = needs_rtsp
SETTINGS = LiveSettings(timeout_s=HANG_S, backoff_s=0.05, backoff_longest_s=0.2)
EVERY = SETTINGS.model_copy(update={"every_frame": True})
BRIEF = SETTINGS.model_copy(update={"timeout_s": 1.0})
LOGIN = "user:se%40cret@"


@pytest.fixture(scope="module")
def camera():
    with RtspCamera("--login", "user:se@cret") as camera:
        yield camera


def open_source(url, settings=SETTINGS):
    return LiveSource(parse_address(url, settings.timeout_s), settings)


def take(source, count):
    """The next frames."""
    return list(islice(coming(source), count))


def test_pictures_at_the_camera_rate(camera):
    at_the_rate, times = pytest.approx(0.04, rel=0.01), []
    with open_source(camera.url(LOGIN), EVERY) as source:
        for frame in islice(coming(source), 500):  # a camera on a busy machine begins with a burst
            times.append(frame.time_s)
            if len(times) >= 20 and np.median(np.diff(times[-20:])) == at_the_rate:
                break
        assert (source.width, source.height, source.fps) == (320, 240, 25.0)
    assert np.all(np.diff(times) > 0)
    assert np.median(np.diff(times[-20:])) == at_the_rate


def test_frozen_and_thawed(camera):
    with open_source(camera.url(LOGIN), BRIEF) as source:
        (before,) = take(source, 1)
        camera.tell("freeze")
        wait_for(lambda: next(source) is None and source.stats.stalls > 0)
        camera.tell("thaw")
        (after,) = take(source, 1)
        assert after.time_s - before.time_s > 0.9
        assert any("nothing came for 1 s" in what for _, what in source.stats.problems)
        assert source.stats.reconnects > 0


def test_a_delay_is_no_gap_in_the_times(camera):
    with open_source(camera.url(LOGIN), EVERY) as source:
        frames = take(source, 10)
        camera.tell("delay 600")
        until = monotonic() + HANG_S
        while source.latency_s(frames[-1].time_s) < 0.5:
            assert monotonic() < until
            frames += take(source, 1)
        camera.tell("delay 0")
        frames += take(source, 20)
        assert source.stats.reconnects == 0
    assert np.diff([frame.time_s for frame in frames]).max() < 0.1


@pytest.mark.parametrize(
    ("login", "path", "error", "message"),
    [
        ("user:wr0ng@", "cam", Refused, "refuses the user or the password"),
        ("", "cam", Refused, "refuses the user or the password"),
        (LOGIN, "other", SourceError, "knows no such path"),
    ],
)
def test_what_cannot_be_opened_says_why(camera, caplog, login, path, error, message):
    with within(), pytest.raises(error, match=message) as caught:
        open_source(camera.url(login, path))
    for text in (str(caught.value), caplog.text):
        assert "wr0ng" not in text
        assert "cret" not in text


def test_frozen_when_it_is_opened():
    brief = SETTINGS.model_copy(update={"timeout_s": 0.3})
    with RtspCamera() as camera:
        other = Connection(parse_address(camera.url(), HANG_S), HANG_S)  # while it stays, the server keeps its pipeline
        next(other.packets())
        camera.tell("freeze")
        with within(), pytest.raises(SourceError, match=r"no answer in 0\.3 s"):
            open_source(camera.url(), brief)
        other.close()


def test_a_run_outlives_every_restart(compiled, tmp_path):
    """Of the camera, with another size. VIDTRACK_LONG=1 does it 20 times instead of twice."""
    restarts = 20 if os.environ.get("VIDTRACK_LONG") else 2
    random = np.random.default_rng(restarts)

    def story(seen):
        for k in range(restarts):
            after = len(seen) + random.integers(1, 20)
            yield lambda seen, after=after: len(seen) > after
            camera.kill()
            camera.start("--size", ("240x180", "320x240")[k % 2])
            yield lambda seen, k=k: run.board.now().reading["reconnects"] == k + 1
        yield frames(len(seen) + 10)

    with RtspCamera() as camera, LiveRun(camera.url(), Settings(live=SETTINGS), tmp_path / "out") as run:
        seen = play(run, story)
        assert "240x180 now" in " ".join(what for _, what in run.board.now().problems)
    assert np.all(np.diff([each.time_s for each in seen]) > 0)
    assert max(len(each.tracks) for each in seen) <= 3  # there is one ball
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert found["reconnects"] == restarts
    assert found["tracks"] <= 3 * (restarts + 1)
