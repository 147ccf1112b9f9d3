"""How much is written: counts, also tracks, or all."""

import json

import pytest
from command_line import SAMPLES
from test_live_parts import Clock, Station

from vidtrack.config.inputs import Input
from vidtrack.config.load import load
from vidtrack.errors import ConfigError
from vidtrack.output.parquet import parts_folder, read_parquet
from vidtrack.output.repair import is_unfinished, repair
from vidtrack.output.replay import read_run
from vidtrack.recording.retention import parts_of
from vidtrack.run.files import run_file

COUNTS = {"counts.csv", "summary.json"}
FILES = {
    "counts": COUNTS,
    "tracks": COUNTS | {"tracks.parquet"},
    "all": COUNTS | {"tracks.parquet", "tracks.csv", "mot.txt", "tracks.png"},
}


def names(folder):
    return {path.name for path in folder.iterdir()}


@pytest.mark.parametrize("level", FILES)
def test_the_parts_of_a_live_run(tmp_path, monkeypatch, level):
    station = Station(tmp_path, Clock(monkeypatch), f"output.level={level}")
    station.drive(0, 15)
    station.parts.finish()
    parts = parts_of(tmp_path)
    assert [names(part) for part in parts] == [FILES[level]] * 2
    assert sum((part / "counts.csv").read_text().count("right") for part in parts) == 14


def test_the_tracks_are_the_same(tmp_path, monkeypatch):
    tables = {}
    for level in ("tracks", "all"):
        station = Station(tmp_path / level, Clock(monkeypatch), f"output.level={level}")
        station.drive(0, 8)
        station.parts.finish()
        (part,) = parts_of(tmp_path / level)
        tables[level] = read_parquet(part / "tracks.parquet")
    for name in tables["all"].column_names:  # CSV is rounded
        assert tables["tracks"][name].to_pylist() == pytest.approx(tables["all"][name].to_pylist(), nan_ok=True)


def test_a_killed_run_leaves_its_last_parts(tmp_path, monkeypatch):
    monkeypatch.setattr("vidtrack.output.parquet._PART_ROWS", 50)
    station = Station(tmp_path, Clock(monkeypatch), "output.level=tracks")
    station.drive(0, 8)
    (part,) = parts_of(tmp_path)
    assert is_unfinished(part)
    left = sum(len(read_parquet(path)) for path in parts_folder(part / "tracks.parquet").iterdir())
    assert repair(part) == len(read_parquet(part / "tracks.parquet")) == left > 200
    assert not is_unfinished(part)
    assert repair(part) == left  # a finished one is left as it is


@pytest.mark.parametrize("level", FILES)
def test_a_run_over_a_file(tmp_path, level):
    chosen = load(assignments=[f"output.level={level}", ("output.lines", ["gate:160,0,160,240"])])
    with run_file(str(SAMPLES / "crossing.avi"), chosen, tmp_path / "out") as run:
        for _ in run:
            pass
    assert names(run.folder) - {"scene.jpg"} == FILES[level]
    if level != "counts":  # vidtrack view reads either
        assert len(read_run(run.folder).table) == len(read_parquet(run.folder / "tracks.parquet")) > 100


def test_another_level_is_refused():
    with pytest.raises(ConfigError, match="level"):
        load(assignments=["output.level=much"])


def test_thinned_tracks_are_some_of_all(tmp_path, monkeypatch):
    """Every tenth of a second: of 25 frames/s every third. Counts and the number of tracks stay."""
    tables = {}
    for every_s in (0, 0.1):
        station = Station(tmp_path / str(every_s), Clock(monkeypatch), f"output.every_s={every_s}")
        station.drive(0, 9)
        station.parts.finish()
        (part,) = parts_of(tmp_path / str(every_s))
        summary = json.loads((part / "summary.json").read_text())
        assert (summary["frames"], summary["tracks"], summary["counts"]["gate"]["right"]) == (225, 9, 8)
        tables[every_s] = read_parquet(part / "tracks.parquet")
        lines = (part / "mot.txt").read_text().splitlines()
        assert len(lines) == len(tables[every_s])
    every_third = tables[0]["frame"].to_numpy() % 3 == 0
    assert tables[0.1].equals(tables[0].filter(every_third))


def test_a_thinned_run_over_a_file(tmp_path):
    frames = {}
    for every_s in (0, 0.5):
        chosen = load(assignments=[f"output.every_s={every_s}"])
        with run_file(str(SAMPLES / "crossing.avi"), chosen, tmp_path / str(every_s)) as run:
            for _ in run:
                pass
        frames[every_s] = set(read_parquet(run.folder / "tracks.parquet")["frame"].to_pylist())
    assert frames[0.5] < frames[0]
    assert 0 < len(frames[0.5]) <= len(frames[0]) / 8 + 1


def test_thinning_needs_tracks():
    with pytest.raises(ConfigError, match=r"no effect with output\.level=counts"):
        load(assignments=["output.level=counts", "output.every_s=1"], kind=Input.CAMERA)
