"""Simulated radar plots and their truth."""

import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

from vidtrack import formats
from vidtrack.amplitude.densities import RAYLEIGH, Weibull
from vidtrack.cli.simulate import RADAR, command
from vidtrack.errors import ConfigError
from vidtrack.radar.plots import read_plots
from vidtrack.simulate.flight import G, Leg, fly, sidestep, weave
from vidtrack.simulate.radar import Radar, Target, observe
from vidtrack.simulate.radar_scenarios import SCENARIOS, simulate_radar
from vidtrack.simulate.radar_write import write_radar

TIMES = np.linspace(0.03, 40.03, 401)
FLIGHTS = {
    "straight": fly((1, 2, 3), (100, -50, 5)),
    "accelerated": fly((0, 60e3, 0), (0, -200, 0), (Leg(10), Leg(6.118, accel=2.5 * G), Leg(np.inf))),
    "turning": fly((0, 0, 1e3), (0, 200, 3), (Leg(5), Leg(10, turn=0.12), Leg(np.inf))),
    "weaving": weave(fly((0, 0, 3e3), (100, 0, 0)), amplitude=300, period_s=20, from_s=8),
    "side by side": sidestep(fly((0, 0, 0), (0, 200, 0)), (1000, 0, 0), 0.05, (5, 15, 25, 35)),
}


@pytest.mark.parametrize("name", FLIGHTS)
def test_velocity_is_the_slope_of_the_position(name):
    p, v = FLIGHTS[name](TIMES)
    step = 1e-5
    slope = (FLIGHTS[name](TIMES + step)[0] - FLIGHTS[name](TIMES - step)[0]) / (2 * step)
    assert np.abs(slope - v).max() < 0.02
    assert p.shape == v.shape == (len(TIMES), 3)


def test_a_turn_keeps_its_speed_and_goes_clockwise():
    _, v = FLIGHTS["turning"](TIMES)
    assert np.linalg.norm(v[:, :2], axis=1) == pytest.approx(200)
    assert v[-1, 0] == pytest.approx(200 * np.sin(1.2))  # from north towards east
    assert v[-1, 2] == 3


def test_the_speed_scenario_is_that_of_the_specification():
    """SPEC 003, S3: check points of the range."""
    seen = simulate_radar("radar-speed", 3)
    r = np.linalg.norm(seen.states[0, :, :3], axis=1)
    expected = {0: 60000.0, 77: 58000.0, 78: 57973.81922225502, 100: 57293.22571576151, 124: 56322.50611717828,
                125: 56277.054114021885, 230: 51504.32684129461}  # fmt: skip
    assert r[list(expected)] == pytest.approx(list(expected.values()), abs=1e-3)
    assert len(r) == 232


def test_the_altitude_scenario_is_that_of_the_specification():
    seen = simulate_radar("radar-altitude", 0)
    t = seen.times
    swing = np.where(t >= 8, 300 * np.sin(2 * np.pi * (t - 8) / 20), 0)
    assert seen.states[0, :, :3] == pytest.approx(np.stack([8e3 - 100 * t, 28e3 - 280 * t, 3e3 + swing], axis=1))


@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("seed", [0, 1, 12345])
def test_a_seed_draws_the_same_and_another_one_something_else(name, seed):
    first, again, other = (simulate_radar(name, s) for s in (seed, seed, seed + 1))
    assert np.array_equal(first.z, again.z)
    assert len(first.z) != len(other.z) or not np.array_equal(first.z, other.z)


@pytest.mark.parametrize("seed", range(5))
def test_crossing_and_unresolved_aircraft_do_what_they_promise(seed):
    crossing = simulate_radar("radar-crossing", seed)
    distance = np.linalg.norm(crossing.states[0, :, :2] - crossing.states[1, :, :2], axis=1)
    assert distance.argmin() in range(24, 27)
    assert distance.min() < 100
    assert not crossing.merged.any()
    unresolved = simulate_radar("radar-unresolved", seed)
    assert unresolved.merged[0].sum() >= 20
    assert not unresolved.merged[:, [0, 1, 2, 3, 4, -5, -4, -3, -2, -1]].any()


def test_half_of_the_parting_pairs_cross():
    crossed = []
    for seed in range(12):
        seen = simulate_radar("radar-parting", seed)
        assert seen.merged[0].sum() >= 5
        assert not seen.merged[:, [0, 1, 2, 3, 4, -5, -4, -3, -2, -1]].any()
        apart = seen.states[0, [0, -1], :2] - seen.states[1, [0, -1], :2]
        crossed.append(apart[0] @ apart[1] < 0)
    assert 2 <= sum(crossed) <= 10


@pytest.mark.parametrize("after", [1.0, -1.0, 0.5])
def test_a_sidestep_ends_at_its_share_and_its_velocity_is_the_derivative(after):
    flight = sidestep(fly((0, 0, 0), (100, 0, 0)), np.array([0.0, 1000.0, 0.0]), 0.05, (10, 30, 60, 90), after)
    t = np.linspace(0, 100, 2001)
    p, v = flight(t)
    np.testing.assert_allclose(p[[0, 900, -1], 1], [1000, 50, 1000 * after])
    np.testing.assert_allclose(np.gradient(p, t, axis=0)[1:-1], v[1:-1], atol=1.0)


def test_surveillance_holds_manoeuvres_and_separation():
    seen = simulate_radar("radar-tws", 4)
    v = seen.states[..., 3:]
    acceleration = np.linalg.norm(np.diff(v, axis=1), axis=2).max(axis=1) / seen.radar.scan_s
    assert (acceleration[:2] > 1.5 * G).all()  # a turn may begin between two scans
    assert (acceleration[2:] < 1e-6).all()
    assert seen.there.sum(axis=1)[2:4].max() < 60


STATIONARY = Target(fly((3000, 4000, 0), (0, 1e-9, 0)))
PLAIN = Radar(1.0, (0.0, 0.0), (10e3, 360.0), (100.0, 1.0), (5.0, 0.1))


def test_an_echo_is_seen_as_often_as_swerling_says():
    radar = Radar(1.0, (0.0, 0.0), (10e3, 360.0), (100.0, 1.0), (5.0, 0.1), snr_db=10.0, p_fa=1e-6)
    seen = observe(radar, [STATIONARY], 20_000, np.random.default_rng(1))
    near = np.abs(seen.z[:, 0] - 5000) < 50
    expected = 1e-6 ** (1 / 11)
    assert near.mean() * len(near) / 20_000 == pytest.approx(expected, abs=4 * np.sqrt(expected / 20_000))
    assert seen.amplitude.min() > radar.threshold


@pytest.mark.parametrize("clutter", [RAYLEIGH, Weibull(1.2, 0.8)])
def test_clutter_is_poisson_and_exceeds_the_threshold_as_its_density_says(clutter):
    radar = Radar(1.0, (0.0, 0.0), (10e3, 360.0), (100.0, 1.0), (5.0, 0.1), 10.0, 1e-4, clutter)
    gone = Target(STATIONARY.flight, end_s=-1.0)
    seen = observe(radar, [gone], 5000, np.random.default_rng(2))
    count = np.bincount(seen.scan, minlength=5000)
    assert count.mean() == pytest.approx(3.6, abs=4 * np.sqrt(3.6 / 5000))
    assert count.var() == pytest.approx(3.6, rel=0.1)
    higher = radar.threshold * 1.2
    share = clutter.survival(higher) / clutter.survival(radar.threshold)
    assert (seen.amplitude > higher).mean() == pytest.approx(share, abs=4 * np.sqrt(share / len(seen.amplitude)))


@pytest.mark.parametrize(("glint", "expected"), [(0.0, 1.0), (0.1, 0.9 + 0.1 * 25)])
def test_glint_widens_the_errors(glint, expected):
    radar = Radar(1.0, PLAIN.low, PLAIN.high, PLAIN.cell, PLAIN.sigma, glint=glint)
    seen = observe(radar, [STATIONARY], 20_000, np.random.default_rng(3))
    error = seen.z - radar.measures(np.array([[3000.0, 4000.0, 0.0]]))
    assert (error**2).mean(axis=0) / np.square(radar.sigma) == pytest.approx(expected, rel=0.1)


def test_targets_in_one_cell_give_one_plot_between_them():
    near = Target(fly((3000, 4040, 0), (0, 1e-9, 0)))
    far = Target(fly((-3000, 4000, 0), (0, 1e-9, 0)))
    seen = observe(PLAIN, [STATIONARY, near, far], 10, np.random.default_rng(4))
    assert np.bincount(seen.scan).tolist() == [2] * 10
    assert seen.merged.tolist() == [[True] * 10, [True] * 10, [False] * 10]
    east = seen.z[:, 1] < 180
    middle = PLAIN.measures(np.array([[3000.0, 4020.0, 0.0]]))
    assert seen.z[east].mean(axis=0) == pytest.approx(middle[0], abs=6)


def test_a_cell_across_north_is_one_cell():
    west, east = (Target(fly((x, 5000, 0), (0, 1e-9, 0))) for x in (-10, 10))
    seen = observe(PLAIN, [west, east], 5, np.random.default_rng(5))
    assert len(seen.z) == 5
    assert (np.minimum(seen.z[:, 1], 360 - seen.z[:, 1]) < 1).all()


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_files_can_be_read_back(tmp_path, name):
    seen = simulate_radar(name, 1)
    write_radar(seen, tmp_path)
    plots = read_plots(tmp_path / "plots.csv")
    assert len(plots) == len(seen.scan)
    assert plots.z[:, 0] == pytest.approx(seen.z[:, 0], abs=1e-3)
    truth = formats.read(tmp_path / "truth.csv")
    assert truth.unit == "m"
    assert truth.xy.shape == (seen.there.sum(), 3)
    header = (tmp_path / "truth.csv").read_text().splitlines()[0]
    assert header == "scan,time_s,target_id,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s"


def test_the_command_writes_exactly_two_files_and_names_all_scenarios(tmp_path):
    folder = tmp_path / "new"
    result = CliRunner().invoke(command, ["radar-tws", "-o", str(folder), "--seed", "2", "--glint", "0.1"])
    assert result.exit_code == 0, result.output
    assert sorted(path.name for path in folder.iterdir()) == ["plots.csv", "truth.csv"]
    page = CliRunner().invoke(command, ["--help"]).output
    assert all(name in page for name in RADAR)
    assert set(RADAR) == set(SCENARIOS)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [(["radar-tws", "--fps", "5"], "--fps"), (["junction", "--snr-db", "5"], "--snr-db"),
     (["radar-tws", "--weibull", "2"], "'2'")],
)  # fmt: skip
def test_an_option_of_the_other_kind_is_refused(tmp_path, arguments, named):
    result = CliRunner().invoke(command, [*arguments, "-o", str(tmp_path / "new")])
    assert result.exit_code == 2
    assert named in result.output
    assert not (tmp_path / "new").exists()


def test_options_change_the_radar(tmp_path):
    few, many = (len(simulate_radar("radar-tws", 1, p_fa=p_fa).scan) for p_fa in (1e-6, 1e-3))
    assert many > 10 * few


def test_more_clutter_than_memory_is_refused():
    with pytest.raises(ConfigError, match="88,164,000 cells"):
        simulate_radar("radar-speed", p_fa=0.01)


def test_radar_plots_are_drawn_without_opencv():
    code = (
        "import sys; from vidtrack.simulate.radar_scenarios import simulate_radar; simulate_radar('radar-tws');"
        "assert 'cv2' not in sys.modules"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
