"""The command line: what it says, what it returns, and what it leaves behind when it is stopped."""

import errno
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest
from command_line import ENVIRONMENT, SAMPLES, first_frames, loop_video, start

from vidtrack.cli import COMMANDS
from vidtrack.run.run import Run

CROSSING = SAMPLES / "crossing.avi"


def rows_of(folder):
    """Lines of tracks.csv without the header, checked to be whole."""
    header, *lines = (folder / "tracks.csv").read_text().splitlines()
    assert header.startswith("frame,time_s,track_id,status,")
    assert all(line.count(",") == header.count(",") for line in lines)
    return lines


def check_results(folder):
    """Everything a run leaves is complete and of one mind; returns summary.json."""
    summary = json.loads((folder / "summary.json").read_text())
    rows = rows_of(folder)
    assert pq.read_table(folder / "tracks.parquet").num_rows == len(rows)
    assert all(0 <= int(row.split(",")[0]) < summary["frames"] for row in rows)
    for line in (folder / "mot.txt").read_text().splitlines():
        assert len([float(cell) for cell in line.split(",")]) == 10
    assert (folder / "tracks.png").stat().st_size > 0
    return summary


# What can be asked


@pytest.mark.parametrize("command", COMMANDS)
def test_help_shows_three_examples(vidtrack, command):
    code, out, _ = vidtrack(command, "--help")
    assert code == 0
    examples = [line for line in out.partition("Examples:")[2].splitlines() if f"vidtrack {command}" in line]
    assert len(examples) >= 3


def test_help_lists_the_commands(vidtrack):
    code, out, _ = vidtrack("--help")
    assert code == 0
    assert all(command in out for command in COMMANDS)


def test_version(vidtrack):
    code, out, _ = vidtrack("--version")
    assert code == 0
    assert out.startswith("vidtrack, version ")


@pytest.mark.parametrize("explain", [(), ("--explain",)])
def test_printed_configuration_is_one(vidtrack, tmp_path, explain):
    code, out, err = vidtrack("config", *explain, "--set", "tracker.coast_s=2.5")
    assert (code, err) == (0, "")
    (tmp_path / "settings.toml").write_text(out)
    assert "coast_s = 2.5" in vidtrack("config", "--config", "settings.toml")[1]


# A run


def test_track_prints_the_folder_and_nothing_else(vidtrack, tmp_path):
    code, out, err = vidtrack("track", CROSSING, "--end", 3, "--line", "gate:200,0,200,240")
    assert code == 0
    assert out == "runs/crossing\n"
    assert "frames in" in err
    assert "2 tracks; gate: 0 left, 0 right" in err
    summary = check_results(tmp_path / "runs" / "crossing")
    assert summary["interrupted"] is summary["truncated"] is False
    assert summary["frames"] == 46
    assert summary["tracks"] == 2
    assert (
        (tmp_path / "runs" / "crossing" / "counts.csv").read_text().startswith("time_s,frame,line,direction,track_id")
    )
    assert vidtrack("track", CROSSING, "--end", 0.5, "--quiet")[1:] == ("runs/crossing-2\n", "")


def test_options_stand_for_settings(vidtrack, tmp_path):
    options = ("--method", "nn", "--distance", "euclidean", "--detector", "paper", "--set", "tracker.coast_s=2")
    code, _, _ = vidtrack("track", CROSSING, "-o", "out", "--end", 0.5, "--max-fps", 5, *options)
    assert code == 0
    assert check_results(tmp_path / "out")["frames_read"] == 3
    found = json.loads((tmp_path / "out" / "summary.json").read_text())["settings"]
    assert (found["tracker"]["method"], found["tracker"]["distance"]) == ("nn", "euclidean")
    assert found["detector"]["kind"] == "paper"
    assert found["tracker"]["coast_s"] == 2.0
    assert found["source"]["end_s"] == 0.5


def test_stored_detections_are_tracked_like_a_video(vidtrack, tmp_path):
    table = [f"{k},-1,{10 + 4 * k},50,30,16,0.9,-1,-1,-1\n" for k in range(1, 40)]
    (tmp_path / "det.txt").write_text("".join(table))
    code, out, err = vidtrack("track", "det.txt", "--fps", 25, "-o", "out", "--line", "far:0,5000,90,5000")
    assert "line far lies outside the" in err  # a warning: the size of the pictures is not known
    assert (code, out) == (0, "out\n")
    assert len({row.split(",")[2] for row in rows_of(tmp_path / "out")}) == 1


def test_an_old_result_is_replaced_only_when_told(vidtrack, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "notes.txt").write_text("mine")
    (tmp_path / "out" / "tracks.csv").write_text("old")
    code, _, err = vidtrack("track", CROSSING, "-o", "out", "--end", 0.5)
    assert code == 2
    assert "--force" in err
    assert (tmp_path / "out" / "tracks.csv").read_text() == "old"
    assert vidtrack("track", CROSSING, "-o", "out", "--end", 0.5, "--force")[0] == 0
    assert (tmp_path / "out" / "notes.txt").read_text() == "mine"
    check_results(tmp_path / "out")


# Bad input


def make_bad_inputs(folder):
    (folder / "empty.avi").write_bytes(b"")
    (folder / "text.avi").write_text("this is no video\n" * 50)
    (folder / "no_pictures").mkdir()
    (folder / "no_pictures" / "readme.txt").write_text("nothing to see")
    (folder / "det.txt").write_text("")


@pytest.mark.parametrize("source", ["missing.avi", "empty.avi", "text.avi", "no_pictures", "no/such/*.png", "det.txt"])
def test_an_input_that_yields_nothing_is_one_line_and_3(vidtrack, tmp_path, source):
    make_bad_inputs(tmp_path)
    code, out, err = vidtrack("track", source)
    assert (code, out) == (3, "")
    assert err.startswith("vidtrack: ")
    assert source in err
    assert len(err.splitlines()) == 1
    assert not (tmp_path / "runs").exists()


def test_a_cut_video_is_tracked_to_its_end_with_a_warning(vidtrack, tmp_path):
    content = CROSSING.read_bytes()
    (tmp_path / "cut.avi").write_bytes(content[: len(content) // 2])
    code, out, err = vidtrack("track", "cut.avi", "-o", "out")
    assert (code, out) == (0, "out\n")
    assert "vidtrack: warning: " in err
    summary = check_results(tmp_path / "out")
    assert summary["truncated"] is True
    assert summary["interrupted"] is False
    assert 10 < summary["frames"] < 130


def test_a_video_of_one_frame_has_no_tracks(vidtrack, tmp_path):
    first_frames(CROSSING, tmp_path / "one.avi", 1)
    code, out, _ = vidtrack("track", "one.avi", "-o", "out")
    assert (code, out) == (0, "out\n")
    assert check_results(tmp_path / "out")["frames"] == 1
    assert rows_of(tmp_path / "out") == []


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--set", "tracker.gate_probability=1.5"), ["gate_probability", "1.5", "less than or equal to 1"]),
        (("--set", "tracker.coast=1"), ["tracker.coast", "tracker.coast_s"]),
        (("--set", "tracker.coast_s"), ["group.name=value"]),
        (("--config", "wrong.toml"), ["tracker.gate_probability"]),
        (("--config", "missing.toml"), ["missing.toml"]),
        (("--line", "gate:1,2,3"), ["gate:1,2,3", "NAME:x1,y1,x2,y2"]),
        (("--line", "gate:0,2000,90,2000"), ["line gate lies outside the", "nothing can cross it; draw it across"]),
        (("--mask", "missing.png"), ["missing.png", "No such file"]),
        (("--mask", "black.png"), ["black.png", "black all over"]),
        (("--scale", "2"), ["source.scale", "2"]),
        (("--start", "5", "--end", "2"), ["end_s = 2.0: must not be before source.start_s = 5"]),
        (("--method", "guess"), ["guess", "gnn"]),
        (("-o", "a_file"), ["a_file"]),
        (("-o", "a_file/below"), ["a_file"]),
        (("--video", "a_file/annotated.mp4"), ["a_file"]),
        (("--video", "annotated.avi"), ["annotated.avi", "annotated.mp4"]),
        (("--video", ""), ["FILE.mp4"]),
        (("--save-masks", "a_file"), ["a_file"]),
        (("--rerun", "swpan"), ["swpan", "spawn", ".rrd"]),
    ],
)
def test_wrong_use_is_one_clear_message_and_2(vidtrack, tmp_path, options, words):
    (tmp_path / "a_file").write_text("")
    (tmp_path / "wrong.toml").write_text("[tracker]\ngate_prob = 0.99\n")
    (tmp_path / "black.png").write_bytes(cv2.imencode(".png", np.zeros((4, 4), np.uint8))[1].tobytes())
    code, out, err = vidtrack("track", CROSSING, "--end", 0.3, *options)
    assert (code, out) == (2, "")
    for word in words:
        assert word in err


@pytest.mark.parametrize("command", ["view", "repair"])
def test_a_file_is_no_run(vidtrack, command):
    assert vidtrack(command, CROSSING) == (3, "", f"vidtrack: {CROSSING} is not a run: it has no tracks.csv\n")


def test_an_unknown_command_is_2(vidtrack):
    code, _, err = vidtrack("trakc", CROSSING)
    assert code == 2
    assert "trakc" in err


# Stopped on the way


@pytest.mark.parametrize(
    ("number", "expected", "word"), [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")]
)
def test_a_stopped_run_ends_in_complete_results(vidtrack, tmp_path, monkeypatch, number, expected, word):
    steps = Run.__iter__

    def told(self):
        for step in steps(self):
            if step.index == 40:
                signal.raise_signal(number)
            yield step

    monkeypatch.setattr(Run, "__iter__", told)
    code, out, err = vidtrack("track", CROSSING, "-o", "out")
    assert (code, out) == (expected, "")
    assert err.splitlines()[-1] == f"vidtrack: {word}"
    summary = check_results(tmp_path / "out")
    assert summary["interrupted"] is True
    assert summary["frames"] == 41
    assert summary["tracks"] > 0
    assert not (tmp_path / "out" / "tracks.parquet.parts").exists()


def test_a_killed_run_leaves_readable_tables_and_can_be_repaired(tmp_path, vidtrack):
    loop_video(SAMPLES / "junction.avi", tmp_path / "long.avi", times=60)  # lasts longer than the test waits
    process = start("track", "long.avi", "-o", "out", cwd=tmp_path)
    folder, deadline = tmp_path / "out", time.monotonic() + 120
    while not (folder / "tracks.csv").exists() or (folder / "tracks.csv").stat().st_size < 1000:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.02)
    process.kill()
    process.communicate()
    assert process.returncode == -signal.SIGKILL
    assert (folder / "tracks.csv").read_text().count("\n") > 1  # the last line may be cut
    assert json.loads((folder / "summary.json").read_text())["interrupted"] is True
    assert vidtrack("repair", folder)[0] == 0
    assert pq.read_table(folder / "tracks.parquet").num_rows == len(rows_of(folder))
    assert json.loads((folder / "summary.json").read_text())["interrupted"] is True


_ON_A_SMALL_DISK = """
import resource, sys
from vidtrack.cli import main
video = sys.argv[1]
for folder, options in (("whole", []), ("short", ["--quiet"])):  # the first one loads all compiled code
    sys.argv = ["vidtrack", "track", video, "-o", folder, *options]
    try:
        main()
    except SystemExit as ended:
        code = ended.code
    resource.setrlimit(resource.RLIMIT_FSIZE, (8_000, 8_000))
sys.exit(code)
"""


def test_a_full_disk_ends_the_run_with_1_and_valid_results(tmp_path):
    """No file can grow beyond 8,000 bytes, as on a disk that fills up."""
    command = [sys.executable, "-c", _ON_A_SMALL_DISK, str(CROSSING)]
    done = subprocess.run(
        command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert "vidtrack: cannot write" in done.stderr.splitlines()[-1]
    whole, short = rows_of(tmp_path / "whole"), rows_of(tmp_path / "short")
    assert short == whole[: len(short)]
    json.loads((tmp_path / "short" / "summary.json").read_text())


def test_what_the_disk_refuses_elsewhere_is_one_line_and_1(vidtrack, monkeypatch):
    def write(clip, folder, frames):
        raise OSError(errno.ENOSPC, "No space left on device", str(folder / "video.avi"))

    monkeypatch.setattr("vidtrack.simulate.write", write)
    code, _, err = vidtrack("simulate", "crossing", "-o", "out", "--quiet")
    assert code == 1
    assert err == "vidtrack: cannot read or write out/video.avi: No space left on device\n"


def test_a_reader_that_has_seen_enough_is_no_error(tmp_path):
    process = start("config", "--explain", cwd=tmp_path)
    process.stdout.close()
    err = process.stderr.read()
    process.wait(timeout=60)
    process.stderr.close()
    assert err == ""


def test_a_video_of_which_no_frame_can_be_decoded_is_3(vidtrack, tmp_path):
    content = bytearray(CROSSING.read_bytes())
    pictures = content.index(b"movi") + 4
    content[pictures:] = bytes(len(content) - pictures)
    (tmp_path / "blank.avi").write_bytes(content)
    code, out, err = vidtrack("track", "blank.avi", "-o", "out")
    assert (code, out) == (3, "")
    assert err.startswith("vidtrack: no picture of blank")
    assert len(err.splitlines()) == 1


def test_a_folder_named_like_a_video_is_a_folder(vidtrack, tmp_path):
    Path(tmp_path / "street.avi").mkdir()
    code, _, err = vidtrack("track", "street.avi")
    assert code == 3
    assert "street.avi" in err


PAGES = {"review", "site"}
"""Commands that serve a page, which writes beside what it shows."""


@pytest.mark.parametrize(
    "name", sorted(COMMANDS.keys() - {"service"})
)  # it writes no results: it has commands of its own
def test_every_command_has_the_common_options(vidtrack, name):
    _, shown, _ = vidtrack(name, "--help")
    wanted = ("--quiet", "-v,") if name in PAGES else ("-o,", "--force", "--quiet", "-v,")
    assert [option for option in wanted if option not in shown] == []


@pytest.mark.parametrize("name", COMMANDS)
def test_only_commands_that_draw_random_numbers_have_a_seed(vidtrack, name):
    _, shown, _ = vidtrack(name, "--help")
    assert ("--seed" in shown) == (name in ("simulate", "radar", "predict", "reproduce"))


def test_reports_and_copies_go_into_a_folder_on_request(vidtrack, tmp_path):
    """eval, threshold, config, repair and view write files with -o, and what they would change stays as it was."""
    run = tmp_path / "run"
    vidtrack("simulate", "radar-tws", "-o", tmp_path / "sky")
    vidtrack("radar", tmp_path / "sky" / "plots.csv", "-o", run)
    before = (run / "summary.json").read_bytes()
    for arguments, file in (
        (("eval", run, tmp_path / "sky" / "truth.csv"), "scores.json"),
        (("threshold", "--snr-db", "10", "--cells", "100"), "threshold.json"),
        (("config",), "settings.toml"),
        (("repair", run), "tracks.csv"),
        (("view", run), "view.rrd"),
    ):
        code, out, err = vidtrack(*arguments, "-o", tmp_path / arguments[0], "--quiet")
        assert (code, out) == (0, ""), err
        assert (tmp_path / arguments[0] / file).stat().st_size > 0
    assert vidtrack("eval", run, tmp_path / "sky" / "truth.csv", "-o", run, "--force", "--quiet")[0] == 0
    assert vidtrack("repair", run, "-o", run, "--force")[0] == 2
    assert (run / "scores.json").stat().st_size > 0
    assert (run / "summary.json").read_bytes() == before


@pytest.mark.parametrize(("option", "name"), [("--video", "a.mp4"), ("--save-masks", "a"), ("--rerun", "a.rrd")])
def test_a_target_that_cannot_be_written_leaves_no_results_behind(vidtrack, tmp_path, option, name):
    """The corrected command may use the same folder."""
    (tmp_path / "file").touch()
    code, _, err = vidtrack("track", CROSSING, "-o", "out", option, tmp_path / "file" / name)
    assert code == 2, err
    assert not (tmp_path / "out").exists()
