"""`vidtrack live` as a user runs it: a signal ends it well, kill -9 harms nothing, and mistakes are one line."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import fields
from pathlib import Path

import command_line
import numpy as np
import pytest
from cameras import HANG_S, wait_for, within
from click.testing import CliRunner
from patient import start

from vidtrack.cli import cli
from vidtrack.cli.live import LiveOptions, amount
from vidtrack.cli.signals import Terminated, stoppable, stopping
from vidtrack.config.load import load
from vidtrack.errors import OutputError
from vidtrack.output.repair import read_tracks, repair
from vidtrack.recording.retention import parts_of
from vidtrack.run.files import run_file
from vidtrack.state import read_state

SECRET = "u:pass%40word@"


def test_a_signal_is_the_normal_end(camera, tmp_path):
    options = ("-o", "out", "--state", "state", "--record", "tape", "-v")
    process = start("live", camera.url(login=SECRET), *options, cwd=tmp_path)
    wait_for(lambda: _rows([tmp_path / "out"]) > 5)
    arguments = Path(f"/proc/{process.pid}/cmdline").read_bytes().decode()
    process.send_signal(signal.SIGINT)
    output, talk = process.communicate(timeout=HANG_S)
    assert process.returncode == 0, talk
    assert output == "out\n"
    assert "latency" in talk
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["interrupted"] is False
    assert (tmp_path / "out" / "tracks.parquet").exists()
    texts = [arguments, output, talk] + [
        path.read_bytes().decode(errors="replace") for path in tmp_path.rglob("*") if path.is_file()
    ]
    assert not any("pass%40word" in text or "pass@word" in text for text in texts)
    assert "127.0.0.1" in arguments


def test_kill_9_leaves_readable_files_and_numbers_that_are_not_given_again(camera, tmp_path):
    """VIDTRACK_LONG=1 does it 50 times instead of twice, at random moments, each run going on from the last."""
    random = np.random.default_rng(1)
    given = 0
    out = tmp_path / "out"
    for _ in range(50 if os.environ.get("VIDTRACK_LONG") else 2):
        before = set(parts_of(out))
        options = ("-o", "out", "--state", "state", "--roll", "100000d", "--record", "tape")
        process = start("live", camera.url("video.ts"), *options, cwd=tmp_path)
        wait_for(lambda before=before: _rows(set(parts_of(out)) - before) > 3)
        wait_for(lambda: _taped(parts_of(tmp_path / "tape")[-1]))
        time.sleep(random.random())
        process.kill()
        process.communicate()
        (part,) = set(parts_of(out)) - before
        rows = read_tracks(part / "tracks.csv")
        numbers = rows["track_id"].to_pylist()
        assert min(numbers) >= given
        given = read_state(tmp_path / "state")["tracker.register.next_id"]
        assert given > max(numbers)
        assert json.loads((part / "summary.json").read_text())["interrupted"] is True
        tape = parts_of(tmp_path / "tape")[-1]
        with run_file(str(tape), load(), tmp_path / "again", force=True) as run:
            times = [step.time_s for step in run]
        assert 0 < len(times) < (tape / "frames.csv").read_text().count("\n")
        again = (tmp_path / "again" / "tracks.csv").read_text().splitlines()[1:]
        lived = (part / "tracks.csv").read_text().splitlines()[1:]
        sure_s = min(times[-1], _time_s(lived[-1])) - 1.0  # later rows may be of tracks still tentative at an end
        assert [row for row in lived if _time_s(row) < sure_s] == [row for row in again if _time_s(row) < sure_s]
    for part in parts_of(out):
        assert repair(part) > 3


def _taped(tape):
    """Whether there are pictures and a list of them on the disk."""
    return (tape / "video.mkv").stat().st_size > 10_000 and (tape / "frames.csv").read_text().count("\n") > 10


def _time_s(row):
    return float(row.split(",")[1])


def _rows(parts):
    files = [part / "tracks.csv" for part in parts if (part / "tracks.csv").exists()]
    return sum(file.read_text().count("\n") - 1 for file in files)


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["77"], 3, "no such device /dev/video77"),
        (["/dev/null"], 3, "it is no camera"),
        ([__file__], 3, "read it with vidtrack track"),
        (["rtsp://u:geheim@127.0.0.1:9/x", "--set", "live.backoff_s=0.01"], 3, "connection refused"),
        (["0", "--keep", "7"], 2, "write a number and a unit"),
        (["0", "--keep", "1MB", "--keep", "x"], 2, "'x'"),
        (["0", "--roll", "1GB"], 2, "one of s, m, h, d"),
        (["0", "--set", "live.ffmpeg=['x']"], 2, "NAME=VALUE"),
        (["0", "--set", "live.timeout=3"], 2, "did you mean live.timeout_s"),
    ],
)
def test_a_mistake_is_one_line_and_the_right_code(tmp_path, monkeypatch, arguments, code, message):
    monkeypatch.chdir(tmp_path)
    error = CliRunner().invoke(cli, ["live", *arguments], standalone_mode=False).exception
    assert error.exit_code == code
    assert message in str(error)
    assert "\n" not in str(error)
    assert "geheim" not in str(error)
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("options", [["-o", "file/out"], ["-o", "full"], ["--record", "file"]])
def test_folders_that_cannot_be_used_are_refused(camera, tmp_path, monkeypatch, options):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "a").touch()
    error = CliRunner().invoke(cli, ["live", camera.url(), *options], standalone_mode=False).exception
    assert isinstance(error, OutputError)
    assert error.exit_code == 2
    assert options[1] in str(error)


def test_ctrl_c_before_the_first_picture_is_no_error(camera, tmp_path):
    process = command_line.start("live", camera.url("silent"), cwd=tmp_path)
    wait_for(lambda: camera.visits)
    process.send_signal(signal.SIGINT)
    _, talk = process.communicate(timeout=HANG_S)
    assert process.returncode == 0, talk


def test_a_signal_while_the_kernels_are_compiled_ends_it_too(camera, tmp_path, monkeypatch):
    monkeypatch.setitem(command_line.ENVIRONMENT, "NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    process = command_line.start("live", camera.url(), "-o", "out", "--state", "state", cwd=tmp_path)
    wait_for(lambda: list(tmp_path.glob("kernels/**/*.nbi")))
    process.send_signal(signal.SIGTERM)
    _, talk = process.communicate(timeout=HANG_S)
    assert process.returncode == 0, talk
    assert "Traceback" not in talk
    assert read_state(tmp_path / "state")["detector._frames"] == 0  # the frame that was broken off is not in it


def test_a_signal_while_the_program_loads_is_no_error_either(monkeypatch):
    def terminated(*_, **_kind):
        raise Terminated

    monkeypatch.setattr("vidtrack.config.load.load", terminated)
    result = CliRunner().invoke(cli, ["live", "0"], standalone_mode=False)
    assert result.exception is None
    assert result.return_value == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_does_not_stop_is_interrupted(monkeypatch, number):
    monkeypatch.setattr("vidtrack.cli.signals._PATIENCE_S", 0.05)
    told = []

    def deaf():
        with stopping(lambda: told.append(1)):
            signal.raise_signal(number)
            while True:
                time.sleep(0.01)

    with within(), pytest.raises(KeyboardInterrupt):
        deaf()
    assert told == [1]


def test_an_interruption_within_a_compiled_call_is_one():
    def broken():
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as error:
            raise SystemError("returned a result with an exception set") from error

    with pytest.raises(KeyboardInterrupt), stopping(lambda: None):
        broken()
    with pytest.raises(KeyboardInterrupt):
        list(stoppable(broken() for _ in range(1)))
    with pytest.raises(SystemError), stopping(lambda: None):
        raise SystemError("of another kind")


@pytest.mark.parametrize("options", [["--video", "no/x.mp4"], ["--rerun", "no/x.rrd"]])
def test_a_wrong_place_leaves_the_folder_free_for_the_next_try(camera, tmp_path, monkeypatch, options):
    monkeypatch.chdir(tmp_path)
    error = CliRunner().invoke(cli, ["live", camera.url(), "-o", "out", *options], standalone_mode=False).exception
    assert isinstance(error, OutputError)
    assert not list((tmp_path / "out").iterdir())


def test_amounts_become_settings():
    def given(**chosen):
        unsaid = {field.name: None for field in fields(LiveOptions)} | {"assignments": (), "lines": (), "keeps": ()}
        return LiveOptions(**(unsaid | chosen)).given()

    assert given(every_frame=True, roll="10m", keeps=("7d", "1.5GB"), assignments=("blobs.cut=false",)) == [
        "blobs.cut=false",
        ("live.every_frame", True),
        ("live.roll_s", 600.0),
        ("live.keep_s", 604800.0),
        ("live.keep_bytes", 1.5e9),
    ]
    assert given() == []
    assert given(start=0.0, lines=("a:1,2,3,4",)) == [("source.start_s", 0.0), ("output.lines", ["a:1,2,3,4"])]
    assert amount("--roll", "2 h", {"live.roll_s": {"h": 3600.0}}) == ("live.roll_s", 7200.0)


def test_help_shows_three_examples():
    text = CliRunner().invoke(cli, ["live", "--help"]).output
    assert len(re.findall(r"^\s+vidtrack live ", text, re.M)) == 3
    for option in ("--every-frame", "--roll", "--keep", "--state", "--record", "--line", "--rerun", "--end"):
        assert option in text


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux tells its arguments in /proc")
def test_secrets_leave_the_argument_list():
    code = (
        "import sys, pathlib\n"
        "from vidtrack.cli.hide import hide_arguments\n"
        "hide_arguments(['geheim'])\n"
        "print(pathlib.Path('/proc/self/cmdline').read_text())\n"
    )
    shown = subprocess.run([sys.executable, "-c", code, "a:geheim@b", "c"], capture_output=True, text=True, check=True)
    assert "geheim" not in shown.stdout.replace(code, "").split("a:")[1]
    assert "a:******@b\0c" in shown.stdout
