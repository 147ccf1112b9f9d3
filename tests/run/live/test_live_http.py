"""HTTP cameras: MJPEG and MPEG-TS, and what is neither."""

from itertools import cycle, islice
from time import monotonic

import numpy as np
import pytest
from cameras import HANG_S, HttpCamera, coming, within

from vidtrack.config.live import LiveSettings
from vidtrack.errors import SourceError
from vidtrack.video.live.address import parse_address
from vidtrack.video.live.connection import Connection
from vidtrack.video.live.source import LiveSource

SETTINGS = LiveSettings(timeout_s=HANG_S, backoff_s=0.02)


@pytest.fixture(scope="module")
def camera():
    with HttpCamera([np.full((120, 160, 3), level, np.uint8) for level in range(40, 240, 4)], fps=50.0) as camera:
        yield camera


def open_source(url, settings=SETTINGS):
    return LiveSource(parse_address(url, settings.timeout_s), settings)


@pytest.mark.parametrize("path", ["video.mjpg", "video.ts"])
def test_pictures_with_times_of_their_arrival(camera, path):
    began = monotonic()
    with open_source(camera.url(path)) as source:
        times = np.array([frame.time_s for frame in islice(coming(source), 20)])
        assert began < source.origin_s
        assert source.latency_s(times[-1]) > 0
        assert (source.width, source.height) == (160, 120)
    assert np.all(np.diff(times) > 0)


def test_the_spacing_is_the_one_of_the_stamps(camera):
    every = SETTINGS.model_copy(update={"every_frame": True})
    with open_source(camera.url("video.ts"), every) as source:
        steps = np.diff([frame.time_s for frame in islice(coming(source), 30)])
    assert np.median(steps) == pytest.approx(0.02, rel=0.01)


@pytest.mark.parametrize(
    ("path", "login", "message"),
    [
        ("page", "", "not a video stream"),
        ("film.avi", "", "is a recording, not live"),
        ("private", "", "refuses the user"),
        ("nothing", "", "no such path"),
        ("closed", "", "the camera ends the connection without a picture"),
        ("silent", "u:secret@", "no answer in 0.2 s"),
    ],
)
def test_what_is_no_stream_says_why(camera, path, login, message):
    settings = SETTINGS.model_copy(update={"timeout_s": 0.2 if path == "silent" else HANG_S})
    with within(), pytest.raises(SourceError, match=message) as caught:
        open_source(camera.url(path, login), settings)
    assert "secret" not in str(caught.value)


def test_another_codec_after_a_reconnect(camera, caplog):
    addresses = cycle([parse_address(camera.url(path), HANG_S) for path in ("video.mjpg", "video.ts")])
    frames = []
    with LiveSource(next(addresses), SETTINGS, connect=lambda: Connection(next(addresses), HANG_S)) as source:
        for reconnects in range(3):
            frames += [next(frame for frame in coming(source) if source.stats.reconnects == reconnects)]
            frames += islice(coming(source), 3)
            camera.connection += 1  # hangs up
    assert len({(frame.shape, frame.u.shape) for frame in frames}) == 1
    assert np.all(np.diff([frame.time_s for frame in frames]) > 0)
    assert "160x120 mjpeg" in caplog.text
    assert "160x120 h264" in caplog.text


def test_an_unknown_host():
    with pytest.raises(SourceError, match="host name is unknown"):
        open_source("http://u:secret@no.such.host.invalid/video")
