"""`vidtrack radar`: plots in, tracks out."""

import csv
import json
import signal
import subprocess
import sys

import click
import numpy as np
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner
from command_line import ROOT
from numba.core.registry import CPUDispatcher
from plot_files import GOOD, write

from vidtrack import formats, score
from vidtrack.cli.radar import command
from vidtrack.config.load import load
from vidtrack.config.settings import Settings, TrackerSettings
from vidtrack.errors import ConfigError, PlotFormatError
from vidtrack.output.repair import repair
from vidtrack.rehearsal import rehearse
from vidtrack.run.radar import first_plots, run_plots, track_plots
from vidtrack.run.run import Extras, Run
from vidtrack.simulate.radar_scenarios import simulate_radar
from vidtrack.simulate.radar_write import write_radar

HEADER = "scan,time_s,track_id,status,x_m,y_m,vx_m_s,vy_m_s,sigma_x_m,sigma_y_m,corr_xy,nis"
OF_VELOCITY = "sigma_vx_m_s,sigma_vy_m_s,corr_vxy,corr_x_vx,corr_x_vy,corr_y_vx,corr_y_vy"


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    """Folder with plots.csv and truth.csv of a named scenario, drawn once."""
    drawn = {}

    def folder(name):
        if name not in drawn:
            drawn[name] = tmp_path_factory.mktemp(name)
            write_radar(simulate_radar(name, 1), drawn[name])
        return drawn[name]

    return folder


def run(folder, out, *assignments, extras=None):
    with run_plots(str(folder / "plots.csv"), load(assignments=assignments), out, extras) as result:
        for _ in result:
            pass
    return result.folder


def test_the_first_scans_of_a_run_show_which_kernels_it_needs(scenario, monkeypatch):
    table, asked = str(scenario("radar-tws") / "plots.csv"), []
    monkeypatch.setattr(CPUDispatcher, "compile", lambda self, types: asked.append((self, types)))
    rehearse(first_plots, table, {})
    first, asked = set(asked), asked[:0]
    rehearse(lambda: [step for step, _ in zip(track_plots(table), range(12), strict=False)])
    assert len(first) > 20
    assert set(asked) == first


def scores(out, folder, max_distance):
    return score.evaluate(
        formats.read(out),
        formats.read(folder / "truth.csv"),
        max_distance=max_distance,
        states=formats.read_states(out),
    )


def test_a_run_writes_what_it_promises(tmp_path, scenario):
    out = run(scenario("radar-tws"), tmp_path / "out", extras=Extras(decisions=True))
    names = {"tracks.csv", "tracks.parquet", "summary.json", "tracks.png", "radar.html", "decisions.csv"}
    assert {path.name for path in out.iterdir()} == names
    assert (out / "tracks.csv").read_text().splitlines()[0] == f"{HEADER},{OF_VELOCITY},exchange"
    assert (out / "decisions.csv").read_text().startswith("scan,time_s,track_id,event,")
    summary = json.loads((out / "summary.json").read_text())
    assert summary["interrupted"] is False
    assert summary["scans"] == 60
    assert summary["plots"] == len((scenario("radar-tws") / "plots.csv").read_text().splitlines()) - 1
    assert summary["tracks"] >= 8
    assert "camera" not in summary  # only pictures have one
    assert (out / "tracks.png").read_bytes()[:4] == b"\x89PNG"


def test_units_are_in_the_parquet_file_and_rows_are_those_of_the_csv(tmp_path, scenario):
    out = run(scenario("radar-crossing"), tmp_path / "out")
    table = pq.read_table(out / "tracks.parquet")
    units = {field.name: field.metadata[b"unit"].decode() for field in table.schema}
    assert units["x_m"] == units["sigma_y_m"] == "m"
    assert units["vx_m_s"] == "m/s"
    with open(out / "tracks.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["x_m"]) for row in rows] == table["x_m"].to_pylist()
    assert [int(row["scan"]) for row in rows] == sorted(table["scan"].to_pylist())


def test_in_space_the_height_follows(tmp_path, scenario):
    out = run(scenario("radar-altitude"), tmp_path / "out")
    header = (out / "tracks.csv").read_text().splitlines()[0]
    assert header == f"{HEADER},z_m,vz_m_s,sigma_z_m,{OF_VELOCITY},sigma_vz_m_s,exchange"
    found = scores(out, scenario("radar-altitude"), 500.0)
    assert found["tracks"] == 1
    assert found["idf1"] > 0.99
    assert found["nees_inside"] > 0.7  # the swing pulls 3 g


@pytest.mark.parametrize("estimator", ["kalman", "converted", "ekf"])
def test_surveillance_finds_all_aircraft_and_little_else(tmp_path, scenario, estimator):
    out = run(scenario("radar-tws"), tmp_path / "out", f"radar.estimator={estimator}")
    found = scores(out, scenario("radar-tws"), 2000.0)
    assert found["idf1"] > 0.85
    assert found["mostly_tracked"] >= 7
    assert found["tracks"] <= 12


def test_tracks_cross_north_as_if_it_were_any_direction(tmp_path):
    """The azimuth jumps from 359 to 0 degrees in mid-track."""
    t = np.arange(30)
    azimuth = (355 + 0.4 * t) % 360
    rows = [f"{k},{k},10000,{azimuth[k]:.3f},10,0.1" for k in t]
    write(tmp_path / "plots.csv", *rows)
    for estimator in ("kalman", "ekf"):
        out = run(tmp_path, tmp_path / estimator, f"radar.estimator={estimator}")
        table = formats.read(out)
        assert set(table.id.tolist()) == {table.id[0]}
        assert len(table) == 30
        assert np.hypot(*table.xy.T) == pytest.approx(10_000, abs=100)


def test_scan_numbers_are_those_of_the_file(tmp_path):
    rows = [f"{k},{k},{1000 + 10 * k},20,5,0.1" for k in (10, 11, 12, 14, 15)]
    write(tmp_path / "plots.csv", *rows)
    table = formats.read(run(tmp_path, tmp_path / "out"))
    assert table.frame.tolist() == [10, 11, 12, 13, 14, 15]


def test_range_rates_are_left_out_where_a_filter_cannot_use_them(tmp_path):
    header = "scan,time_s,range_m,azimuth_deg,doppler_m_s"
    write(tmp_path / "plots.csv", *(f"{k},{k},{5000 + 100 * k},0,100" for k in range(6)), header=header)
    settings = load(assignments=["radar.estimator=alpha-beta"])
    assert [len(tracks) for _, tracks in track_plots(tmp_path / "plots.csv", settings)] == [1] * 6


def test_doppler_makes_the_velocity_known_at_once(tmp_path):
    header = "scan,time_s,x_m,y_m,doppler_m_s,sigma_x_m,sigma_y_m,sigma_doppler_m_s"
    rows = [f"{k},{k},0,{5000 + 100 * k},100,50,50,1" for k in range(6)]
    write(tmp_path / "plots.csv", *rows, header=header)
    for _, tracks in track_plots(tmp_path / "plots.csv"):
        last = tracks
    assert last.v[0, 1] == pytest.approx(100, abs=3)
    assert np.sqrt(last.P[0, 3, 3]) < 3


@pytest.mark.parametrize("assignments", [(), ("radar.life=llr",), ("radar.group_link_m=300",)])
def test_a_jump_of_the_clock_ends_the_tracks_and_spoils_nothing_before_it(tmp_path, scenario, caplog, assignments):
    for name, jump_s in (("even", 0), ("jumped", 1e6)):
        with (scenario("radar-tws") / "plots.csv").open() as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            row["time_s"] = float(row["time_s"]) + jump_s * (int(row["scan"]) >= 30)
        (tmp_path / name).mkdir()
        write(
            tmp_path / name / "plots.csv", *(",".join(map(str, row.values())) for row in rows), header=",".join(rows[0])
        )
    even, jumped = (
        formats.read_states(run(tmp_path / name, tmp_path / f"{name}-out", *assignments)) for name in ("even", "jumped")
    )
    early, again = even.select(even.frame < 25), jumped.select(jumped.frame < 25)
    assert len(set(again.id.tolist())) <= len(set(early.id.tolist())) + 1
    assert not set(jumped.id[jumped.frame < 30].tolist()) & set(jumped.id[jumped.frame >= 30].tolist())
    assert np.sqrt(jumped.cov[:, 0, 0].max() / even.cov[:, 0, 0].max()) < 4  # and not a million seconds ahead
    density = [
        json.loads((tmp_path / f"{name}-out" / "summary.json").read_text())["clutter_density"]
        for name in ("even", "jumped")
    ]
    assert 0.5 < density[1] / density[0] < 2
    assert "the time jumps from 116 to 1000120 s" in caplog.text


@pytest.mark.parametrize("jump_s", [30.0, 300.0, 1e6])
def test_a_jump_of_the_clock_changes_no_track_before_it(tmp_path, scenario, jump_s):
    """One long step must not make the usual time of a scan longer, and so the surveyed space larger."""
    found = []
    with (scenario("radar-tws") / "plots.csv").open() as file:
        rows = list(csv.DictReader(file))
    for added_s in (0.0, jump_s):
        moved = [row | {"time_s": float(row["time_s"]) + added_s * (int(row["scan"]) >= 30)} for row in rows]
        path = write(tmp_path / "p.csv", *(",".join(map(str, row.values())) for row in moved), header=",".join(rows[0]))
        found.append([(tracks.id.tolist(), tracks.xy.tolist()) for scan, tracks in track_plots(path) if scan < 30])
    assert found[0] == found[1]


def test_evaluation_knows_the_run(tmp_path, scenario):
    out = run(scenario("radar-crossing"), tmp_path / "out")
    found = scores(out, scenario("radar-crossing"), 1000.0)
    assert {"ospa", "gospa", "nees", "nis", "idf1"} <= found.keys()
    assert found["gospa"] < 1000


def test_a_killed_run_can_be_repaired(tmp_path, scenario):
    out = run(scenario("radar-altitude"), tmp_path / "out")
    whole = pq.read_table(out / "tracks.parquet")
    (out / "tracks.parquet").unlink()
    with (out / "tracks.csv").open("a") as file:
        file.write("233,1.0,1,conf")
    assert repair(out) == whole.num_rows
    assert pq.read_table(out / "tracks.parquet").equals(whole)


def test_bad_rows_end_the_run_before_anything_is_written_or_are_left_out(tmp_path):
    path = write(tmp_path / "plots.csv", *GOOD, "3,3,-5,0,5,0.1")
    out = tmp_path / "out"
    result = CliRunner().invoke(command, [str(path), "-o", str(out)])
    assert isinstance(result.exception, PlotFormatError)
    assert result.exception.exit_code == 3
    assert not out.exists()
    result = CliRunner().invoke(command, [str(path), "-o", str(out), "--skip-bad-rows", "--quiet"])
    assert result.exit_code == 0, result.output
    assert result.stdout == f"{out}\n"
    assert json.loads((out / "summary.json").read_text())["bad_rows"] == 1


def test_a_setting_that_does_not_exist_is_named(tmp_path):
    path = write(tmp_path / "plots.csv", *GOOD)
    result = CliRunner().invoke(command, [str(path), "--set", "radar.max_sped=3"])
    assert isinstance(result.exception, ConfigError)
    assert "radar.max_speed" in str(result.exception)


def test_interrupted_results_are_complete_and_valid(tmp_path, monkeypatch):
    steps = Run.__iter__

    def told(self):
        for scan, step in enumerate(steps(self)):
            if scan == 50:
                signal.raise_signal(signal.SIGINT)
            yield step

    monkeypatch.setattr(Run, "__iter__", told)
    rows = [f"{k},{k},{1000 + k},{a},5,0.1" for k in range(200) for a in range(0, 360, 15)]
    path, out = write(tmp_path / "plots.csv", *rows), tmp_path / "out"
    with pytest.raises(click.Abort):  # the exit code is 130 then
        command.main([str(path), "-o", str(out), "--quiet"], standalone_mode=False)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["interrupted"] is True
    assert summary["scans"] == 51
    assert len(formats.read(out)) == pq.read_table(out / "tracks.parquet").num_rows > 0


@pytest.mark.parametrize("method", ["sn", "psn"])
def test_methods_by_strength_need_amplitudes_and_leave_no_folder(tmp_path, method):
    plots = tmp_path / "plots.csv"
    plots.write_text("scan,time_s,x_m,y_m,sigma_x_m,sigma_y_m\n0,0.0,1.0,2.0,5,5\n1,1.0,3.0,2.0,5,5\n")
    with pytest.raises(ConfigError, match=f"no amplitudes.* {method} chooses"):
        run_plots(str(plots), Settings(tracker=TrackerSettings(method=method)), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_no_part_of_a_radar_run_needs_opencv(tmp_path, scenario):
    code = f"""
import sys
import vidtrack.cli.radar
from vidtrack.cli.radar import command
command.main([{str(scenario("radar-crossing") / "plots.csv")!r}, "-o", {str(tmp_path / "out")!r}, "--quiet",
              "--decisions", "--rerun", {str(tmp_path / "a.rrd")!r}], standalone_mode=False)
assert "cv2" not in sys.modules and "av" not in sys.modules
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.rrd").stat().st_size > 10_000


@pytest.mark.parametrize("interval_s", [0.1, 1.0, 4.0, 10.0])
@pytest.mark.parametrize("method", ["gnn", "jpda", "mht"])
def test_a_few_plots_of_one_target_are_enough_for_a_track(tmp_path, interval_s, method):
    rows = [f"{k},{k * interval_s},{10_000 + 60 * k * interval_s},30,20,0.1" for k in range(6)]
    write(tmp_path / "plots.csv", *rows)
    table = formats.read(run(tmp_path, tmp_path / "out", f"tracker.method={method}"))
    assert len(table) == 6
    assert len(set(table.id.tolist())) == 1
