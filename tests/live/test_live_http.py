"""HTTP cameras: MJPEG and MPEG-TS, and what is neither."""

import time
from itertools import cycle

import numpy as np
import pytest
from cameras import HttpCamera, wait_for, within

from vidtrack.config import LiveSettings
from vidtrack.errors import SourceError
from vidtrack.video.live.address import parse_address
from vidtrack.video.live.connection import Connection
from vidtrack.video.live.source import LiveSource

SETTINGS = LiveSettings(timeout_s=1.0, backoff_s=0.02)


@pytest.fixture(scope="module")
def camera():
    with HttpCamera([np.full((120, 160, 3), level, np.uint8) for level in range(40, 240, 4)]) as camera:
        yield camera


def open_source(url):
    return LiveSource(parse_address(url, SETTINGS.timeout_s), SETTINGS)


@pytest.mark.parametrize("path", ["video.mjpg", "video.ts"])
def test_pictures_with_times_of_their_arrival(camera, path):
    with open_source(camera.url(path)) as source:
        began = time.monotonic()
        frames = [frame for frame, _ in zip(source, range(30), strict=False) if frame]
        elapsed = time.monotonic() - began
        assert (source.width, source.height) == (160, 120)
    steps = np.diff([frame.time_s for frame in frames])
    assert len(frames) > 20
    assert np.median(steps) == pytest.approx(0.04, abs=0.015)
    assert frames[-1].time_s == pytest.approx(elapsed, abs=0.5)


@pytest.mark.parametrize(
    ("path", "login", "message"),
    [
        ("page", "", "not a video stream"),
        ("film.avi", "", "is a recording, not live"),
        ("private", "", "refuses the user"),
        ("nothing", "", "no such path"),
        ("silent", "u:secret@", "no answer in 1 s"),
    ],
)
def test_what_is_no_stream_says_why(camera, path, login, message):
    with within(8.0), pytest.raises(SourceError, match=message) as caught:
        open_source(camera.url(path, login))
    assert "secret" not in str(caught.value)


def test_another_codec_after_a_reconnect(camera, caplog):
    addresses = cycle([parse_address(camera.url(path), 1.0) for path in ("video.mjpg", "video.ts")])
    frames = []
    with LiveSource(next(addresses), SETTINGS, connect=lambda: Connection(next(addresses), 1.0)) as source:
        for reconnects in range(3):
            wait_for(lambda k=reconnects: next(source) is not None and source.stats.reconnects == k)
            frames += [frame for frame in (next(source) for _ in range(5)) if frame is not None]
            camera.connection += 1  # hangs up
    assert len(frames) > 5
    assert len({(frame.shape, frame.u.shape) for frame in frames}) == 1
    assert np.all(np.diff([frame.time_s for frame in frames]) > 0)
    assert "160x120 mjpeg" in caplog.text
    assert "160x120 h264" in caplog.text


def test_an_unknown_host():
    with pytest.raises(SourceError, match="host name is unknown"):
        open_source("http://u:secret@no.such.host.invalid/video")
