"""Recordings, of a run and of a finished one."""

import re
import subprocess
import sys
import sysconfig
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner
from synthetic_steps import make_step

from vidtrack.config.settings import Settings
from vidtrack.decision import Event
from vidtrack.errors import FormatError, OutputError
from vidtrack.output.rerun.pictures import RerunSink
from vidtrack.output.summary import Summary
from vidtrack.output.tables import TrackTable
from vidtrack.output.video import AnnotatedVideo
from vidtrack.traffic.lines import parse_line

SHAPE = (90, 120)
LINES = [parse_line("gate:60,0,60,89")]


@pytest.fixture(autouse=True)
def _strict(monkeypatch):
    monkeypatch.setenv("RERUN_STRICT", "1")  # mistakes are errors, not warnings


def rerun(*arguments):
    program = Path(sysconfig.get_path("scripts")) / ("rerun.exe" if sys.platform == "win32" else "rerun")
    return subprocess.run([program, "rrd", *map(str, arguments)], capture_output=True, text=True, check=True).stdout


def record(path, pictures):
    with closing(RerunSink(str(path), SHAPE, Settings(), LINES)) as sink:
        for index in range(12):
            rows = [(1, "t", 20, 20), (70_000, "c", 30, index), (3, "o", 60, 40), (4, "m", 9, 9)]
            rows = [] if index % 4 == 3 else rows
            events = (Event(0.0, 1, "birth", "a new blob"),) if index == 0 else ()
            sink.step(make_step(index, rows, shape=SHAPE if pictures else None, events=events))


@pytest.mark.parametrize("pictures", [True, False])
def test_a_recording_verifies_and_holds_what_was_seen_and_decided(tmp_path, pictures):
    record(tmp_path / "a.rrd", pictures)
    rerun("verify", tmp_path / "a.rrd")
    entities = {word.rstrip(":") for word in rerun("stats", tmp_path / "a.rrd").split()}
    wanted = {"/world/blobs", "/world/tracks", "/world/gates", "/world/trails", "/world/lines", "/plots/ms"}
    wanted |= {"/plots/count", "/log", "/settings", "/tracks/1", "/tracks/0", "/tracks/3"}
    assert wanted <= entities
    assert ({"/world/frame", "/mask"} <= entities) == pictures


def test_a_recording_that_cannot_be_written_is_refused(tmp_path):
    with pytest.raises(OutputError, match="missing"):
        RerunSink(str(tmp_path / "missing" / "a.rrd"), SHAPE, Settings())


def finished_run(folder, source, frames=(None, 1, 2, 3, None, 5, 6, 7)):
    reading = {"fps": 25.0, "width": SHAPE[1], "height": SHAPE[0]}
    summary = Summary(folder / "summary.json", source, Settings(), lambda: reading)
    table = TrackTable(folder)
    for number, index in enumerate(frames):
        rows = [] if index is None else [(1, "c", 10 * index, 20), (2, "m", 30, 30)]
        step = make_step(number if index is None else index, rows)
        summary.step(step)
        table.step(step)
    table.close()
    summary.close()
    cv2.imwrite(str(folder / "tracks.png"), np.full((720, 960, 3), 90, np.uint8))


def test_steps_of_a_finished_run_are_those_that_were_written(tmp_path):
    from vidtrack.output import replay

    finished_run(tmp_path, "gone.avi")
    steps = list(replay.steps(replay.read_run(tmp_path)))
    assert [step.index for step in steps] == [1, 2, 3, 4, 5, 6, 7]
    assert [step.time_s for step in steps] == pytest.approx([k / 25 for k in range(1, 8)])
    assert [len(step.tracks) for step in steps] == [2, 2, 2, 0, 2, 2, 2]
    expected = make_step(6, [(1, "c", 60, 20), (2, "m", 30, 30)]).tracks
    found = steps[5].tracks
    for name in ("id", "status", "xy", "v", "xy_cov", "box", "group", "nis"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), atol=1e-3)


def test_frames_that_nobody_looked_at_are_no_steps_of_a_finished_run(tmp_path):
    from vidtrack.output import replay

    finished_run(tmp_path, "gone.avi", [0, 2, 5, 7, 10, 20, 22])
    found = [(step.index, len(step.tracks)) for step in replay.steps(replay.read_run(tmp_path))]
    assert found == [(0, 2), (2, 2), (5, 2), (7, 2), (10, 2), (12, 0), (14, 0), (16, 0), (18, 0), (20, 2), (22, 2)]


def test_a_run_at_a_calibrated_site_is_shown_in_pixels(tmp_path):
    from vidtrack.output import replay

    finished_run(tmp_path, "gone.avi")
    table = pq.read_table(tmp_path / "tracks.parquet")
    for name in ("x_m", "y_m"):
        table = table.append_column(name, pa.array(np.full(len(table), 7.0)))
    pq.write_table(table, tmp_path / "tracks.parquet")
    first = next(iter(replay.steps(replay.read_run(tmp_path))))
    assert first.tracks.xy.tolist() == [[10.0, 20.0], [30.0, 30.0]]


def test_view_saves_a_recording_over_the_background_when_the_source_is_gone(tmp_path):
    from vidtrack.cli.view import command

    finished_run(tmp_path, "gone.avi")
    result = CliRunner().invoke(command, [str(tmp_path), "--save", str(tmp_path / "a.rrd")], catch_exceptions=False)
    assert result.exit_code == 0
    rerun("verify", tmp_path / "a.rrd")
    assert "/world/frame" in rerun("stats", tmp_path / "a.rrd")


def test_view_shows_the_pictures_of_the_source(tmp_path):
    from vidtrack.cli.view import command

    with closing(AnnotatedVideo(tmp_path / "a.mp4", 25.0, Settings().output)) as video:
        for index in range(8):
            video.step(make_step(index, [], shape=SHAPE))
    finished_run(tmp_path, str(tmp_path / "a.mp4"))
    for options, pictures in ([], 8), (["--no-video"], 1):
        arguments = [str(tmp_path), "--save", str(tmp_path / "a.rrd"), *options]
        result = CliRunner().invoke(command, arguments, catch_exceptions=False)
        assert result.exit_code == 0
        chunks = re.findall(r"with (\d+) rows .* /world/frame ", rerun("print", tmp_path / "a.rrd"))
        assert sum(map(int, chunks)) == pictures


def test_view_refuses_what_is_no_run(tmp_path):
    from vidtrack.cli.view import command

    with pytest.raises(FormatError, match="not a run"):
        CliRunner().invoke(command, [str(tmp_path), "--save", "a.rrd"], catch_exceptions=False)


def test_repair_command_reports_the_rows(tmp_path):
    from vidtrack.cli.repair import command

    finished_run(tmp_path, "gone.avi")
    result = CliRunner().invoke(command, [str(tmp_path)], catch_exceptions=False)
    assert result.exit_code == 0
    assert "12 rows" in result.output


def test_a_viewer_without_a_display_is_refused_at_once(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr("vidtrack.output.rerun.recording._ADDRESS", ("127.0.0.1", 1))  # nobody listens there
    with pytest.raises(OutputError, match=r"display.*FILE\.rrd"):
        RerunSink("spawn", SHAPE, Settings())
