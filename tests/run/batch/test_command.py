"""`vidtrack batch` as a user types it."""

import os
import signal

import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner
from command_line import start
from places import small_videos

from vidtrack.cli import cli
from vidtrack.cli.batch_progress import told
from vidtrack.errors import Error
from vidtrack.run.batch.batch import Progress


def refused(*arguments):
    """The exit code and the message of a command that is refused before anything is begun."""
    with pytest.raises(Error) as error:
        CliRunner().invoke(cli, ["batch", *map(str, arguments)], catch_exceptions=False, standalone_mode=False)
    return error.value.exit_code, str(error.value)


def test_interrupted_it_goes_on(tmp_path):
    """Ctrl-C ends it at once with its processes; the same command again does the rest."""
    small_videos(tmp_path / "in")
    (tmp_path / "in" / "bad.mp4").write_text("no video")
    command = ("batch", "in", "-o", "out", "--workers", "1")
    first = start(*command, cwd=tmp_path)
    assert "3 to do on 1 core" in first.stderr.readline()
    first.send_signal(signal.SIGINT)
    _, said = first.communicate(timeout=600)
    assert first.returncode == 130
    assert "run the same command again to go on" in said
    assert "Traceback" not in said
    assert sorted(os.listdir(tmp_path / "out")) == ["index.parquet"]
    second = start(*command, cwd=tmp_path)
    out, said = second.communicate(timeout=600)
    assert second.returncode == 1
    assert "1 of 3 sources are set aside" in said
    assert out == f"{tmp_path / 'out'}\n"
    rows = pq.read_table(tmp_path / "out" / "index.parquet").to_pylist()
    assert sorted(row["state"] for row in rows) == ["done", "done", "set aside"]


def test_bad_input_is_one_line(tmp_path):
    videos = small_videos(tmp_path / "in")
    out = tmp_path / "out"
    assert refused(tmp_path / "none.mp4", "-o", out) == (
        3,
        f"cannot open {tmp_path / 'none.mp4'}: no such file or folder",
    )
    assert refused(videos, videos / "cam1", "-o", out)[0] == 2
    code, message = refused(videos, "-o", out, "--dask", "tcp://127.0.0.1:x")
    assert (code, "does not answer" in message or "pip install" in message) == (2, True)
    code, message = refused(videos, "-o", videos)
    assert (code, "is no batch's" in message) == (2, True)
    code, message = refused(videos, "-o", out, "--set", "tracker.coast=2")
    assert (code, "did you mean tracker.coast_s?" in message) == (2, True)


def test_the_progress_says_how_long_it_will_take():
    progress = Progress(total=100, before=10, done=20, aside=1, media_s=7200.0, bytes_done=25, bytes_total=100)
    assert told(progress, 1800.0) == "30 of 100 files, 2.00 h of video, 4.0 h an hour, 1:30 h left, 1 set aside"
    assert told(Progress(total=3), 0.0) == "0 of 3 files, 0.00 h of video, 0.0 h an hour"
