"""The doctor at a camera: the pace of what comes, and no password."""

import json

import pytest
from cameras import HttpCamera, crossing
from click.testing import CliRunner

from vidtrack.cli import cli


@pytest.fixture
def slow_camera(compiled):
    with HttpCamera(crossing(), fps=12.0) as camera:
        yield camera


def test_a_camera_is_watched_for_some_seconds(slow_camera):
    arguments = ["doctor", slow_camera.url(login="u:geheim@"), "--seconds", "6", "--json", "-"]
    result = CliRunner().invoke(cli, arguments, standalone_mode=False)
    assert result.exception is None
    assert "geheim" not in result.output
    found = json.loads(result.stdout)
    assert found["kind"] == "live"
    assert found["source"].startswith("http://***@127.0.0.1")
    assert found["timing"]["pictures"] > 10
    assert found["timing"]["rate"] == pytest.approx(12, rel=0.2)
    assert found["speed"]["decode_s"] is None
