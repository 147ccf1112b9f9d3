"""The doctor at a camera that goes away while it is looked at."""

import json
import time
from dataclasses import asdict
from threading import Event

import numpy as np
import pytest
from cameras import HANG_S, Picture, Script, script_of
from click.testing import CliRunner

from vidtrack.cli import cli
from vidtrack.config.load import load
from vidtrack.doctor import examine, opening
from vidtrack.doctor.advice import judge
from vidtrack.errors import SourceError
from vidtrack.video.live.source import LiveSource

ADDRESS = "http://u:geheim@camera/"
SETTINGS = ["live.timeout_s=0.2", "live.backoff_s=60", "live.backoff_longest_s=60"]
NOISE = np.random.default_rng(0).integers(60, 180, (48, 64), np.uint8)


class Leaving(Script):
    """Sends pictures until it is told to leave, and is lost then."""

    def __init__(self):
        super().__init__()
        self.leave = Event()

    def packets(self):
        while not self.leave.is_set():
            yield Picture(NOISE)
            time.sleep(0.01)
        raise SourceError("lost the camera")


@pytest.fixture
def seen(monkeypatch, compiled):
    """Lets the doctor see this connection, and nobody after it; the sources that it opened."""
    opened = []

    def see(connection):
        connect = script_of(connection)

        def open_it(*given, **_):
            opened.append(LiveSource(*given, connect=connect))
            return opened[-1]

        monkeypatch.setattr(opening, "LiveSource", open_it)
        return opened

    return see


def test_what_was_seen_is_told_and_that_it_is_gone(seen, monkeypatch):
    camera = Leaving()
    opened = seen(camera)

    class Watch(examine.Watch):
        def _seen(self, frames):
            for frame in super()._seen(frames):
                camera.leave.set()
                until = time.monotonic() + HANG_S
                while opened[0].stats.state == "running" and time.monotonic() < until:
                    time.sleep(0.01)  # the watch may end with this picture
                yield frame

    monkeypatch.setattr(examine, "Watch", Watch)
    settings = load(assignments=SETTINGS)
    findings = examine.examine(ADDRESS, settings, seconds=1.0)
    json.dumps(asdict(findings), allow_nan=False)
    assert findings.timing.pictures > 1
    assert findings.reception.gone
    (advice,) = [one for one in judge(findings, settings) if one.name == "connection"]
    assert advice.problem
    assert "nothing came at the end" in advice.text


def test_a_camera_that_leaves_before_it_is_watched_is_an_error(seen):
    seen(Script(*5 * [0.02, Picture(NOISE)], SourceError("lost the camera")))
    given = [f"--set={setting}" for setting in SETTINGS]
    result = CliRunner().invoke(cli, ["doctor", ADDRESS, "--seconds=60", *given], standalone_mode=False)
    assert isinstance(result.exception, SourceError)
    assert "then nothing" in str(result.exception)
    assert "geheim" not in str(result.exception)
    assert result.stdout == ""
