"""`vidtrack radar`: groups, thresholds of tracks' own, the clutter map and the page, from the command line."""

import json
import re

import numpy as np
import pytest
from click.testing import CliRunner
from plot_files import GOOD, write

from vidtrack.cli.radar import command
from vidtrack.simulate.radar_scenarios import simulate_radar
from vidtrack.simulate.radar_write import write_radar

CELL = ("--set", "radar.cell_range_m=150", "--set", "radar.cell_azimuth_deg=1.5")


@pytest.fixture(scope="module")
def weak(tmp_path_factory):
    """Plots of four aircraft at 13 dB, with every echo above a low threshold."""
    folder = tmp_path_factory.mktemp("weak")
    write_radar(simulate_radar("radar-weaving", 300, snr_db=13, p_fa=3e-4), folder)
    return folder / "plots.csv"


def radar(*arguments):
    """Exit code, and what is printed or raised."""
    result = CliRunner().invoke(command, [*map(str, arguments), "-q"])
    code = getattr(result.exception, "exit_code", result.exit_code)
    return code, f"{result.output}{result.exception}"


def test_each_track_has_a_threshold_of_its_own(weak, tmp_path):
    assert radar(weak, "-o", tmp_path / "all", "--method", "pda")[0] == 0
    assert radar(weak, "-o", tmp_path / "own", "--method", "pda", "--snr-db", "13", *CELL)[0] == 0
    every, own = ((tmp_path / name / "tracks.csv").read_text() for name in ("all", "own"))
    assert own.count("\n") > 60
    assert own != every


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--snr-db", "13"), "radar.cell_range_m and radar.cell_azimuth_deg"),
        (("--snr-db", "13", *CELL, "--set", "radar.clutter_map=true"), "radar.clutter_map has no effect"),
        (("--snr-db", "13", *CELL, "--distance", "euclidean"), "needs the distance mahalanobis"),
        (("--set", "radar.pfa_max=0.01"), "radar.pfa_max has no effect"),
        (("--set", "radar.clutter_density=1e-9", "--set", "radar.clutter_map=true"), "radar.clutter_map has no effect"),
        (("--group", "300", "--set", "radar.unresolved=true"), "radar.unresolved has no effect"),
        (("--group", "300", "--estimator", "ekf"), "take kalman or imm"),
        (("--group", "300", "--method", "mht"), "take gnn or jpda"),
        (("--group", "300", "--snr-db", "13"), "a group has no amplitude"),
        (("--group", "300", "--smooth"), "groups go without --smooth"),
        (("--group", "-1"), "greater than 0"),
    ],
)
def test_what_does_not_go_together_is_refused(weak, tmp_path, arguments, said):
    code, output = radar(weak, "-o", tmp_path / "out", *arguments)
    assert code == 2
    assert said in output
    assert not (tmp_path / "out").exists()


def test_plots_without_amplitudes_have_no_threshold(tmp_path):
    plots = write(tmp_path / "plots.csv", *GOOD)
    code, output = radar(plots, "-o", tmp_path / "out", "--snr-db", "13", *CELL)
    assert code == 2
    assert "the plots have none" in output


def test_a_formation_is_one_group_with_its_members(tmp_path):
    rng = np.random.default_rng(0)
    rows = [
        (k, 4 * k, 10_000 + 800 * k + 120 * member + rng.normal(0, 10), 5000 + rng.normal(0, 10), 10, 10)
        for k in range(20)
        for member in range(4)
    ]
    header = "scan,time_s,x_m,y_m,sigma_x_m,sigma_y_m"
    np.savetxt(tmp_path / "plots.csv", rows, delimiter=",", header=header, comments="")
    assert radar(tmp_path / "plots.csv", "-o", tmp_path / "out", "--group", "200")[0] == 0
    table = np.genfromtxt(tmp_path / "out" / "groups.csv", delimiter=",", names=True)
    assert len(np.unique(table["track_id"])) == 1
    assert table["members"][-5:].tolist() == [4, 4, 4, 4, 4]
    tracks = np.genfromtxt(tmp_path / "out" / "tracks.csv", delimiter=",", names=True, dtype=None, encoding=None)
    assert tracks["x_m"][-1] == pytest.approx(10_000 + 800 * 19 + 180, abs=25)


def test_the_page_holds_the_run_and_needs_nothing_else(weak, tmp_path):
    assert radar(weak, "-o", tmp_path / "out")[0] == 0
    page = (tmp_path / "out" / "radar.html").read_text(encoding="utf-8")
    assert not re.search(r"(src|href)=|https?:", page)
    data = json.loads(re.search(r"const data = (\{.*\});\n", page)[1])
    assert [scan["number"] for scan in data["scans"]] == list(range(60))
    assert sum(len(scan["plots"]) for scan in data["scans"]) == len(weak.read_text().splitlines()) - 1
    assert np.mean(data["clutter"]["density"]) == pytest.approx(1.0, abs=1e-3)
    shown = {track[0] for scan in data["scans"] for track in scan["tracks"]}
    ids = np.genfromtxt(tmp_path / "out" / "tracks.csv", delimiter=",", names=True)["track_id"]
    assert shown == set(ids.astype(int).tolist())


def test_the_time_of_a_scan_is_refused_for_a_table(tmp_path):
    plots = write(tmp_path / "p.csv", *GOOD)
    code, said = radar(plots, "-o", tmp_path / "out", "--set", "radar.scan_s=4")
    assert code == 2
    assert said == f"setting radar.scan_s has no effect on a table, {plots}; leave it out"
    assert not (tmp_path / "out").exists()
