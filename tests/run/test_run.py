"""A run writes its results while it goes, and ends them whatever happens."""

import json
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest
from command_line import SAMPLES
from synthetic_steps import make_step

from vidtrack.config.load import load
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError, OutputError, SourceError, StoppedEarly
from vidtrack.output.summary import Summary
from vidtrack.run.files import run_file
from vidtrack.run.run import Extras, Pipeline, Run

CROSSING = str(SAMPLES / "crossing.avi")
SHORT = load(assignments=["source.end_s=1.5"])


class Told:
    """A sink that tells of its steps and its end; `full`: its last block does not fit on the disk."""

    def __init__(self, name, told, full=False):
        self.name, self.told, self.full = name, told, full

    def step(self, step):
        self.told.append((self.name, step.index))

    def close(self):
        self.told.append((self.name, "closed"))
        if self.full:
            raise StoppedEarly("cannot write tracks.csv: No space left on device")


def run_of(steps, sinks, output):
    def summary(folder):
        return Summary(folder / "summary.json", "a.avi", Settings(), dict)

    @contextmanager
    def pipeline():
        yield Pipeline("a", Path("a.avi"), None, steps, summary, lambda folder: iter(sinks))

    return Run(pipeline(), output)


def test_every_sink_has_a_step_before_it_is_shown_and_all_are_closed(tmp_path):
    told = []
    steps = [make_step(index, []) for index in range(2)]
    with run_of(steps, [Told("one", told), Told("two", told)], tmp_path / "out") as run:
        for step in run:
            told.append(("shown", step.index))
    seen = [(name, index) for index in range(2) for name in ("one", "two", "shown")]
    assert told == [*seen, ("two", "closed"), ("one", "closed")]
    found = summary(tmp_path / "out")
    assert (found["frames"], found["interrupted"]) == (2, False)


def test_a_run_whose_tables_cannot_be_ended_is_not_called_finished(tmp_path):
    told = []
    sinks = [Told("one", told), Told("two", told, full=True)]
    with pytest.raises(StoppedEarly, match="No space"), run_of([], sinks, tmp_path / "out"):
        pass
    assert told == [("two", "closed"), ("one", "closed")]
    assert summary(tmp_path / "out")["interrupted"] is True


def test_a_sink_that_cannot_be_opened_leaves_no_folder(tmp_path):
    def sinks():
        yield Told("one", told)
        raise OutputError("cannot write")

    told = []
    with pytest.raises(OutputError, match="cannot write"):
        run_of([], sinks(), tmp_path / "out")
    assert told == [("one", "closed")]
    assert not (tmp_path / "out").exists()


def summary(folder):
    return json.loads((folder / "summary.json").read_text())


def test_every_step_is_seen_and_written(tmp_path):
    with run_file(CROSSING, SHORT, tmp_path / "out") as run:
        steps = list(run)
    assert run.folder == tmp_path / "out"
    assert run.name == "crossing"
    assert run.count == len(steps) == 23
    assert [step.index for step in steps] == list(range(23))
    found = summary(run.folder)
    assert found["interrupted"] is False
    assert found["frames"] == found["frames_read"] == 23
    assert set(found["stages"]) >= {"read", "detect", "blobs", "track"}
    assert (found["width"], found["height"], found["fps"]) == (320, 240, 15.0)
    assert {path.name for path in run.folder.iterdir()} == {
        "tracks.csv",
        "tracks.parquet",
        "mot.txt",
        "summary.json",
        "tracks.png",
        "scene.jpg",
    }
    assert cv2.imread(str(run.folder / "scene.jpg")).shape == (240, 320, 3)


def test_a_run_left_by_an_error_is_complete_up_to_there(tmp_path):
    def use_half():
        with run_file(CROSSING, Settings(), tmp_path / "out") as run:
            for step in run:
                if step.index == 75:
                    raise RuntimeError("ours")

    with pytest.raises(RuntimeError, match="ours"):
        use_half()
    found = summary(tmp_path / "out")
    assert found["interrupted"] is True
    assert found["frames"] == 76
    frames = pq.read_table(tmp_path / "out" / "tracks.parquet")["frame"].to_pylist()
    assert max(frames) <= 75
    assert len((tmp_path / "out" / "tracks.csv").read_text().splitlines()) == len(frames) + 1


def test_a_run_that_is_never_started_leaves_empty_results(tmp_path):
    with run_file(CROSSING, SHORT, tmp_path / "out"):
        pass
    assert summary(tmp_path / "out")["frames"] == 0
    assert pq.read_table(tmp_path / "out" / "tracks.parquet").num_rows == 0


def test_extras_are_written_where_they_were_asked_for(tmp_path):
    settings = load(assignments=["source.end_s=8", ("output.lines", ["gate:180,0,180,240"])])
    with run_file(CROSSING, settings, tmp_path / "out", Extras(masks=tmp_path / "masks", decisions=True)) as run:
        count = sum(1 for _ in run)
    assert sorted(path.name for path in (tmp_path / "masks").iterdir()) == [f"{k:06d}.png" for k in range(count)]
    assert (tmp_path / "out" / "decisions.csv").stat().st_size > 0
    rows = (tmp_path / "out" / "counts.csv").read_text().splitlines()[1:]
    assert summary(tmp_path / "out")["counts"]
    assert len(rows) == 1  # the vehicle that goes right


def test_the_same_video_gives_the_same_tables(tmp_path):
    for name in ("one", "two"):
        with run_file(CROSSING, SHORT, tmp_path / name) as run:
            for _ in run:
                pass
    for table in ("tracks.csv", "mot.txt"):
        assert (tmp_path / "one" / table).read_bytes() == (tmp_path / "two" / table).read_bytes()


@pytest.mark.parametrize(
    ("source", "assignment", "error"),
    [
        ("missing.avi", "tracker.coast_s=1", SourceError),
        (CROSSING, "source.mask=missing.png", ConfigError),
        (CROSSING, 'output.lines=["gate"]', ConfigError),
        (CROSSING, 'output.lines=["a:1,2,3,4", "a:1,2,3,5"]', ConfigError),
    ],
)
def test_what_cannot_begin_leaves_no_folder(tmp_path, monkeypatch, source, assignment, error):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(error):
        run_file(source, load(assignments=[assignment]), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_span_without_a_frame_leaves_no_folder(tmp_path):
    with (
        pytest.raises(SourceError, match="no frame between 100 s"),
        run_file(CROSSING, load(assignments=["source.start_s=100"]), tmp_path / "out") as run,
    ):
        list(run)
    assert not (tmp_path / "out").exists()


def test_what_is_read_is_not_written_over(tmp_path):
    video, images = tmp_path / "road.mp4", tmp_path / "road"
    video.write_bytes((SAMPLES / "crossing.avi").read_bytes())
    images.mkdir()
    cv2.imwrite(str(images / "000000.png"), np.zeros((48, 64), np.uint8))
    for source, output, extras in (
        (video, tmp_path / "out", Extras(video=video)),
        (images, tmp_path / "out", Extras(masks=images)),
        (images / "*.png", tmp_path / "out", Extras(masks=images)),
        (images, images, Extras()),
    ):
        with pytest.raises(OutputError, match="is what is to be read"):
            run_file(str(source), SHORT, output, extras, force=True)
    assert video.read_bytes() == (SAMPLES / "crossing.avi").read_bytes()
    assert [path.name for path in images.iterdir()] == ["000000.png"]


def test_a_folder_that_is_taken_is_refused_before_anything_is_computed(tmp_path):
    (tmp_path / "old.txt").write_text("mine")
    with pytest.raises(OutputError, match="not empty"):
        run_file(CROSSING, SHORT, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["old.txt"]
