"""Motion models and estimators by name."""

from itertools import islice
from types import SimpleNamespace
from typing import get_args

import numpy as np
import pytest

from vidtrack.config.load import load
from vidtrack.config.names import Model
from vidtrack.config.radar import RadarSettings
from vidtrack.decision import Decision
from vidtrack.errors import ConfigError
from vidtrack.estimate.sensor import POSITION
from vidtrack.radar.filters import estimator, motion
from vidtrack.run.radar import track_plots
from vidtrack.run.road import build_road_tracker
from vidtrack.scan import Scan
from vidtrack.simulate.radar_scenarios import simulate_radar
from vidtrack.simulate.radar_write import write_radar


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", get_args(Model))
def test_a_model_is_in_metres_and_as_uncertain_as_the_settings_say(name, dim):
    model = motion(RadarSettings(model=name, max_speed=300.0), dim)
    x, P = model.birth(np.ones((1, dim)), np.eye(dim)[None], np.ones(1))
    assert model.dim == dim
    assert not model.per_size
    assert np.sqrt(P[0, 1, 1]) == pytest.approx(150)
    assert x[0, list(model.position)].tolist() == [1.0] * dim


@pytest.fixture(scope="module")
def speed(tmp_path_factory):
    """Folder and truth of the 2.5 g speed manoeuvre."""
    seen = simulate_radar("radar-speed", 1)
    folder = tmp_path_factory.mktemp("speed")
    write_radar(seen, folder)
    return folder / "plots.csv", seen.states[0]


FILTERS = [(estimator, "cv") for estimator in ("kalman", "converted", "ekf", "ukf", "imm", "alpha-beta", "particle")]
FILTERS += [("kalman", model) for model in ("ca", "singer", "ct")] + [("imm", "ct")]


@pytest.mark.parametrize(("estimator", "model"), FILTERS)
def test_every_filter_follows_the_manoeuvre_and_improves_on_the_plots(speed, estimator, model):
    path, truth = speed
    settings = load(assignments=[f"radar.estimator={estimator}", f"radar.model={model}"])
    snapshots = list(track_plots(path, settings))
    error = np.array([np.linalg.norm(tracks.xy[0] - truth[scan, :3]) for scan, tracks in snapshots if scan > 20])
    assert all(len(tracks) == 1 for _, tracks in snapshots[3:])
    assert len({int(tracks.id[0]) for _, tracks in snapshots}) == 1
    measured = np.linalg.norm(truth[20:, :3], axis=1).mean() * np.radians(0.04) * np.sqrt(2)
    assert np.sqrt(np.mean(error**2)) < 0.75 * measured


def test_particles_are_the_same_for_the_same_seed(speed):
    settings = load(assignments=["radar.estimator=particle", "radar.particles=200"])
    first, again, other = (
        np.concatenate([tracks.xy for _, tracks in islice(track_plots(speed[0], settings, seed), 30)])
        for seed in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


@pytest.mark.parametrize("resampling", ["none", "error-signal"])
def test_particles_of_which_one_has_all_the_weight_are_tracked_and_not_smoothed(resampling, tmp_path):
    write_radar(simulate_radar("radar-crossing", 7), tmp_path)
    chosen = [("radar.estimator", "particle"), ("radar.particles", 200), ("radar.resampling", resampling)]
    scans = [tracks for _, tracks in track_plots(tmp_path / "plots.csv", load(assignments=chosen))]
    assert len(scans) > 40
    assert sum(len(tracks) > 0 for tracks in scans) > 30
    with pytest.raises(ConfigError, match="cannot be smoothed"):
        next(track_plots(tmp_path / "plots.csv", load(assignments=[*chosen, ("output.smooth", True)])))


@pytest.mark.parametrize("chosen", ["radar.estimator=alpha-beta", "radar.resampling=none"])
def test_beside_a_camera_neither(chosen):
    settings = load(assignments=["radar.estimator=particle", chosen, "output.smooth=true"])
    with pytest.raises(ConfigError, match="cannot be smoothed"):
        build_road_tracker(settings, [], None)


@pytest.mark.parametrize(("swing_m", "agile"), [(1200.0, True), (0.0, False)])
def test_plots_tell_which_targets_manoeuvre_all_the_time(swing_m, agile):
    settings, t = RadarSettings(agile=0.01), 4.0 * np.arange(40)
    rng = np.random.default_rng(0)
    z = np.column_stack([200 * t, swing_m * np.sin(2 * np.pi * t / 40)]) + rng.normal(0, 50, (40, 2))
    found = SimpleNamespace(dim=2, R=np.tile(2500 * np.eye(2), (40, 1, 1)))
    bank = estimator(settings, found)(motion(settings, 2))
    bank.append(z[:1], found.R[:1], np.ones(1))
    one = np.zeros(1, np.int64)
    for time_s, plot in zip(t[1:], z[1:], strict=True):
        bank.predict(4.0)
        bank.update(Decision(one, one, one, np.ones(1), np.zeros(1)), Scan(time_s, plot[None], found.R[:1]), POSITION)
    assert (bank.mode[0, 2:].sum() > 0.9) if agile else (bank.mode[0, 2:].sum() < 0.05)


@pytest.mark.parametrize("agile", [0.0, 0.01])
def test_a_manoeuvre_counts_twice_where_plots_are_gated(agile):
    settings, R = RadarSettings(agile=agile), 2500 * np.eye(2)[None]
    bank = estimator(settings, SimpleNamespace(dim=2, R=R))(motion(settings, 2))
    bank.append(np.zeros((1, 2)), R, np.ones(1))
    gated = bank.modes(POSITION).weight[:, 0]
    assert gated[1] / gated[0] == pytest.approx(2 * bank.mode[0, 1] / bank.mode[0, 0])
    assert gated[1] / gated[0] == pytest.approx(2 * settings.manoeuvre_s / settings.quiet_s)
