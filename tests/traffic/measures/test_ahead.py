"""Kernels are compiled in a process of their own before the tables of a long day are read."""

import subprocess

import pyarrow as pa
import pytest
from drawn_runs import CALIBRATED, site, straight, write_run

from vidtrack.traffic.measures import ahead
from vidtrack.traffic.measures.measure import beginning, measured


@pytest.fixture
def cold(monkeypatch):
    """Nothing is compiled yet, and each day is a long one."""
    monkeypatch.setattr(ahead, "_LARGE", 0)
    monkeypatch.setattr(ahead, "CACHE", True)
    monkeypatch.setattr(ahead, "kept", lambda kernel: False)


@pytest.fixture
def started(monkeypatch):
    """What is given to processes that are started."""
    given = []
    monkeypatch.setattr(subprocess, "run", lambda command, *, input, **_: given.append(input))
    return given


def run(folder):
    return write_run(folder, [straight(1, 2.0, 20, 240, 120.0, 4.8)], metres=True)


@pytest.mark.parametrize(("least", "kept", "count"), [(0, False, 1), (0, True, 0), (10**9, False, 0)])
def test_a_long_day_is_begun_in_another_process_if_nothing_is_compiled_yet(
    tmp_path, monkeypatch, started, least, kept, count
):
    run(tmp_path / "run")
    monkeypatch.setattr(ahead, "_LARGE", least)
    monkeypatch.setattr(ahead, "CACHE", True)
    monkeypatch.setattr(ahead, "kept", lambda kernel: kept)
    found = measured([str(tmp_path / "run")], site(CALIBRATED))
    assert len(started) == count
    assert len(found.tables["crossings"]) == 3
    for told in started:
        beginning(told)  # it takes what it is given, and starts no other one
    assert len(started) == count


def test_the_beginning_is_so_many_blocks_of_rows(tmp_path, monkeypatch):
    run(tmp_path / "run")
    monkeypatch.setattr("vidtrack.traffic.measures.blocks.BLOCK", 30)
    runs = [str(tmp_path / "run")]
    assert len(measured(runs, site(CALIBRATED)).tables["crossings"]) == 3
    assert isinstance(measured(runs, site(CALIBRATED), blocks=1).tables["crossings"], pa.Table)
    assert len(measured(runs, site(CALIBRATED), blocks=1).tables["crossings"]) < 3


def test_the_other_process_runs_nothing_from_the_folder_it_is_started_in(tmp_path, monkeypatch, cold, capfd):
    run(tmp_path / "run")
    (tmp_path / "json.py").write_text("raise SystemExit('not ours')")
    ended = []
    start = subprocess.run
    monkeypatch.setattr(subprocess, "run", lambda *given, **named: ended.append(start(*given, **named)))
    only_read = ahead._BEGINNING.replace("beginning(", "import json; json.loads(")  # to compile takes long
    monkeypatch.setattr(ahead, "_BEGINNING", only_read)
    monkeypatch.chdir(tmp_path)
    measured(["run"], site(CALIBRATED))
    assert [one.returncode for one in ended] == [0]
    assert capfd.readouterr().out == ""


def test_without_another_process_a_day_is_measured_all_the_same(tmp_path, monkeypatch, cold):
    run(tmp_path / "run")
    for executable in ("", "/nowhere/python"):
        monkeypatch.setattr("sys.executable", executable)
        assert len(measured([str(tmp_path / "run")], site(CALIBRATED)).tables["crossings"]) == 3
