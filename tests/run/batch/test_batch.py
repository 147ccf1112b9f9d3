"""A batch does what is missing, failed or changed, once, and says what it set aside."""

import json
import os
from dataclasses import replace

import pyarrow.parquet as pq
import pytest
from places import FRAMES, AtOnce, batch_of, do, engine_of, small_videos

from vidtrack.config.load import load
from vidtrack.errors import ConfigError, OutputError, StoppedEarly
from vidtrack.run.batch.batch import ATTEMPTS
from vidtrack.run.batch.index import DONE, SET_ASIDE
from vidtrack.run.batch.work import work
from vidtrack.run.files import run_file

AGAIN = {"error": "the disk is full", "again": True, "unreadable": False}


@pytest.fixture(scope="module")
def videos(tmp_path_factory):
    folder = small_videos(tmp_path_factory.mktemp("videos"))
    (folder / "bad.mp4").write_text("no video")
    return folder


@pytest.fixture(scope="module")
def done(videos, tmp_path_factory):
    """A batch of two videos and a file that is none, done once."""
    out = tmp_path_factory.mktemp("out")
    batch = batch_of([videos], out)
    do(batch)
    return out, batch


def index(out):
    return {row["source"]: row for row in pq.read_table(out / "index.parquet").to_pylist()}


def test_each_source_has_a_row_and_a_folder(videos, done):
    out, batch = done
    rows = index(out)
    assert {source.removeprefix(str(videos)): row["state"] for source, row in rows.items()} == {
        "/bad.mp4": SET_ASIDE,
        "/cam1/08-00.avi": DONE,
        "/cam2/08-00.avi": DONE,
    }
    bad, one, _ = (rows[source] for source in sorted(rows))
    assert "as a video" in bad["error"]
    assert (one["frames"], one["media_s"], one["coverage"]) == (FRAMES, FRAMES / 15, 1.0)
    assert {path.name for path in (out / "results").iterdir()} == {r["folder"] for r in rows.values() if not r["error"]}
    assert (batch.progress.done, batch.progress.aside, batch.unreadable) == (2, 1, 1)
    assert not (out / "partial").exists() or not list((out / "partial").iterdir())


def test_results_are_those_of_a_run(videos, done, tmp_path):
    out, _ = done
    source = videos / "cam1" / "08-00.avi"
    with run_file(str(source), load(), tmp_path) as run:
        for _ in run:
            pass
    folder = out / "results" / index(out)[str(source)]["folder"]
    for path in tmp_path.iterdir():
        if path.name not in ("summary.json", "tracks.parquet"):
            assert (folder / path.name).read_bytes() == path.read_bytes(), path.name
    assert json.loads((folder / "source.json").read_text())["source"] == str(source)


def test_the_same_again_does_only_what_failed(videos, done):
    out, _ = done
    tasks = do(batch_of([videos], out))
    assert [name.rpartition("-")[0] for _, name, _ in tasks] == ["bad"]


def test_what_changed_is_done_again(tmp_path):
    folder = small_videos(tmp_path / "in")
    first = do(batch_of([folder], tmp_path / "out"))
    assert len(first) == 2
    assert len(do(batch_of([folder], tmp_path / "out", given=["tracker.coast_s=1.5"]))) == 2
    os.utime(folder / "cam1" / "08-00.avi", (1, 1))
    changed = do(batch_of([folder], tmp_path / "out", given=["tracker.coast_s=1.5"]))
    assert len(changed) == 1
    assert len(do(batch_of([folder], tmp_path / "out", given=["tracker.coast_s=1.5"], again=True))) == 2


def test_results_without_an_index_are_found(videos, done, tmp_path):
    """A batch that was killed had no time to write what it had done."""
    out, _ = done
    whole = (out / "index.parquet").read_bytes()
    begun = batch_of([videos], tmp_path)
    (out / "index.parquet").write_bytes((tmp_path / "index.parquet").read_bytes())
    assert begun.progress.before == 0
    assert batch_of([videos], out).progress.before == 2
    (out / "index.parquet").write_bytes(whole)


@pytest.mark.parametrize(("fails", "state", "attempts"), [(ATTEMPTS - 1, DONE, ATTEMPTS), (9, SET_ASIDE, ATTEMPTS)])
def test_what_may_help_is_tried_again(videos, tmp_path, fails, state, attempts):
    source = videos / "cam1" / "08-00.avi"
    answers = [AGAIN] * fails

    def stub(told):
        return answers.pop() if answers else work(told, lambda: None)

    batch = batch_of([source], tmp_path)
    assert len(do(batch, AtOnce(stub))) == attempts
    row = batch.rows[str(source)]
    assert (row.state, row.attempts, row.error) == (state, attempts, None if state == DONE else "the disk is full")


def test_an_error_of_the_engine_costs_one_source(videos, tmp_path):
    def lose(told):
        if "cam1" in told["address"]:
            raise RuntimeError("the worker died")
        return work(told, lambda: None)

    batch = batch_of([videos / "cam1", videos / "cam2"], tmp_path)
    do(batch, AtOnce(lose))
    assert sorted(row.state for row in batch.rows.values()) == [DONE, SET_ASIDE]
    assert "the worker died" in next(row.error for row in batch.rows.values() if row.error)


@pytest.mark.parametrize("warm_s", [None, 0.5])
def test_a_long_file_is_cut_and_goes_on_with_the_missing_slices(videos, tmp_path, warm_s):
    source = videos / "cam1" / "08-00.avi"
    stops = ["slice 1"]

    def stop(told):
        if told["kind"] == "slice" and told["number"] == 1 and stops:
            stops.pop()
            raise KeyboardInterrupt
        return work(told, lambda: None)

    with pytest.raises(KeyboardInterrupt):
        do(batch_of([source], tmp_path, slice_s=1.0, warm_s=warm_s), AtOnce(stop))
    batch = batch_of([source], tmp_path, slice_s=1.0, warm_s=warm_s)
    assert [(kind, number) for kind, _, number in do(batch)] == [("file", 0), ("slice", 1), ("stitch", 0)]
    assert batch.rows[str(source)].frames == FRAMES
    assert not (tmp_path / "slices" / batch.rows[str(source)].folder).exists()


def test_no_process_stays_behind_a_batch_that_is_done(videos, done):
    out, _ = done
    ended = []
    engine = replace(engine_of(AtOnce(lambda told: AGAIN | {"again": False})), end=ended.append)
    batch_of([videos], out).run(engine, lambda progress: None)
    assert ended == [str(out)]


def test_a_slice_that_was_copied_in_part_is_done_again(videos, tmp_path):
    source = videos / "cam1" / "08-00.avi"

    def stop(told):
        if told["kind"] == "stitch":
            raise KeyboardInterrupt
        return work(told, lambda: None)

    with pytest.raises(KeyboardInterrupt):
        do(batch_of([source], tmp_path, slice_s=1.0), AtOnce(stop))
    next(tmp_path.glob("slices/*/*/00001/slice.json")).unlink()
    batch = batch_of([source], tmp_path, slice_s=1.0)
    assert [(kind, number) for kind, _, number in do(batch)] == [("file", 0), ("slice", 1), ("stitch", 0)]
    assert batch.rows[str(source)].state == DONE


def test_another_batch_is_not_touched(videos, done, tmp_path):
    out, _ = done
    extra = tmp_path / "other.mp4"
    extra.write_bytes(b"x")
    with pytest.raises(OutputError, match="another batch: none of its 3 sources"):
        batch_of([extra], out)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").write_text("")
    with pytest.raises(OutputError, match=r"is no batch's: it holds thesis\.tex"):
        batch_of([extra], tmp_path / "full")
    (tmp_path / "full" / "index.parquet").write_text("")
    with pytest.raises(OutputError, match="not that of a batch"):
        batch_of([extra], tmp_path / "full")


def test_settings_are_refused_before_anything_is_begun(videos, tmp_path):
    with pytest.raises(ConfigError, match="has no effect"):
        batch_of([videos / "cam1"], tmp_path, given=["radar.accel=1"])
    assert not list(tmp_path.iterdir())


def test_an_engine_that_is_gone_ends_the_batch_and_keeps_what_is_done(videos, tmp_path):
    executor = AtOnce()
    batch = batch_of([videos / "cam1", videos / "cam2"], tmp_path)

    def gone():
        raise StoppedEarly("the scheduler is gone")

    def lose(told):
        if "cam2" in told["address"]:
            raise RuntimeError("connection lost")
        return work(told, lambda: None)

    executor.do = lose
    engine = engine_of(executor)
    object.__setattr__(engine, "check", gone)
    with pytest.raises(StoppedEarly, match="gone"):
        batch.run(engine, lambda progress: None)
    assert sorted(row["state"] for row in index(tmp_path).values()) == [DONE, "waiting"]
