"""A live run writes what a run over a video writes, for as long as it goes, and outlives a full disk."""

import errno
import json
import os
import time

import av
import cv2
import numpy as np
import pyarrow.parquet as pq
from cameras import wait_for
from live_runs import NEVER_ROLLS, frames, play, rows, run_until, settings

import vidtrack.output.linefile as linefile
from vidtrack.output.confirmed import LIVE_HOLD_S
from vidtrack.output.folder import append
from vidtrack.output.repair import read_tracks
from vidtrack.recording.retention import parts_of, size_of
from vidtrack.run.files import run_file
from vidtrack.run.live.outputs import LiveExtras
from vidtrack.run.live.run import LiveRun
from vidtrack.state import read_state
from vidtrack.tracks import Status

TABLES = {"tracks.csv", "tracks.parquet", "mot.txt", "summary.json", "tracks.png", "scene.jpg"}


def summary(folder):
    return json.loads((folder / "summary.json").read_text())


def test_the_results_are_those_of_a_run(camera, tmp_path):
    chosen = settings(("output.lines", ["gate:160,0,160,240"]))
    with LiveRun(camera.url(), chosen, tmp_path / "out", LiveExtras(decisions=True)) as run:
        seen = run_until(run, rows(40))
    assert {path.name for path in run.folder.iterdir()} == TABLES | {"counts.csv", "decisions.csv", "intervals"}
    table = read_tracks(run.folder / "tracks.csv")
    assert pq.read_table(run.folder / "tracks.parquet").equals(table)
    assert table.num_rows >= 40
    assert set(table["frame"].to_pylist()) <= {each.index for each in seen}
    found = summary(run.folder)
    assert found["interrupted"] is False
    assert found["frames"] == found["frames_read"] == len(seen)
    assert found["frames_received"] >= found["frames_read"]
    assert set(found["lost"].values()) == {0}
    assert 0 < found["latency_ms"]["p50"] <= found["latency_ms"]["max"]
    assert found["began"].startswith("20")
    assert "gate" in found["counts"]


def test_the_annotated_video_runs_at_the_true_speed(camera, tmp_path):
    with LiveRun(camera.url(), settings(), tmp_path / "out", LiveExtras(video=tmp_path / "film.mp4")) as run:
        true = []
        for step in run:
            true.append(step.time_s)
            time.sleep(0.05)  # frames are dropped
            if len(true) == 20:
                run.stop()
        assert run.board.now().reading["frames_dropped"] > 20
    with av.open(str(tmp_path / "film.mp4")) as film:
        times = np.array([float(frame.time) for frame in film.decode(video=0)])
    assert len(times) == 20 - summary(run.folder)["lost"]["video"]
    assert np.abs(times[:, None] - true).min(axis=1).max() < 1e-3


def test_the_board_shows_the_run(camera, tmp_path):
    with LiveRun(camera.url(login="u:secret@"), settings(), tmp_path / "out") as run:
        assert run.board.picture() is None
        assert run.board.now().frame == -1
        run_until(run, frames(20))
        now = run.board.now()
        assert run.board.newer(-1, 0.0).index == now.frame
        assert run.board.newer(now.frame, 0.01) is None
        picture = cv2.imdecode(np.frombuffer(run.board.picture(), np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (240, 320, 3)
    assert now.frame == 19
    assert now.fps_out > 0
    assert now.reading["fps_in"] > 0
    assert now.source == f"http://***@127.0.0.1:{camera.server_port}/video.mjpg"
    json.dumps([now.tracks, now.counts, now.problems, dict(now.reading)])


def test_parts_follow_the_clock_and_hold_everything(camera, tmp_path):
    out, chosen = tmp_path / "out", settings("live.roll_s=0.5")
    with LiveRun(camera.url(), chosen, out) as run:
        seen = run_until(run, lambda seen: len(parts_of(out)) >= 3 and rows(5)(seen))
    parts = parts_of(out)
    empty = {"scene.jpg"}  # a part that ended before its first picture has no scene
    assert all(TABLES - empty <= {path.name for path in part.iterdir()} <= TABLES for part in parts)
    assert any((part / "scene.jpg").is_file() for part in parts)
    numbers = np.concatenate([read_tracks(part / "tracks.csv")["frame"].to_numpy() for part in parts])
    assert np.all(np.diff(numbers) >= 0)
    assert summary(out)["frames"] == len(seen)
    assert sum(summary(part)["frames"] for part in parts) == len(seen)

    with LiveRun(camera.url(), chosen, out) as run:  # goes on in the same folder
        run_until(run, frames(1))
    assert len(parts_of(out)) > len(parts)


def test_parts_that_a_kill_left_are_finished_by_the_next_run(camera, tmp_path):
    out = tmp_path / "out"
    with LiveRun(camera.url(), settings(NEVER_ROLLS), out) as run:
        run_until(run, rows(5))
    (part,) = parts_of(out)
    (part / "tracks.parquet").unlink()
    with open(part / "tracks.csv", "a") as file:
        file.write("1,2,3")
    with LiveRun(camera.url(), settings(NEVER_ROLLS), out) as run:
        run_until(run, frames(1))
    assert pq.read_table(part / "tracks.parquet").equals(read_tracks(part / "tracks.csv"))


def test_the_disk_is_bounded(camera, tmp_path, monkeypatch):
    monkeypatch.setattr("vidtrack.run.live.parts._LOOK_S", 0.1)
    out, tape = tmp_path / "out", tmp_path / "tape"
    deleted, sizes = [], []

    def are_deleted(seen):
        sizes.append(size_of(tmp_path))
        kept = parts_of(tape)
        deleted.extend(part for part in begun if part not in kept)
        begun.extend(part for part in kept if part not in begun)
        return len(set(deleted)) >= 3

    begun = []
    with LiveRun(
        camera.url(), settings("live.roll_s=0.5", "live.keep_bytes=20e6"), out, LiveExtras(record=tape)
    ) as run:
        run_until(run, are_deleted)
    assert deleted[0] == begun[0]
    assert max(sizes) < 20e6


def test_a_step_of_the_wall_clock_disturbs_nothing(camera, tmp_path, monkeypatch):
    """NTP sets it back by an hour and later ahead by two: frames, tracks and files go on as they were."""
    began_s, offset_s = time.monotonic(), 0.0
    monkeypatch.setattr(time, "time", lambda: 1_800_000_900 + time.monotonic() - began_s + offset_s)
    out, moments = tmp_path / "out", []

    def story(seen):
        nonlocal offset_s
        yield rows(10)
        for part, step_s in ((2, -3600.0), (3, 7200.0)):
            offset_s += step_s
            moments.append(len(seen))
            yield lambda seen, part=part: len(parts_of(out)) == part and len(seen) > moments[-1] + 5

    extras = LiveExtras(state=tmp_path / "state", record=tmp_path / "tape")
    chosen = settings("live.every_frame=true", "live.roll_s=1800", "live.keep_s=1e9")
    with LiveRun(camera.url("video.ts"), chosen, out, extras) as run:
        seen = play(run, story)
        reading = run.board.now().reading
        assert run.board.latency_ms()["max"] < 1_000_000
    assert [each.index for each in seen] == list(range(len(seen)))
    steps_s = np.diff([each.time_s for each in seen])
    assert 0 < steps_s.min() <= steps_s.max() < 0.5
    assert reading["reconnects"] == reading["stalls"] == 0
    assert 0 < reading["fps_in"] < 1000
    for k in moments:
        assert not seen[k - 1].tracks or seen[k - 1].tracks & seen[k + 3].tracks  # they live through it
    parts = parts_of(out)
    assert len(parts) == 3
    numbers = np.concatenate([read_tracks(part / "tracks.csv")["frame"].to_numpy() for part in parts])
    assert np.all(np.diff(numbers) >= 0)
    with run_file(str(tmp_path / "tape"), settings(), tmp_path / "again") as replayed:
        assert [step.index for step in replayed] == [each.index for each in seen]


class Disk:
    """Makes writing fail while it is full."""

    def __init__(self, monkeypatch):
        self.full = False
        monkeypatch.setattr(linefile, "append", self._append)
        monkeypatch.setattr("vidtrack.output.ffmpeg_file.append", self._append)

    def _append(self, file, block):
        if self.full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), file.name)
        append(file, block)


def test_a_full_disk_is_outlived(camera, tmp_path, monkeypatch, caplog):
    disk = Disk(monkeypatch)
    monkeypatch.setattr("vidtrack.recording.recorder._RETRY_S", 0.2)
    out, tape = tmp_path / "out", tmp_path / "tape"
    early = ""

    def lost(name):
        return run.board.now().reading["lost"][name]

    def story(seen):
        nonlocal early
        yield lambda seen: (out / "tracks.csv").read_text().count("\n") > 5
        disk.full = True
        early = whole_lines(out / "tracks.csv")
        yield lambda seen: lost("results") > 10 and lost("recording") > 0
        disk.full = False
        yield lambda seen: "is written again" in caplog.text and len(parts_of(tape)) >= 2
        again = len(seen)
        yield lambda seen: rows(20)(seen[again:])

    with LiveRun(camera.url(), settings(), out, LiveExtras(record=tape)) as run:
        seen = play(run, story)
    assert [each.index for each in seen] == list(range(len(seen)))  # tracking went on
    table = read_tracks(out / "tracks.csv")
    assert pq.read_table(out / "tracks.parquet").equals(table)
    assert (out / "tracks.csv").read_text().startswith(early)
    assert "No space left" in caplog.text
    assert "tracking goes on" in caplog.text
    assert summary(out)["lost"]["results"] < len(seen)
    with run_file(str(tape), settings(), tmp_path / "again") as replayed:
        numbers = [step.index for step in replayed]
    assert numbers == sorted(set(numbers))
    last = parts_of(tape)[-1]
    first = int((last / "frames.csv").read_text().splitlines()[1].split(",")[0])
    lived, again = (
        [row for row in read_tracks(folder / "tracks.csv").to_pylist() if row["frame"] >= first]
        for folder in (out, tmp_path / "again")
    )
    assert lived
    assert again == lived


def test_a_snapshot_at_any_instant_is_readable_and_nearly_complete(camera, tmp_path):
    """What a kill leaves is what the system has been given by then."""
    out, extras = tmp_path / "out", LiveExtras(state=tmp_path / "state", record=tmp_path / "tape")
    shown_s, looks = [], 0
    with LiveRun(camera.url(), settings("live.roll_s=1"), out, extras) as run:
        for step in run:
            shown = step.tracks.id[step.tracks.status != Status.TENTATIVE]
            assert read_state(extras.state)["tracker.register.next_id"] > max(shown, default=0)
            for part in parts_of(out):
                check_readable(part)
            due_s = [time_s for time_s in shown_s if time_s < step.time_s - LIVE_HOLD_S]
            if due_s and step.index % 8 == 0:
                wait_for(lambda: last_s(out) > due_s[-1] - 1e-3)  # noqa: B023 (it has no next round)
                looks += 1
            if len(shown):
                shown_s.append(step.time_s)
            if looks == 5:
                run.stop()


def whole_lines(table):
    """Its text without a line that is just being written."""
    return "".join(table.read_text().rpartition("\n")[:2])


def last_s(folder):
    """Time of the last row in all its parts."""
    tables = [part / "tracks.csv" for part in parts_of(folder) if (part / "tracks.csv").exists()]
    return max(float(line.split(",")[1]) for path in tables for line in ["0,-1", *whole_lines(path).splitlines()[1:]])


def check_readable(part):
    """Whatever moment it is."""
    for name in filter(lambda name: (part / name).exists(), ("tracks.csv", "mot.txt")):
        assert len({line.count(",") for line in whole_lines(part / name).splitlines()}) <= 1
    if (part / "summary.json").exists():
        json.loads((part / "summary.json").read_text())
    if (part / "tracks.parquet").exists():
        pq.read_table(part / "tracks.parquet")
