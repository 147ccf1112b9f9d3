"""Motion models and estimators by name."""

from typing import get_args

import numpy as np
import pytest

from vidtrack.config.load import load
from vidtrack.config.names import Model
from vidtrack.config.radar import RadarSettings
from vidtrack.radar.filters import motion
from vidtrack.run.radar import track_plots
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
        np.concatenate([tracks.xy for scan, tracks in track_plots(speed[0], settings, seed) if scan < 30])
        for seed in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
