"""A live run writes what a run over a video writes, for as long as it goes, and outlives a full disk."""

import errno
import json
import os
import time
from threading import Timer

import av
import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest

import vidtrack.output.linefile as linefile
from vidtrack.config import load
from vidtrack.live.keep import parts_of
from vidtrack.live.outputs import Extras
from vidtrack.live.run import LiveRun
from vidtrack.output.folder import append
from vidtrack.output.repair import read_tracks
from vidtrack.run import Run
from vidtrack.state import read_state

TABLES = {"tracks.csv", "tracks.parquet", "mot.txt", "summary.json", "tracks.png"}


def settings(*assignments):
    return load(assignments=["live.timeout_s=2", "live.backoff_s=0.05", *assignments])


def run_for(run, seconds):
    """Iterate for so long; returns the frames' numbers."""
    timer = Timer(seconds, run.stop)
    timer.start()
    return [step.index for step in run]


def summary(folder):
    return json.loads((folder / "summary.json").read_text())


def test_the_results_are_those_of_a_run(camera, tmp_path):
    chosen = settings(("output.lines", ["gate:160,0,160,240"]))
    with LiveRun(camera.url(), chosen, tmp_path / "out", Extras(decisions=True)) as run:
        indices = run_for(run, 2.5)
    assert {path.name for path in run.folder.iterdir()} == TABLES | {"counts.csv", "decisions.csv"}
    rows = read_tracks(run.folder / "tracks.csv")
    assert pq.read_table(run.folder / "tracks.parquet").equals(rows)
    assert rows.num_rows > 20
    assert set(rows["frame"].to_pylist()) <= set(indices)
    found = summary(run.folder)
    assert found["interrupted"] is False
    assert found["frames"] == found["frames_read"] == len(indices)
    assert found["frames_received"] >= found["frames_read"]
    assert set(found["lost"].values()) == {0}
    assert 0 < found["latency_ms"]["p50"] < 1000
    assert found["began"].startswith("20")
    assert "gate" in found["counts"]


def test_the_annotated_video_runs_at_the_true_speed(camera, tmp_path):
    with LiveRun(camera.url(), settings(), tmp_path / "out", Extras(video=tmp_path / "film.mp4")) as run:
        for step in run:
            time.sleep(0.05)  # many frames are dropped
            if step.time_s > 2.0:
                run.stop()
        assert run.board.now().reading["frames_dropped"] > 20
    with av.open(str(tmp_path / "film.mp4")) as film:
        times = [float(frame.time) for frame in film.decode(video=0)]
    assert times[-1] - times[0] == pytest.approx(step.time_s, abs=0.3)


def test_the_board_shows_the_run(camera, tmp_path):
    with LiveRun(camera.url(login="u:secret@"), settings(), tmp_path / "out") as run:
        assert run.board.picture() is None
        assert run.board.now().frame == -1
        run_for(run, 1.5)
        now = run.board.now()
        assert run.board.newer(-1, 0.0).index == now.frame
        assert run.board.newer(now.frame, 0.01) is None
        picture = cv2.imdecode(np.frombuffer(run.board.picture(), np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (240, 320, 3)
    assert now.frame > 20
    assert now.fps_out > 5
    assert now.reading["fps_in"] > 5
    assert now.source == f"http://***@127.0.0.1:{camera.server_port}/video.mjpg"
    json.dumps([now.tracks, now.counts, now.problems, dict(now.reading)])


def test_parts_follow_the_clock_and_hold_everything(camera, tmp_path):
    out = tmp_path / "out"
    with LiveRun(camera.url(), settings("live.roll_s=1"), out) as run:
        indices = run_for(run, 2.8)
    parts = parts_of(out)
    assert len(parts) >= 3
    assert all({path.name for path in part.iterdir()} == TABLES for part in parts)
    frames = np.concatenate([read_tracks(part / "tracks.csv")["frame"].to_numpy() for part in parts])
    assert np.all(np.diff(frames) >= 0)
    assert summary(out)["frames"] == len(indices)
    assert sum(summary(part)["frames"] for part in parts) == len(indices)

    with LiveRun(camera.url(), settings("live.roll_s=1"), out) as run:  # goes on in the same folder
        run_for(run, 0.5)
    assert len(parts_of(out)) > len(parts)


def test_parts_that_a_kill_left_are_finished_by_the_next_run(camera, tmp_path):
    out = tmp_path / "out"
    with LiveRun(camera.url(), settings("live.roll_s=100000"), out) as run:
        run_for(run, 2.0)
    (part,) = parts_of(out)
    (part / "tracks.parquet").unlink()
    with open(part / "tracks.csv", "a") as file:
        file.write("1,2,3")
    with LiveRun(camera.url(), settings("live.roll_s=100000"), out) as run:
        run_for(run, 0.5)
    assert pq.read_table(part / "tracks.parquet").equals(read_tracks(part / "tracks.csv"))


def test_the_disk_is_bounded(camera, tmp_path, monkeypatch):
    monkeypatch.setattr("vidtrack.live.parts._LOOK_S", 0.2)
    extras = Extras(record=tmp_path / "tape")
    chosen = settings("live.roll_s=1", "live.keep_bytes=6_000_000")
    with LiveRun(camera.url(), chosen, tmp_path / "out", extras) as run:
        run_for(run, 4.0)
    total = sum(path.stat().st_size for path in tmp_path.rglob("*") if path.is_file())
    assert total < 8_000_000  # more comes between two looks
    assert len(parts_of(tmp_path / "tape")) >= 1


def test_a_step_of_the_wall_clock_disturbs_nothing(camera, tmp_path, monkeypatch):
    """NTP sets it back by an hour and later ahead by two: frames, tracks and files go on as they were."""
    true, offset = time.time, [0.0]
    monkeypatch.setattr(time, "time", lambda: true() + offset[0])
    out, seen = tmp_path / "out", []
    extras = Extras(state=tmp_path / "state", record=tmp_path / "tape")
    with LiveRun(camera.url("video.ts"), settings("live.roll_s=1800", "live.keep_s=100_000"), out, extras) as run:
        for step in run:
            offset[0] = 3600.0 * (-1 if 1.0 < step.time_s < 2.0 else step.time_s >= 2.0)
            seen.append((step.index, step.time_s, set(step.tracks.id[step.tracks.status > 0].tolist())))
            if step.time_s > 3.0:
                run.stop()
        reading = run.board.now().reading
        assert run.board.latency_ms()["max"] < 1500
    indices, times, alive = zip(*seen, strict=True)
    assert indices == tuple(range(len(seen)))
    assert 0 < np.diff(times).min() <= np.diff(times).max() < 0.5
    assert reading["reconnects"] == reading["stalls"] == 0
    assert reading["fps_in"] == pytest.approx(camera.fps, rel=0.5)
    for moment in (1.0, 2.0):
        k = int(np.searchsorted(times, moment))
        assert not alive[k - 3] or alive[k - 3] & alive[k + 3]  # tracks live through it
    parts = parts_of(out)
    assert len(parts) == 3
    frames = np.concatenate([read_tracks(part / "tracks.csv")["frame"].to_numpy() for part in parts])
    assert np.all(np.diff(frames) >= 0)
    with Run(str(tmp_path / "tape"), settings(), tmp_path / "again") as replayed:
        assert [step.index for step in replayed] == list(indices)


class Disk:
    """Makes writing fail while it is full."""

    def __init__(self, monkeypatch):
        self.full = False
        monkeypatch.setattr(linefile, "append", self._append)
        monkeypatch.setattr("vidtrack.output.disk.append", self._append)

    def _append(self, file, block):
        if self.full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), file.name)
        append(file, block)


def test_a_full_disk_is_outlived(camera, tmp_path, monkeypatch, caplog):
    disk = Disk(monkeypatch)
    out = tmp_path / "out"
    monkeypatch.setattr("vidtrack.live.recorder._RETRY_S", 0.2)
    with LiveRun(camera.url(), settings(), out, Extras(record=tmp_path / "tape")) as run:
        began = time.monotonic()
        times = []
        for step in run:
            now = time.monotonic() - began
            disk.full = 1.0 < now < 2.0
            times.append(step.time_s)
            if now > 4.0:
                run.stop()
    assert np.diff(times).max() < 1.0  # tracking went on
    rows = read_tracks(out / "tracks.csv")
    assert pq.read_table(out / "tracks.parquet").equals(rows)
    found = summary(out)
    assert 10 < found["lost"]["results"] < 120
    assert found["lost"]["recording"] > 0
    assert np.diff(np.unique(rows["time_s"].to_numpy())).max() > 0.5
    assert rows["time_s"].to_numpy().max() > 2.5
    assert "No space left" in caplog.text
    assert "tracking goes on" in caplog.text
    assert "is written again" in caplog.text
    assert len(parts_of(tmp_path / "tape")) >= 2
    with Run(str(tmp_path / "tape"), settings(), tmp_path / "again") as replayed:
        frames = [step.index for step in replayed]
    assert frames == sorted(set(frames))
    again = read_tracks(tmp_path / "again" / "tracks.csv").to_pylist()
    lived = {(row["frame"], row["track_id"]): row for row in rows.to_pylist()}
    settled = [row for row in again if row["time_s"] > 3.3]  # after the last part has begun
    assert settled
    assert settled == [lived[row["frame"], row["track_id"]] for row in settled]


def test_a_snapshot_at_any_instant_is_readable_and_nearly_complete(camera, tmp_path):
    """What a kill leaves is what the system has been given by then."""
    out, random = tmp_path / "out", np.random.default_rng(5)
    extras = Extras(state=tmp_path / "state", record=tmp_path / "tape")
    losses = []
    with LiveRun(camera.url(), settings("live.roll_s=2"), out, extras) as run:
        began = time.monotonic()
        looks = sorted(1.5 + 3.5 * random.random(50))
        for step in run:
            shown = {t for t, s in zip(step.tracks.id, step.tracks.status, strict=True) if s}
            while looks and time.monotonic() - began > looks[0]:
                looks.pop(0)
                for part in (part for part in parts_of(out) if (part / "tracks.csv").exists()):
                    text = (part / "tracks.csv").read_text()
                    assert text.endswith("\n")
                    assert len({line.count(",") for line in text.splitlines()}) == 1
                    json.loads((part / "summary.json").read_text())
                    assert all(line.count(",") == 9 for line in (part / "mot.txt").read_text().splitlines())
                    if (part / "tracks.parquet").exists():
                        pq.read_table(part / "tracks.parquet")
                assert read_state(extras.state)["tracker.register.next_id"] > max(shown, default=0)
                if shown and len(rows := text.splitlines()) > 1:
                    losses.append(step.time_s - float(rows[-1].split(",")[1]))
            if not looks:
                run.stop()
    assert len(losses) > 10
    assert np.median(losses) < 1.2
