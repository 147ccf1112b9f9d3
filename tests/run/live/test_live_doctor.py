"""The doctor at a camera: the pace of what comes, and no password."""

import json
import math

from click.testing import CliRunner

from vidtrack.cli import cli


def test_a_camera_is_watched_for_some_seconds(camera):
    arguments = ["doctor", camera.url(login="u:geheim@"), "--seconds", "1", "--json", "-"]
    result = CliRunner().invoke(cli, arguments, standalone_mode=False)
    assert result.exception is None
    assert "geheim" not in result.output
    found = json.loads(result.stdout)
    assert found["kind"] == "live"
    assert found["source"].startswith("http://***@127.0.0.1")
    assert found["timing"]["pictures"] > 1
    assert found["timing"]["rate"] > 0
    assert found["reception"]["gone"] is False
    assert found["speed"]["decode_s"] is None
    assert math.isfinite(found["blockiness"])
