"""Run folders and files that survive a kill, a full disk, a vanished folder."""

import csv
import errno
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from synthetic_steps import make_step

from vidtrack.config.settings import Settings
from vidtrack.errors import FormatError, OutputError, StoppedEarly
from vidtrack.output.confirmed import Confirmed
from vidtrack.output.counts import CountsFile
from vidtrack.output.folder import open_folder, open_run, replacing
from vidtrack.output.linefile import LineFile
from vidtrack.output.mot import MotFile
from vidtrack.output.repair import repair
from vidtrack.output.summary import Summary
from vidtrack.output.tables import TrackTable
from vidtrack.traffic.lines import LineCounter, parse_line

READING = {"fps": 25.0, "width": 320, "height": 240, "frames_read": 3, "truncated": False}


def test_default_folders_are_numbered(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = [open_run(None, "motorway", force=False) for _ in range(3)]
    assert [str(folder) for folder in found] == ["runs/motorway", "runs/motorway-2", "runs/motorway-3"]
    assert all(folder.is_dir() for folder in found)


def test_a_source_name_cannot_leave_the_runs_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert open_run(None, "../..//rtsp:cam 1", force=False).parent == Path("runs")
    assert open_run(None, "..", force=False) == Path("runs/run")


def test_a_folder_in_use_needs_force_which_replaces_results_only(tmp_path):
    (tmp_path / "tracks.csv").write_text("old")
    (tmp_path / "tracks.parquet.parts").mkdir()
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(OutputError, match="not empty") as refusal:
        open_run(tmp_path, "x", force=False)
    assert str(tmp_path) in str(refusal.value)
    assert refusal.value.exit_code == 2
    assert open_run(tmp_path, "x", force=True) == tmp_path
    assert [p.name for p in tmp_path.iterdir()] == ["notes.txt"]


def test_what_is_no_run_leaves_the_results_beside_it(tmp_path):
    """`vidtrack eval RUN TRUTH -o RUN --force` adds its scores to the run."""
    (tmp_path / "tracks.csv").write_text("old")
    with pytest.raises(OutputError, match="not empty"):
        open_folder(tmp_path, "eval", force=False)
    assert open_folder(tmp_path, "eval", force=True) == tmp_path
    assert (tmp_path / "tracks.csv").read_text() == "old"


def test_an_unusable_folder_is_refused_by_name(tmp_path):
    blocker = tmp_path / "file"
    blocker.write_text("")
    for path in (blocker, blocker / "below"):
        with pytest.raises(OutputError, match=str(path)):
            open_run(path, "x", force=False)


def test_runs_being_a_file_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("runs").write_text("")
    with pytest.raises(OutputError, match="runs"):
        open_run(None, "x", force=False)


class FullDisk:
    """A file on a disk that takes `room` more bytes."""

    def __init__(self, file, room):
        self._file = file
        self._room = room

    def write(self, block):
        if self._room <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        taken = self._file.write(block[: self._room])
        self._room -= taken
        return taken

    def __getattr__(self, name):
        return getattr(self._file, name)


def test_a_full_disk_stops_the_run_and_leaves_whole_lines(tmp_path):
    file = LineFile(tmp_path / "rows.txt", "header\n")
    file.add("first\nsecond\n")
    file.flush()
    file._file = FullDisk(file._file, 4)
    file.add("third\n")
    with pytest.raises(StoppedEarly, match="No space left") as stop:
        file.flush()
    assert stop.value.exit_code == 1
    file.close()
    assert (tmp_path / "rows.txt").read_text() == "header\nfirst\nsecond\n"


def test_a_file_is_replaced_as_a_whole_or_not_at_all(tmp_path):
    path = tmp_path / "summary.json"
    path.write_text("old")
    with pytest.raises(StoppedEarly, match="No space left"), replacing(path) as new:  # noqa: PT012
        new.write_text("half of it")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("summary.json", "old")]


def test_a_folder_that_vanishes_stops_the_run(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    summary = Summary(folder / "summary.json", "a.avi", Settings(), lambda: READING)
    (folder / "summary.json").unlink()
    folder.rmdir()
    with pytest.raises(StoppedEarly, match=r"summary\.json"):
        summary.close()


def test_the_summary_of_a_running_run_says_interrupted_and_of_a_finished_one_not(tmp_path):
    counter = LineCounter([parse_line("gate:100,0,100,200")])
    summary = Summary(tmp_path / "summary.json", "a.avi", Settings(), lambda: READING, counter.totals)
    early = json.loads((tmp_path / "summary.json").read_text())
    for index, x in enumerate([80, 95, 115]):
        step = make_step(index, [(1, "c", x, 50), (2, "t", 5, 5)])
        counter.step(step.index, step.tracks)
        summary.step(replace(step, scan=replace(step.scan, rim=3.0)))
    summary.interrupted = False
    summary.close()
    late = json.loads((tmp_path / "summary.json").read_text())
    assert (early["interrupted"], late["interrupted"]) == (True, False)
    assert late["tracks"] == 1
    assert late["frames"] == 3
    assert late["media_s"] == 0.08
    assert late["watched"] == [[0.0, 0.08]]
    assert late["rim_px"] == 3.0
    assert late["counts"] == {"gate": {"left": 0, "right": 1}}
    assert late["stages"] == {"detect": 0.006, "track": 0.003}
    assert late["fps"] == 25.0
    assert late["settings"] == Settings().model_dump(mode="json")
    assert late["versions"]["vidtrack"]


def test_a_stopped_run_says_so(tmp_path):
    summary = Summary(tmp_path / "summary.json", "a.avi", Settings(), lambda: READING)
    summary.close()
    assert json.loads((tmp_path / "summary.json").read_text())["interrupted"] is True


def test_counts_are_in_order_of_time_with_their_evidence(tmp_path):
    sink = CountsFile(tmp_path / "counts.csv", LineCounter([parse_line("gate:100,0,100,200")]))
    for index, x in enumerate([80, 95, 104, 120, 140, 150]):
        sink.step(make_step(index, [(1, "c" if index > 4 else "t", x, 50), (2, "c", 215 - x, 50)], fps=10.0))
    sink.close()
    assert (tmp_path / "counts.csv").read_text().splitlines() == [
        "time_s,frame,line,direction,track_id",
        "0.155556,2,gate,right,1",
        "0.268750,3,gate,left,2",
    ]


def killed_run(folder):
    """What a run does until it is killed; with `python test_folder.py FOLDER` it runs until then."""
    counter = LineCounter([parse_line("gate:100,0,100,200")])
    sinks = (
        CountsFile(folder / "counts.csv", counter),
        Summary(folder / "summary.json", "a.avi", Settings(), lambda: READING, counter.totals),
        Confirmed(TrackTable(folder), MotFile(folder / "mot.txt")),
    )
    index = 0
    while True:
        letter = "o" if index % 10 in (3, 4) else "c"
        step = make_step(index, [(index // 20, letter, 20.0 + 10 * (index % 20), 50.0), (10**9, "c", 0, 0)])
        for sink in sinks:
            sink.step(step)
        index += 1
        time.sleep(0.002)


def line_count(path):
    return path.read_bytes().count(b"\n") if path.is_file() else 0


def test_a_killed_process_leaves_readable_files_that_repair_makes_whole(tmp_path):
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
    process = subprocess.Popen([sys.executable, __file__, str(tmp_path)], env=environment)
    try:
        deadline = time.monotonic() + 60
        while min(map(line_count, (tmp_path / "mot.txt", tmp_path / "tracks.csv"))) < 600:
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.05)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    with open(tmp_path / "tracks.csv", "a") as file:
        file.write("999999,1.0,7,conf")  # as if the kill had come within a write
    assert json.loads((tmp_path / "summary.json").read_text())["interrupted"] is True

    rows = repair(tmp_path)

    table = pq.read_table(tmp_path / "tracks.parquet")
    assert table.num_rows == rows > 500
    assert table.schema.field("x_px").metadata[b"unit"] == b"px"
    with open(tmp_path / "tracks.csv", newline="") as file:
        cells = [(int(row["frame"]), int(row["track_id"])) for row in csv.DictReader(file)]
    assert cells == list(zip(table["frame"].to_pylist(), table["track_id"].to_pylist(), strict=True))
    assert [frame for frame, _ in cells] == sorted(frame for frame, _ in cells)
    mot = [tuple(map(int, line.split(",")[:2])) for line in (tmp_path / "mot.txt").read_text().splitlines()]
    assert mot == sorted(mot)
    assert all(line.count(",") == 9 for line in (tmp_path / "mot.txt").read_text().splitlines())
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["interrupted"] is True
    assert summary["tracks"] == len({track for _, track in cells})
    assert summary["counts"]["gate"]["right"] >= 10
    assert not (tmp_path / "tracks.parquet.parts").exists()


def test_repair_changes_nothing_in_a_finished_run(tmp_path):
    summary = Summary(tmp_path / "summary.json", "a.avi", Settings(), lambda: READING)
    table = TrackTable(tmp_path)
    for index in range(4):
        step = make_step(index, [(1, "c", 1.5 * index, 2)])
        table.step(step)
        summary.step(step)
    table.close()
    summary.interrupted = False
    summary.close()
    before = pq.read_table(tmp_path / "tracks.parquet"), (tmp_path / "summary.json").read_text()
    assert repair(tmp_path) == 4
    assert pq.read_table(tmp_path / "tracks.parquet").equals(before[0], check_metadata=True)
    assert (tmp_path / "summary.json").read_text() == before[1]


def test_repair_refuses_what_is_no_run(tmp_path):
    with pytest.raises(FormatError, match="not a run"):
        repair(tmp_path)
    (tmp_path / "tracks.csv").write_text("a,b\n1,2\n")
    with pytest.raises(FormatError, match="damaged"):
        repair(tmp_path)


if __name__ == "__main__":
    killed_run(Path(sys.argv[1]))
