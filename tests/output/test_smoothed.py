"""Smoothed results: what is passed on, when, and where the boxes are."""

import numpy as np
import pyarrow.parquet
import pytest
from synthetic_steps import Kept

import vidtrack as vt
from vidtrack.config.settings import Settings
from vidtrack.output.mot import MotFile
from vidtrack.output.sink import Step
from vidtrack.output.smoothed import Smoothed, smoothed_by
from vidtrack.run.radar import run_plots


def steps(count, there=lambda k: True, box=True):
    """Steps of one vehicle that drives to the right, seen where there(k)."""
    tracker = vt.Tracker(vt.ConstantVelocity(accel=5.0, speed=50.0), smooth=True, life=vt.LifeCycle(coast_scans=8))
    rng = np.random.default_rng(2)
    for k in range(count):
        z = np.array([[10.0 * k, 50.0]]) + rng.normal(size=(1, 2)) if there(k) else np.empty((0, 2))
        boxes = np.tile([-8.0, -4.0, 16.0, 8.0], (len(z), 1)) if box else None
        scan = vt.Scan(0.1 * k, z, np.eye(2), box=boxes)
        yield Step(k, scan.t, scan, tracker.step(scan), None, None, {})


def played(made, **lag):
    kept = Kept()
    sink, late = Smoothed(kept, **lag), []
    for step in made:
        sink.step(step)
        late.append(step.index - (kept.steps[-1].index if kept.steps else -1))
    sink.close()
    assert kept.closed
    assert [step.index for step in kept.steps] == [step.index for step in made]
    return kept.steps, late


def test_without_a_lag_all_that_comes_later_counts():
    made = list(steps(40))
    found, late = played(made)
    assert late[-1] == 40
    tracks = made[-1].tracks
    for k in range(38, -1, -1):
        tracks = smoothed_by(made[k].tracks, tracks)
        np.testing.assert_array_equal(found[k].tracks.x, tracks.x)


def test_with_a_lag_rows_wait_no_longer_than_twice_it():
    made = list(steps(60))
    found, late = played(made, lag_s=0.5)
    assert max(late) <= 11
    whole, _ = played(made)
    error = [np.sqrt(np.mean([(s.tracks.xy[0, 1] - 50) ** 2 for s in kept[5:55]])) for kept in (made, found, whole)]
    assert error[1] < error[0]
    assert error[1] == pytest.approx(error[2], rel=0.1)


def test_where_no_track_goes_on_everything_is_passed_on():
    made = list(steps(40, there=lambda k: k < 10 or k >= 25))
    found, late = played(made)
    assert min(late[20:]) <= 1
    assert found[9].tracks.id[0] != found[-1].tracks.id[0]


def test_boxes_stay_at_their_place_on_the_track():
    made = list(steps(20))
    for before, after in zip(made, played(made)[0], strict=True):
        np.testing.assert_allclose(after.tracks.box[:, 2:], before.tracks.box[:, 2:])
        np.testing.assert_allclose(
            after.tracks.box[:, :2] - after.tracks.xy, before.tracks.box[:, :2] - before.tracks.xy
        )


def test_a_gap_is_bridged_in_mot_txt(tmp_path):
    """The vehicle brakes while nobody looks; the smoothed boxes lead from one side of the gap to the other."""
    tracker = vt.Tracker(vt.ConstantVelocity(accel=300.0, speed=50.0), smooth=True, life=vt.LifeCycle(coast_scans=8))
    place = np.concatenate([10.0 * np.arange(15), 145 + 3.0 * np.arange(25)])
    sink = Smoothed(MotFile(tmp_path / "mot.txt"))
    for k, x in enumerate(place):
        z = np.empty((0, 2)) if 14 <= k < 18 else np.array([[x, 50.0]])
        box = np.tile([-8.0, -4.0, 16.0, 8.0], (len(z), 1))
        scan = vt.Scan(0.1 * k, z, np.eye(2), box=box)
        sink.step(Step(k, scan.t, scan, tracker.step(scan), None, None, {}))
    sink.close()
    rows = np.loadtxt(tmp_path / "mot.txt", delimiter=",")
    assert set(rows[:, 1]) == {1}
    centre = (rows[:, 2] + 8)[np.isin(rows[:, 0] - 1, np.arange(14, 18))]
    np.testing.assert_allclose(centre, place[14:18], atol=4.0)


def test_a_radar_run_is_smoothed(tmp_path):
    rng = np.random.default_rng(0)
    lines = ["scan,time_s,x_m,y_m"]
    for k in range(30):
        lines.append(f"{k},{4 * k},{1000 + 400 * k + 50 * rng.normal():.2f},{5000 + 50 * rng.normal():.2f}")
    (tmp_path / "plots.csv").write_text("\n".join(lines) + "\n")
    error = {}
    for smooth in (False, True):
        settings = Settings.model_validate({"output": {"smooth": smooth}})
        with run_plots(str(tmp_path / "plots.csv"), settings, tmp_path / f"run{smooth:d}") as run:
            for _ in run:
                pass
        table = pyarrow.parquet.read_table(run.folder / "tracks.parquet")
        assert table.num_rows == 30
        error[smooth] = np.sqrt(np.mean((np.array(table["y_m"]) - 5000) ** 2))
        assert f'"smooth": {str(smooth).lower()}' in (run.folder / "summary.json").read_text()
    assert error[True] < 0.8 * error[False]


def test_a_filter_whose_covariances_are_not_its_own_is_not_smoothed(tmp_path):
    (tmp_path / "plots.csv").write_text("scan,time_s,x_m,y_m\n0,0,1,2\n1,1,2,3\n")
    settings = Settings.model_validate({"output": {"smooth": True}, "radar": {"estimator": "alpha-beta"}})
    with pytest.raises(vt.ConfigError, match="alpha-beta"):
        run_plots(str(tmp_path / "plots.csv"), settings, tmp_path / "run")
