"""Several cameras at once: a process and a folder each, one summary, and no failure spreads."""

import json
import logging
import os
import re
import signal
import sys
import urllib.request
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from cameras import HANG_S, HttpCamera, crossing, wait_for
from click.testing import CliRunner
from patient import line_with, start

import vidtrack.run.live.run
import vidtrack.run.live.worker
from vidtrack.cli import cli
from vidtrack.config.load import load
from vidtrack.errors import ConfigError, OutputError, StoppedEarly
from vidtrack.output.lock import exclusive
from vidtrack.output.repair import read_tracks
from vidtrack.run.live.cameras import Entry, extras_of, listed, named, refuse_shared_site, settings_of
from vidtrack.run.live.outputs import LiveExtras
from vidtrack.run.live.supervisor import _continued
from vidtrack.run.live.supervisors import Supervisors
from vidtrack.run.live.worker import Job

SECRET = "u:pass%40word@"
NOBODY = "http://u:geheim@127.0.0.1:9/x"
QUICK = ["live.backoff_s=0.05"]


def rows(folder):
    file = folder / "tracks.csv"
    return file.read_text().count("\n") if file.exists() else 0


def say_nothing(name):
    """In the camera's process: no hurry at its end either."""
    logging.getLogger("vidtrack").setLevel(logging.CRITICAL)
    vidtrack.run.live.run._END_S = HANG_S


@pytest.fixture
def other(compiled):
    with HttpCamera(crossing(), fps=60.0) as camera:
        yield camera


def test_one_camera_dies_and_the_other_goes_on(camera, other, tmp_path):
    (tmp_path / "cameras.toml").write_text(
        f"""
        tracker.coast_s = 1.5

        [camera.north]
        address = "{camera.url(login=SECRET)}"
        output.lines = ["gate:160,0,160,240"]

        [camera.south]
        address = "{other.url(login=SECRET)}"
        """
    )
    out = tmp_path / "out"
    process = start("live", "cameras.toml", "-o", "out", "--http", "0", cwd=tmp_path, start_new_session=True)
    wait_for(lambda: rows(out / "north") > 5 and rows(out / "south") > 5)
    other.__exit__()
    line = line_with("south: warning: lost", process)
    before = rows(out / "north")
    wait_for(lambda: rows(out / "north") > before + 5)
    shown = [path.read_bytes().decode() for path in process_arguments(process.pid)]
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to all processes
    output, talk = process.communicate(timeout=HANG_S)
    assert process.returncode == 0, talk
    assert output == "out\n"
    summary = json.loads((out / "summary.json").read_text())
    assert set(summary["cameras"]) == {"north", "south"}
    assert summary["frames"] == sum(camera["frames"] for camera in summary["cameras"].values())
    assert list(summary["cameras"]["north"]["counts"]) == ["gate"]
    assert not any("error" in camera for camera in summary["cameras"].values())
    written = [path.read_bytes().decode(errors="replace") for path in out.rglob("*") if path.is_file()]
    assert not any("pass%40word" in text for text in (*shown, output, line, talk, *written))


def process_arguments(pid):
    """Of a process and its children."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [Path(f"/proc/{each}/cmdline") for each in (pid, *children)]


def test_a_process_that_is_killed_is_started_again(camera, tmp_path, caplog):
    """It goes on with its numbers, what it wrote stays, and nobody else notices."""
    extras = LiveExtras(state=tmp_path / "a.state", video=tmp_path / "a.mp4")
    jobs = [replace(job("a", camera.url(), tmp_path), extras=extras), job("b", camera.url(), tmp_path)]
    with Supervisors(jobs, tmp_path) as cameras:
        a, b = cameras.by_camera.values()
        wait_for(lambda: rows(tmp_path / "a") > 5 and rows(tmp_path / "b") > 5)
        assert a.status()["state"] == "running"
        assert a.status()["reading"]["width"] == 320
        assert cv2.imdecode(np.frombuffer(a.picture(), np.uint8), cv2.IMREAD_COLOR).shape == (240, 320, 3)
        a.kill()
        wait_for(lambda: not cameras.running(0.05) or a.status()["state"] == "waiting")
        assert a.error is None
        frame = b.status()["frame"]
        wait_for(lambda: cameras.running(0.05) and rows(tmp_path / "a-2") > 5)
        assert b.status()["frame"] > frame
        assert [status["state"] for status in cameras.statuses()] == ["running", "running"]
        assert [status["restarts"] for status in cameras.statuses()] == [1, 0]
        assert a.status()["problems"][0][1] == "its process ended with code -9; it is started again"
    first, second = (read_tracks(tmp_path / folder / "tracks.csv") for folder in ("a", "a-2"))
    assert min(second["track_id"].to_pylist()) > max(first["track_id"].to_pylist())
    assert min(second["frame"].to_pylist()) > max(first["frame"].to_pylist())
    assert (tmp_path / "a.mp4").exists()
    assert (tmp_path / "a-2.mp4").exists()
    summary = json.loads((tmp_path / "summary.json").read_text())
    one, two = (json.loads((tmp_path / name / "summary.json").read_text()) for name in ("a", "a-2"))
    assert summary["cameras"]["a"]["restarts"] == summary["restarts"] == 1
    assert summary["cameras"]["a"]["frames"] == one["frames"] + two["frames"]
    assert "error" not in summary["cameras"]["a"]
    assert [summary["cameras"][name]["interrupted"] for name in "ab"] == [False, False]
    assert (b.status()["state"], b.picture(), b.error) == ("ended", None, None)
    assert "a: its process ended with code -9" in caplog.text


def full(name):
    """In the camera's process: nothing can be written."""

    def refuse(*_, **__):
        raise StoppedEarly("cannot write out: No space left on device")

    vidtrack.run.live.worker.LiveRun = refuse


def test_what_a_process_ended_with_decides_whether_it_is_started_again(tmp_path):
    """Not for ever where it said why; always once it crashed; and a disk that is full may have room later."""
    jobs = [job("told", "/dev/video77", tmp_path), job("crashed", NOBODY, tmp_path)]
    jobs.append(replace(job("full", NOBODY, tmp_path), prepare=full))
    with Supervisors(jobs, tmp_path) as cameras:
        told, crashed, full_disk = cameras.by_camera.values()
        crashed.kill()
        wait_for(lambda: cameras.running(0.05) and told.error and crashed.restarts > 1 and full_disk.restarts > 0)
        assert "no such device" in told.error
        assert told.restarts == 0
        assert any("connection refused" in what for _, what in crashed.status()["problems"])
        assert any("No space left" in what for _, what in full_disk.status()["problems"])


def test_a_crash_goes_on_in_the_same_parts(tmp_path):
    (tmp_path / "a" / "2026-01-01T00-00-00Z").mkdir(parents=True)
    before = job("a", "0", tmp_path)
    assert _continued(before, 2).folder == before.folder
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "tracks.csv").touch()
    assert _continued(job("b", "0", tmp_path), 2).folder == tmp_path / "b-2"
    extras = LiveExtras("x.rrd", Path("x.mp4"), Path("masks"), state=Path("s"), record=Path("tape"))
    again = _continued(replace(before, extras=extras, force=True), 3)
    assert again.extras == LiveExtras(
        "x-3.rrd",
        Path("x-3.mp4"),
        Path("masks-3"),
        state=Path("s"),
        record=Path("tape"),
        lasting=before.folder,
    )
    assert not again.force


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks into /proc")
def test_no_process_outlives_its_parent(camera, tmp_path):
    (tmp_path / "cameras.toml").write_text(f'[camera.north]\naddress = "{camera.url()}"\n')
    process = start("live", "cameras.toml", "-o", "out", cwd=tmp_path)
    wait_for(lambda: camera.visits)
    (child,) = (path for path in process_arguments(process.pid)[1:] if b"spawn_main" in path.read_bytes())
    process.kill()
    process.communicate()
    wait_for(lambda: not is_alive(child))


def is_alive(arguments):
    """Of a process that somebody else may have to bury: a dead one has no arguments."""
    try:
        return bool(arguments.read_bytes())
    except OSError:
        return False


def test_a_second_run_into_the_folder_is_refused(tmp_path):
    with exclusive(tmp_path), pytest.raises(OutputError, match="in use by another run"):
        Supervisors([], tmp_path)


def job(name, address, root):
    return Job(name, address, load(assignments=QUICK), root / name, LiveExtras(), False, say_nothing)


def test_cameras_that_all_fail_end_the_run(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    sets = [part for assignment in QUICK for part in ("--set", assignment)]
    sets += ["--set", "live.retry_first=false"]
    arguments = ["live", NOBODY, "/dev/video77", "-o", "out", *sets]
    result = CliRunner().invoke(cli, arguments, standalone_mode=False)
    assert (result.exception, result.return_value) == (None, 3)
    talk = result.output + "".join(capfd.readouterr())
    assert "geheim" not in talk
    assert "Traceback" not in talk
    cameras = json.loads((tmp_path / "out" / "summary.json").read_text())["cameras"]
    assert set(cameras) == {"127.0.0.1_9", "video77"}
    assert "connection refused" in cameras["127.0.0.1_9"]["error"]
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
    places = LiveExtras(video=Path("a/all.mp4"), masks=Path("masks"), state=Path("cams.state"), record=Path("tape"))
    assert extras_of(camera, places) == LiveExtras(
        video=Path("a/all-north.mp4"),
        masks=Path("masks/north"),
        state=Path("cams-north.state"),
        record=Path("tape/north"),
    )
    assert extras_of(camera, LiveExtras()) == LiveExtras()
    assert extras_of(camera, LiveExtras(rerun="a/all.rrd")).rerun == "a/all-north.rrd"
    with pytest.raises(ConfigError, match="one camera"):
        extras_of(camera, LiveExtras(rerun="serve"))


def test_a_site_is_of_one_camera(tmp_path):
    """Over --site for all of them, or by two tables of the list; a link to the same file is the same site."""
    cameras = named(["rtsp://one/a", "rtsp://two/b"])
    site = ("output.site", tmp_path / "site.toml")
    (tmp_path / "site.toml").touch()
    (tmp_path / "link.toml").symlink_to(tmp_path / "site.toml")
    alone = settings_of(cameras[0], {}, None, [site])
    linked = settings_of(cameras[1], {}, None, [("output.site", tmp_path / "link.toml")])
    for other in (alone, linked):
        with pytest.raises(ConfigError, match=r'both one and two: a site is of one camera.*\[camera\."one"\]'):
            refuse_shared_site(cameras, [alone, other])
    own = settings_of(cameras[1], {}, None, [("output.site", tmp_path / "other.toml")])
    refuse_shared_site(cameras, [alone, own])
    refuse_shared_site(cameras, [alone, settings_of(cameras[1], {}, None, [])])


def test_cameras_are_added_changed_and_removed_while_the_others_go_on(camera, other, tmp_path):
    """By editing the list. One with a mistake changes nothing, and the page shows those that there are."""
    listing, out = tmp_path / "cameras.toml", tmp_path / "out"
    north = f'[camera.north]\naddress = "{camera.url(login=SECRET)}"\n'
    south = f'[camera.south]\naddress = "{other.url(login=SECRET)}"\n'

    def put(*tables):
        new = listing.with_suffix(".new")
        new.write_text("live.roll_s = 1e10\n" + "".join(tables))
        os.replace(new, listing)

    def enough(name, parts=1):
        found = [part for part in (out / name).glob("*Z*") if rows(part) > 5]
        return len(found) >= parts

    put(north)
    process = start("live", "cameras.toml", "-o", "out", "--http", "0", cwd=tmp_path)
    url = re.search(r"http://\S+", line_with("the page is at", process))[0]

    def names():
        with urllib.request.urlopen(url + "status", timeout=HANG_S) as answer:
            return [one["name"] for one in json.load(answer)]

    wait_for(lambda: enough("north"))
    put(north, south, "output.lines = ['broken:1,2,3']\n")
    told = line_with("go on as they are", process)
    assert "camera south: line 'broken:1,2,3'" in told
    put(north, south)
    assert "south is added" in line_with("cameras.toml", process)
    wait_for(lambda: enough("south"))
    assert names() == ["north", "south"]
    put(north, south, "output.lines = ['gate:160,0,160,240']\n")
    assert "south is changed" in line_with("cameras.toml", process)
    wait_for(lambda: enough("south", parts=2))
    put(south, "output.lines = ['gate:160,0,160,240']\n")
    assert "north is removed" in line_with("cameras.toml", process)
    wait_for(lambda: names() == ["south"])
    process.send_signal(signal.SIGTERM)
    _, talk = process.communicate(timeout=HANG_S)
    assert process.returncode == 0, talk
    cameras = json.loads((out / "summary.json").read_text())["cameras"]
    assert cameras["north"]["removed"]
    assert cameras["north"]["restarts"] == cameras["south"]["restarts"] == 0
    assert len(list((out / "north").glob("*Z*"))) == 1  # it was not stopped for what happened to the other one
    assert "pass%40word" not in talk + told
