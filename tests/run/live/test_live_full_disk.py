"""A disk that is really full: a small tmpfs where it may be mounted, and a limit on the size of files."""

import errno
import os
import resource
import signal
import subprocess
from contextlib import suppress

import cv2
import pyarrow.parquet as pq
import pytest
from cameras import HANG_S, wait_for
from live_runs import play, settings
from patient import start

from vidtrack.output.repair import read_tracks
from vidtrack.run.live.run import LiveRun
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
    kept = []

    def lines():
        return table.read_text().count("\n")

    def lost():
        return run.board.now().reading["lost"]["results"]

    def story(seen):
        yield lambda seen: lines() > 20
        kept.append(table.read_text().splitlines()[:20])
        ballast = fill(small_disk)
        yield lambda seen: lost() > 10
        ballast.unlink()
        before = lines()
        yield lambda seen: "is written again" in caplog.text and lines() > before + 20
        kept.append(table.read_text().splitlines()[: before + 20])
        fill(small_disk)
        before = lost()
        yield lambda seen: lost() > before + 10

    with LiveRun(camera.url(), settings(), out) as run:
        seen = play(run, story)
    assert [each.index for each in seen] == list(range(len(seen)))  # tracking went on
    for early in kept:
        assert table.read_text().splitlines()[: len(early)] == early
    assert whole_rows(table)
    check_no_half_files(out)
    assert "No space left" in caplog.text
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
    said = tmp_path / "said"
    arguments = (camera.url(), "-o", "out", "--state", "cam.state", "--save-masks", "masks")
    with said.open("w") as stderr:
        process = start("live", *arguments, cwd=tmp_path, stderr=stderr)
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (limit, limit))
    table = tmp_path / "out" / "tracks.csv"
    wait_for(lambda: table.exists() and table.read_text().count("\n") > 5)
    early = table.read_text().splitlines()[:5]
    wait_for(lambda: f"{table.name}: {os.strerror(errno.EFBIG)}" in said.read_text())
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=HANG_S)
    talk = said.read_text()
    assert process.returncode == 0, talk
    assert "Traceback" not in talk
    assert "cannot save the state" in talk
    assert whole_rows(table)[:4] == early[1:]
    state = read_state(tmp_path / "cam.state")
    assert len(state["detector._scene.luma"]) == 0  # the first one: small, and it has the ids
    check_no_half_files(tmp_path / "out")
    assert not list(tmp_path.rglob("*.new"))
