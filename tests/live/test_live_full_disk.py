"""A disk that is really full: a small tmpfs where it may be mounted, and a limit on the size of files."""

import errno
import os
import resource
import signal
import subprocess
import time
from contextlib import suppress
from threading import Thread

import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest
from cameras import wait_for
from command_line import start

from vidtrack.config import load
from vidtrack.live.run import LiveRun
from vidtrack.output.repair import read_tracks
from vidtrack.state import read_state


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 400 kB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=400k", "none", str(disk)]
    try:
        if subprocess.run(mount, capture_output=True, check=False).returncode:
            pytest.skip("needs the right to mount a tmpfs")
    except FileNotFoundError:
        pytest.skip("needs mount")
    yield disk
    subprocess.run(["umount", "--lazy", str(disk)], check=True)


def fill(disk):
    """Take all room that is left; returns the file that has it."""
    ballast = disk / "ballast"
    with open(ballast, "wb", buffering=0) as file, suppress(OSError):
        while True:
            file.write(bytes(1024))
    return ballast


def whole_rows(path):
    """The rows of a table whose every line is whole."""
    text = path.read_text()
    assert text.endswith("\n")
    assert len({line.count(",") for line in text.splitlines()}) == 1
    return text.splitlines()[1:]


def test_a_small_disk_fills_up_gets_room_and_is_full_at_the_end(camera, small_disk, caplog):
    out = small_disk / "out"
    table = out / "tracks.csv"
    early, late = [], []

    def lost():
        return run.board.now().reading["lost"]["results"]

    def trouble():
        wait_for(lambda: len(whole_rows(table)) > 20, 30.0)
        ballast = fill(small_disk)
        wait_for(lambda: lost() > 10, 30.0)
        early.extend(whole_rows(table))
        ballast.unlink()
        wait_for(lambda: len(whole_rows(table)) > len(early) + 20, 30.0)
        fill(small_disk)
        before = lost()
        wait_for(lambda: lost() > before + 10, 30.0)
        late.extend(whole_rows(table))
        run.stop()

    with LiveRun(camera.url(), load(assignments=["live.timeout_s=2"]), out) as run:
        troubling = Thread(target=trouble)
        troubling.start()
        times = [step.time_s for step in run]
        troubling.join()
    assert np.diff(times).max() < 1.0  # tracking went on
    kept = whole_rows(table)
    assert kept[: len(early)] == early
    assert kept[: len(late)] == late
    assert len(late) > len(early) > 20
    check_no_half_files(out)
    assert "No space left" in caplog.text
    assert "is written again" in caplog.text
    assert "could not be finished" in caplog.text


def check_no_half_files(folder):
    """What could not be written is missing; nothing is cut."""
    names = {path.name for path in folder.iterdir()}
    assert not any(name.endswith(".new") for name in names)
    if "tracks.png" in names:
        assert (folder / "tracks.png").read_bytes().endswith(b"IEND\xaeB`\x82")
        assert cv2.imread(str(folder / "tracks.png")) is not None
    if "tracks.parquet" in names:
        assert pq.read_table(folder / "tracks.parquet").equals(read_tracks(folder / "tracks.csv"))


def test_a_quota_ends_files_and_not_the_run(camera, tmp_path):
    """20 kB a file are too few for the picture and most states, and after a while for the tables."""
    limit = 20_000
    process = start(
        "live",
        camera.url(),
        *("-o", "out", "--state", "cam.state", "--save-masks", "masks"),
        cwd=tmp_path,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )
    table = tmp_path / "out" / "tracks.csv"
    wait_for(lambda: table.exists() and table.stat().st_size > limit - 500, 60.0)
    time.sleep(0.5)
    rows = whole_rows(table)
    process.send_signal(signal.SIGTERM)
    _, talk = process.communicate(timeout=20)
    assert process.returncode == 0, talk
    assert "Traceback" not in talk
    assert os.strerror(errno.EFBIG) in talk
    assert "cannot save the state" in talk
    assert whole_rows(table)[: len(rows)] == rows
    assert (
        len(read_state(tmp_path / "cam.state")["detector._scene.luma"]) == 0
    )  # the first one: small, and it has the ids
    check_no_half_files(tmp_path / "out")
    assert not list(tmp_path.rglob("*.new"))
