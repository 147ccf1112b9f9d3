"""`vidtrack eval`: JSON and table."""

import json

import pytest
from click.testing import CliRunner

from vidtrack.cli.eval import command
from vidtrack.errors import OutputError

TRUTH = "".join(f"{f},1,10,10,20,20,1,1,1\n" for f in range(1, 11))
RESULT = "".join(f"{f},{5 if f < 6 else 6},10,10,20,20,1,-1,-1,-1\n" for f in range(1, 11))
TRACKS = "frame,track_id,x_px,y_px,sigma_x_px,sigma_y_px,left_px,top_px,width_px,height_px,nis\n" + "".join(
    f"{f},5,22,20,2,2,12,10,20,20,{f % 4}\n" for f in range(10)
)


@pytest.fixture
def files(tmp_path):
    (tmp_path / "gt.txt").write_text(TRUTH)
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "mot.txt").write_text(RESULT)
    (tmp_path / "run" / "tracks.csv").write_text(TRACKS)
    return tmp_path


def run(*arguments):
    outcome = CliRunner().invoke(command, [str(argument) for argument in arguments], catch_exceptions=False)
    assert outcome.exit_code == 0
    return outcome.stdout


def test_json_on_stdout_is_one_object_of_fractions(files):
    scores = json.loads(run(files / "run" / "mot.txt", files / "gt.txt", "--json", "-"))
    assert scores["mota"] == pytest.approx(0.9)
    assert scores["idf1"] == pytest.approx(0.5)
    assert (scores["switches"], scores["misses"], scores["false_positives"]) == (1, 0, 0)
    assert "nees" not in scores


def test_a_run_folder_adds_consistency_of_its_states(files):
    scores = json.loads(run(files / "run", files / "gt.txt", "--json", "-"))
    assert scores["switches"] == 1
    assert scores["nees"] == pytest.approx(1)
    assert scores["nis_samples"] == 10


def test_json_in_a_file_leaves_the_table_on_stdout(files):
    table = run(files / "run", files / "gt.txt", "--json", files / "scores.json")
    scores = json.loads((files / "scores.json").read_text())
    assert f"{scores['hota']:.4f}" in table
    assert all(name in table for name in scores if name != "matched_by")


def test_a_file_that_cannot_be_written_is_an_error(files):
    with pytest.raises(OutputError, match="cannot write"):
        run(files / "run", files / "gt.txt", "--json", files)


@pytest.mark.parametrize("counted", ["scan", "frame"])  # a frame's number is no scan's where a camera helps a radar
def test_a_truth_of_other_scans_is_matched_by_time(tmp_path, counted):
    for name, number, step_s in (("tracks", "scan", 4), ("truth", counted, 2)):
        rows = "".join(f"{k},{step_s * k},1,{3 * step_s * k},0\n" for k in range(9))
        (tmp_path / f"{name}.csv").write_text(f"{number},time_s,track_id,x_m,y_m\n" + rows)
    scores = json.loads(run(tmp_path / "tracks.csv", tmp_path / "truth.csv", "--json", "-"))
    assert (scores["frames"], scores["idf1"]) == (5, 1.0)
    assert scores["matched_by"] == "distance up to 100 m, the truth at the times of the scans"
