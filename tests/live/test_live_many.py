"""Several cameras at once: a process and a folder each, one summary, and no failure spreads."""

import json
import logging
import os
import re
import signal
from pathlib import Path

import cv2
import numpy as np
import pytest
from cameras import HttpCamera, crossing, wait_for, within
from click.testing import CliRunner
from command_line import start

from vidtrack.cli import cli
from vidtrack.config import load
from vidtrack.errors import ConfigError
from vidtrack.live.cameras import Entry, extras_of, listed, named, settings_of
from vidtrack.live.many import Many
from vidtrack.live.outputs import Extras
from vidtrack.live.worker import Job

SECRET = "u:pass%40word@"
QUICK = ["live.timeout_s=1", "live.backoff_s=0.05"]


def rows(folder):
    file = folder / "tracks.csv"
    return file.read_text().count("\n") if file.exists() else 0


def say_nothing(name):
    logging.getLogger("vidtrack").setLevel(logging.CRITICAL)


@pytest.fixture
def other(compiled):
    with HttpCamera(crossing(), fps=60.0) as camera:
        yield camera


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_one_camera_dies_and_the_other_goes_on(camera, other, tmp_path, number):
    (tmp_path / "cameras.toml").write_text(
        f"""
        live.timeout_s = 1.0

        [camera.north]
        address = "{camera.url(login=SECRET)}"
        output.lines = ["gate:160,0,160,240"]

        [camera.south]
        address = "{other.url(login=SECRET)}"
        """
    )
    out = tmp_path / "out"
    process = start("live", "cameras.toml", "-o", "out", "--http", "0", cwd=tmp_path, start_new_session=True)
    wait_for(lambda: rows(out / "north") > 5 and rows(out / "south") > 5, 60.0)
    other.__exit__()
    before = rows(out / "north")
    wait_for(lambda: rows(out / "north") > before + 20, 60.0)
    shown = [path.read_bytes().decode() for path in process_arguments(process.pid)]
    os.killpg(process.pid, number)  # as a terminal does, to all processes
    with within(6.0):  # two seconds are promised on an idle machine
        output, talk = process.communicate(timeout=20)
    assert process.returncode == 0, talk
    assert output == "out\n"
    assert re.search(r"south: warning: lost", talk)
    summary = json.loads((out / "summary.json").read_text())
    assert set(summary["cameras"]) == {"north", "south"}
    assert summary["frames"] == sum(camera["frames"] for camera in summary["cameras"].values())
    assert list(summary["cameras"]["north"]["counts"]) == ["gate"]
    assert not any("error" in camera or camera["interrupted"] for camera in summary["cameras"].values())
    texts = [*shown, output, talk] + [p.read_bytes().decode(errors="replace") for p in out.rglob("*") if p.is_file()]
    assert not any("pass%40word" in text for text in texts)


def process_arguments(pid):
    """Of a process and its children."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [Path(f"/proc/{each}/cmdline") for each in (pid, *children)]


def test_a_process_that_is_killed_takes_nobody_with_it(camera, tmp_path):
    jobs = [job(name, camera.url(), tmp_path) for name in ("a", "b")]
    with Many(jobs, tmp_path) as many:
        a, b = many.workers.values()
        wait_for(lambda: a.status().get("frame", 0) > 3 and b.status().get("frame", 0) > 3, 60.0)
        a.kill()
        wait_for(lambda: a.error is not None)
        frame = b.status()["frame"]
        wait_for(lambda: b.status()["frame"] > frame + 5, 30.0)
        assert many.running(0.0)
        assert [status["state"] for status in many.statuses()] == ["ended", "running"]
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["cameras"]["a"]["error"] == "its process ended with code -9"
    assert summary["cameras"]["b"]["frames"] > frame


def test_a_parent_can_show_status_and_picture(camera, tmp_path):
    with Many([job("a", camera.url(), tmp_path)], tmp_path) as many:
        worker = many.workers["a"]
        assert worker.picture() is None or worker.status()["frame"] >= 0
        wait_for(lambda: worker.status().get("frame", -1) > 3, 60.0)
        status = worker.status()
        assert status["state"] == "running"
        assert status["reading"]["width"] == 320
        picture = cv2.imdecode(np.frombuffer(worker.picture(), np.uint8), cv2.IMREAD_COLOR)
        assert picture.shape == (240, 320, 3)
    assert worker.status()["state"] == "ended"
    assert worker.picture() is None
    assert worker.error is None


def job(name, address, root):
    return Job(name, address, load(assignments=QUICK), root / name, Extras(), False, say_nothing)


def test_cameras_that_all_fail_end_the_run(tmp_path):
    nobody = "http://u:geheim@127.0.0.1:9/x"
    sets = [part for assignment in QUICK for part in ("--set", assignment)]
    process = start("live", nobody, nobody, "/dev/video77", "-o", "out", *sets, cwd=tmp_path)
    _, talk = process.communicate(timeout=60)
    assert process.returncode == 3, talk
    assert "geheim" not in talk
    assert "Traceback" not in talk
    cameras = json.loads((tmp_path / "out" / "summary.json").read_text())["cameras"]
    assert set(cameras) == {"127.0.0.1_9", "127.0.0.1_9-2", "video77"}
    assert "connection refused" in cameras["127.0.0.1_9-2"]["error"]
    assert "no such device" in cameras["video77"]["error"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "cannot read the list"),
        ("camera = ", "not valid TOML"),
        ("", "lists no camera"),
        ("[camera.a]\nsource.scale = 0.5", r"\[camera.a\] needs address"),
        ("[camera]\na = 'rtsp://x'", r"\[camera.a\] needs address"),
        ("[camera.'a/b']\naddress = '0'", "becomes a folder"),
        ("[camera.a]\naddress = 0\ntracker.methd = 'nn'", "camera a: unknown setting tracker.methd; did you mean"),
    ],
)
def test_a_wrong_list_says_what_is_wrong(tmp_path, text, message):
    path = tmp_path / "cameras.toml"
    if text is not None:
        path.write_text(text)
    error = CliRunner().invoke(cli, ["live", str(path)], standalone_mode=False).exception
    assert isinstance(error, ConfigError)
    assert re.search(message, str(error)), str(error)


def test_settings_for_one_stand_above_those_for_all(tmp_path):
    path = tmp_path / "cameras.toml"
    path.write_text(
        "tracker.method = 'nn'\ntracker.coast_s = 3.0\n[camera.a]\naddress = 2\ntracker.method = 'jpda'\n"
        "[camera.b]\naddress = 'rtsp://b/1'\n"
    )
    cameras, for_all = listed(path)
    a, b = (settings_of(camera, for_all, None, ["tracker.coast_s=2"]).tracker for camera in cameras)
    assert [(camera.name, camera.address) for camera in cameras] == [("a", "2"), ("b", "rtsp://b/1")]
    assert (a.method, b.method) == ("jpda", "nn")
    assert a.coast_s == b.coast_s == 2.0


def test_names_come_from_addresses_and_differ():
    addresses = ["rtsp://u:p@host/1", "rtsp://host/2", "0", "/dev/video0", "http://host:81/x"]
    assert [camera.name for camera in named(addresses)] == ["host", "host-2", "video0", "video0-2", "host_81"]


def test_each_camera_has_places_of_its_own():
    camera = Entry("north", "0", {})
    places = Extras(video=Path("a/all.mp4"), masks=Path("masks"), state=Path("cams.state"), record=Path("tape"))
    assert extras_of(camera, places) == Extras(
        video=Path("a/all-north.mp4"),
        masks=Path("masks/north"),
        state=Path("cams-north.state"),
        record=Path("tape/north"),
    )
    assert extras_of(camera, Extras()) == Extras()
    with pytest.raises(ConfigError, match="one camera"):
        extras_of(camera, Extras(rerun="serve"))
