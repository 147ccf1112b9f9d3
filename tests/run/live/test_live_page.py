"""The page of a real run: it shows the camera, keeps its secrets, and its clients cost the tracker nothing."""

import json
import re
import signal
import socket
import urllib.request

import cv2
import numpy as np
import pytest
from cameras import HANG_S, wait_for
from click.testing import CliRunner
from patient import line_with, start

from vidtrack.cli import cli
from vidtrack.errors import ConfigError


def test_the_page_of_a_run(camera, tmp_path):
    options = ("-o", "out", "--http", "0", "--http-token", "sesame", "--line", "gate:160,0,160,240")
    process = start("live", camera.url(login="u:geheim@"), *options, cwd=tmp_path)
    told = line_with("the page is at", process)
    url = re.search(r"http://127\.0\.0\.1:\d+/", told)[0]

    def ask(path):
        request = urllib.request.Request(url + path, headers={"Authorization": "Bearer sesame"})
        return urllib.request.urlopen(request, timeout=HANG_S)

    def status():
        return json.load(ask("status"))[0]

    deaf = [socket.create_connection(("127.0.0.1", int(url.rsplit(":")[-1].rstrip("/")))) for _ in range(5)]
    for client in deaf:
        client.sendall(b"GET /tracks HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer sesame\r\n\r\n")
    wait_for(lambda: status().get("frame", -1) > 10 and status()["tracks"])  # it answers before the first picture
    found = status()
    assert found["up"]
    assert found["source"] == f"http://***@127.0.0.1:{camera.server_port}/video.mjpg"
    assert set(found["counts"]) == {"gate"}
    picture = cv2.imdecode(np.frombuffer(ask("picture/0.jpg").read(), np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (240, 320, 3)
    assert ask("healthz").read() == b"ok\n"
    assert b"vidtrack_frames_tracked_total{" in ask("metrics").read()
    with ask("tracks") as stream:
        lines = [json.loads(stream.readline()) for _ in range(3)]
    assert lines[0]["frame"] < lines[1]["frame"] < lines[2]["frame"]
    assert "geheim" not in json.dumps(found)
    process.send_signal(signal.SIGTERM)
    _, talk = process.communicate(timeout=HANG_S)
    assert process.returncode == 0, talk
    assert not any(secret in text for secret in ("geheim", "sesame") for text in (told, talk))
    assert "sesame" not in (tmp_path / "out" / "summary.json").read_text()
    for client in deaf:
        client.close()


@pytest.mark.parametrize(
    ("place", "message"), [("x", "PORT or HOST:PORT"), ("0.0.0.0:0", "VIDTRACK_TOKEN"), (None, "already in use")]
)
def test_a_page_that_cannot_be_is_refused_before_the_camera_is_opened(camera, tmp_path, monkeypatch, place, message):
    monkeypatch.chdir(tmp_path)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        place = place or str(taken.getsockname()[1])
        error = CliRunner().invoke(cli, ["live", camera.url(), "--http", place], standalone_mode=False).exception
    assert isinstance(error, ConfigError)
    assert error.exit_code == 2
    assert message in str(error)
    assert "\n" not in str(error)
    assert camera.visits == 0
    assert not (tmp_path / "runs").exists()


def test_the_token_may_come_from_the_environment(camera, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("VIDTRACK_TOKEN", "sesame")
    result = CliRunner().invoke(cli, ["live", camera.url(), "--http", "0.0.0.0:0", "--end", "0.5"])
    assert result.exit_code == 0, result.output
    assert f"the page is at http://{socket.gethostname()}:" in result.output
