"""A recording is repeated bit by bit, and a saved state goes on: no identity is given twice."""

import time

import cv2
import numpy as np
import pytest
from cameras import Picture, Script, crossing, script_of
from click.testing import CliRunner
from live_runs import frames, play, rows, run_until, settings

from vidtrack.cli import cli
from vidtrack.config.load import load
from vidtrack.errors import ConfigError, FormatError, OutputError, SourceError
from vidtrack.output.repair import read_tracks
from vidtrack.recording.retention import parts_of
from vidtrack.recording.source import is_recording, recorded_settings
from vidtrack.run.batch.plan import Plan
from vidtrack.run.batch.sources import listed
from vidtrack.run.files import run_file
from vidtrack.run.live.checkpoint import CheckpointFile
from vidtrack.run.live.outputs import LiveExtras
from vidtrack.run.live.run import LiveRun
from vidtrack.state import read_state

PICTURES = crossing()
SITE = """[site]
name = "yard"
width = 320
height = 240
[calibration]
picture = [[0, 0], [319, 0], [319, 239], [0, 239]]
ground = [[0, 0], [31.9, 0], [31.9, -23.9], [0, -23.9]]
"""


def replay(tape, folder, chosen):
    with run_file(str(tape), chosen, folder) as run:
        for _ in run:
            pass
    return (folder / "tracks.csv").read_text()


@pytest.mark.parametrize(("path", "max_fps"), [("video.ts", None), ("video.mjpg", None), ("video.ts", 15.0)])
def test_a_recording_gives_the_same_tracks(camera, tmp_path, path, max_fps):
    site = tmp_path / "yard.toml"
    site.write_text(SITE)
    chosen = settings("tracker.confirm_s=0.1", f"output.site={site}", f"source.max_fps={max_fps}")
    extras = LiveExtras(record=tmp_path / "tape")
    with LiveRun(camera.url(path), chosen, tmp_path / "out", extras) as run:

        def story(seen):
            yield rows(10)
            camera.pictures = [cv2.resize(picture, (480, 360)) for picture in PICTURES]
            camera.connection += 1  # hangs up
            yield lambda seen: len(parts_of(tmp_path / "tape")) == 2
            since = len(seen)
            yield lambda seen: rows(20)(seen[since:])

        play(run, story)
    assert len(parts_of(tmp_path / "tape")) == 2  # one for each connection
    assert is_recording(str(tmp_path / "tape"))
    (results,) = parts_of(tmp_path / "out")
    lived = (results / "tracks.csv").read_text()
    assert lived.count("\n") > 20
    table = read_tracks(results / "tracks.csv")
    assert max(table["x_px"].to_pylist()) < 330  # pixels of the first picture, before and after
    site.write_text(SITE.replace("31.9", "63.8"))  # drawn anew since: the repetition is at the site of then
    recorded = load(base=recorded_settings(str(tmp_path / "tape")))
    assert recorded.output.site.read_text() == SITE
    output = recorded.output.model_copy(update={"site": chosen.output.site})
    assert recorded.model_copy(update={"output": output}) == chosen
    assert replay(tmp_path / "tape", tmp_path / "again", recorded) == lived


@pytest.mark.parametrize("command", ["track", "doctor"])
def test_nothing_is_asked_of_a_recording_that_it_cannot_follow(camera, tmp_path, command):
    tape, said = tmp_path / "tape", "source.max_fps has no effect on a recording of a live run"
    with LiveRun(camera.url(), settings(), tmp_path / "out", LiveExtras(record=tape)) as run:
        run_until(run, frames(2))
    with pytest.raises(ConfigError, match=said):
        CliRunner().invoke(cli, [command, str(tape), "--max-fps", "5"], standalone_mode=False, catch_exceptions=False)
    plan = Plan(str(tmp_path / "batch"), None, ("source.max_fps=5",), 0.0, None, 60.0)
    with pytest.raises(ConfigError, match=said):
        list(plan.tasks(listed([str(tape)])))


def test_parts_cut_from_one_connection_do_too(camera, tmp_path):
    chosen = settings("live.roll_s=0.5", "tracker.confirm_s=0.1")
    tape = tmp_path / "tape"
    with LiveRun(camera.url("video.ts"), chosen, tmp_path / "out", LiveExtras(record=tape)) as run:
        run_until(run, lambda seen: len(parts_of(tape)) >= 3 and rows(20)(seen))
    lived = [(part / "tracks.csv").read_text().splitlines() for part in parts_of(tmp_path / "out")]
    whole = [row for part in lived for row in part[1:]]
    assert replay(tape, tmp_path / "again", chosen).splitlines()[1:] == whole
    begun = [part for part in parts_of(tape) if is_recording(part)]  # the last may have ended before its first frame
    alone = [replay(part, tmp_path / part.name, chosen).splitlines()[1:] for part in begun]
    assert any(alone)
    assert set().union(*alone) <= set(whole)  # a part alone begins where it began


def test_a_raw_camera_is_recorded_without_loss(compiled, tmp_path):
    class Raw(Script):
        is_raw = True

    grey = [cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY) for picture in PICTURES[:100]]
    acts = [act for k, picture in enumerate(grey) for act in (0.005, Picture(picture, stamp_s=k / 60))]
    connect = script_of(Raw(*acts))
    device = "http://camera/"  # where the script pretends to be
    chosen = settings("live.every_frame=true", "tracker.confirm_s=0.1")
    with LiveRun(device, chosen, tmp_path / "out", LiveExtras(record=tmp_path / "tape"), connect=connect) as run:
        run_until(run, frames(100))
    lived = (tmp_path / "out" / "tracks.csv").read_text()
    assert lived.count("\n") > 5
    assert replay(tmp_path / "tape", tmp_path / "again", chosen) == lived


def test_a_recording_that_was_cut_is_repeated_up_to_there(camera, tmp_path):
    with LiveRun(camera.url("video.ts"), settings(), tmp_path / "out", LiveExtras(record=tmp_path / "tape")) as run:
        lived = run_until(run, frames(60))
    (part,) = parts_of(tmp_path / "tape")
    for name in ("video.mkv", "frames.csv"):
        content = (part / name).read_bytes()
        (part / name).write_bytes(content[: len(content) * 2 // 3])
    with run_file(str(tmp_path / "tape"), settings(), tmp_path / "again") as run:
        assert 5 < sum(1 for _ in run) < len(lived)


def test_an_empty_recording_says_so(tmp_path):
    part = tmp_path / "2026-01-01T00-00-00Z"
    part.mkdir()
    for name in ("video.mkv", "state.npz"):
        (part / name).touch()
    with pytest.raises(SourceError, match="no frame"):
        run_file(str(tmp_path), settings(), tmp_path / "out")


def ids(folder):
    return set(read_tracks(folder / "tracks.csv")["track_id"].to_pylist())


def test_a_restart_goes_on_with_scene_tracks_and_numbers(camera, tmp_path):
    extras = LiveExtras(state=tmp_path / "state")
    with LiveRun(camera.url(), settings(), tmp_path / "one", extras) as run:
        first = run_until(run, rows(10))
    saved = read_state(extras.state)
    assert saved["frame"] == first[-1].index
    pause_s = time.time() - saved["unix_s"]
    with LiveRun(camera.url(), settings(), tmp_path / "two", extras) as run:
        second = run_until(run, rows(10))
    assert second[0].index == first[-1].index + 1
    assert second[0].time_s > first[-1].time_s + pause_s
    assert saved["tracker.register.next_id"] <= read_state(extras.state)["tracker.register.next_id"]
    old, new = ids(tmp_path / "one"), ids(tmp_path / "two")
    assert old
    assert max(new - old, default=0) < saved["tracker.register.next_id"] + 1000  # nothing was lost in between
    assert (new & old) <= first[-1].tracks


def test_a_killed_run_never_gives_a_number_twice(camera, tmp_path):
    path = tmp_path / "state"
    with LiveRun(camera.url(), settings(), tmp_path / "one", LiveExtras(state=path)) as run:
        run_until(run, rows(5))
        killed = path.read_bytes()  # what is on the disk while it runs
        given = run._checkpoint.tracker.register.next_id
    assert read_state(path)["tracker.register.next_id"] == given
    path.write_bytes(killed)
    with LiveRun(camera.url(), settings(), tmp_path / "two", LiveExtras(state=path)) as run:
        run_until(run, rows(5))
    fresh = ids(tmp_path / "two") - ids(tmp_path / "one")
    assert fresh
    assert min(fresh) >= given
    one, two = (read_tracks(tmp_path / name / "tracks.csv")["frame"].to_pylist() for name in ("one", "two"))
    assert min(two) > max(one)


def test_numbers_are_reserved_before_they_are_scarce(tmp_path):
    class Register:
        next_id = 1

    class Checkpoint:
        tracker = type("Tracker", (), {"register": Register})
        frame = 0

        def gather(self):
            return {"tracker.register.next_id": Register.next_id}

    memory, file = Checkpoint(), CheckpointFile(tmp_path / "state")
    for Register.next_id in range(1, 40_000, 100):
        file.offer(memory)
        if file._writing is not None:
            file._writing.join()
        assert read_state(file.path)["tracker.register.next_id"] > Register.next_id + 4000


def test_a_foreign_state_is_refused(camera, tmp_path):
    (tmp_path / "state").write_text("tracks")
    with pytest.raises(FormatError, match="not a saved state"):
        LiveRun(camera.url(), settings(), tmp_path / "out", LiveExtras(state=tmp_path / "state"))
    assert not (tmp_path / "out").exists()


def full(*_):
    raise OSError(28, "No space left on device")


def test_a_state_that_cannot_be_saved_is_counted(camera, tmp_path, monkeypatch, caplog):
    with LiveRun(camera.url(), settings(), tmp_path / "out", LiveExtras(state=tmp_path / "state")) as run:
        run_until(run, frames(1))
        monkeypatch.setattr("vidtrack.run.live.checkpoint.write_state", full)
    assert run.board.now().reading["lost"]["state"] > 0
    assert "cannot save the state" in caplog.text


def test_no_number_is_used_before_it_is_reserved(camera, tmp_path, monkeypatch):
    monkeypatch.setattr("vidtrack.run.live.checkpoint.write_state", full)
    with (
        LiveRun(camera.url(), settings(), tmp_path / "out", LiveExtras(state=tmp_path / "state")) as run,
        pytest.raises(OutputError, match=r"cannot save the state .*No space left"),
    ):
        next(iter(run))


def test_pictures_lie_in_a_line_of_time(camera, tmp_path):
    extras = LiveExtras(record=tmp_path / "tape")
    with LiveRun(camera.url("video.ts"), settings(), tmp_path / "out", extras) as run:
        lived = [(each.index, each.time_s) for each in run_until(run, frames(30))]
    with run_file(str(tmp_path / "tape"), settings(), tmp_path / "again") as run:
        assert [(step.index, step.time_s) for step in run] == lived
    assert np.all(np.diff([time_s for _, time_s in lived]) > 0)
