"""Recordings of radar runs, while tracking and afterwards."""

import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from vidtrack.config.load import load
from vidtrack.output import replay
from vidtrack.run.radar import run_plots
from vidtrack.run.run import Extras
from vidtrack.simulate.radar_scenarios import simulate_radar
from vidtrack.simulate.radar_write import write_radar


@pytest.fixture(autouse=True)
def _strict(monkeypatch):
    monkeypatch.setenv("RERUN_STRICT", "1")  # mistakes are errors, not warnings


def entities(path):
    program = Path(sysconfig.get_path("scripts")) / ("rerun.exe" if sys.platform == "win32" else "rerun")
    subprocess.run([program, "rrd", "verify", path], check=True, capture_output=True)
    done = subprocess.run([program, "rrd", "stats", path], capture_output=True, text=True, check=True)
    return {word.rstrip(":") for word in done.stdout.split()}


@pytest.mark.parametrize(("name", "estimator"), [("radar-crossing", "ekf"), ("radar-altitude", "kalman")])
def test_a_recording_holds_plots_tracks_and_decisions_in_metres(tmp_path, name, estimator):
    write_radar(simulate_radar(name, 1), tmp_path)
    settings = load(assignments=[f"radar.estimator={estimator}"])
    extras = Extras(rerun=str(tmp_path / "a.rrd"))
    with run_plots(str(tmp_path / "plots.csv"), settings, tmp_path / "out", extras) as run:
        steps = list(run)
    wanted = {"/world/plots", "/world/tracks", "/world/gates", "/world/trails", "/world/radar"}
    assert wanted | {"/plots/count", "/log", "/settings"} <= entities(tmp_path / "a.rrd")

    finished = replay.read_run(tmp_path / "out")
    assert finished.shape is None
    again = {step.index: step.tracks for step in replay.steps(finished)}
    for step in steps[10:]:
        confirmed = np.isin(step.tracks.id, again[step.index].id)
        assert again[step.index].xy == pytest.approx(step.tracks.xy[confirmed], abs=1e-3)
        assert again[step.index].v == pytest.approx(step.tracks.v[confirmed], abs=1e-3)


def test_view_shows_a_finished_radar_run(tmp_path):
    from vidtrack.cli.view import command

    write_radar(simulate_radar("radar-crossing", 2), tmp_path)
    with run_plots(str(tmp_path / "plots.csv"), load(), tmp_path / "out") as run:
        list(run)
    result = CliRunner().invoke(command, [str(tmp_path / "out"), "--save", str(tmp_path / "view.rrd")])
    assert result.exit_code == 0, result.output
    assert {"/world/tracks", "/world/trails"} <= entities(tmp_path / "view.rrd")
