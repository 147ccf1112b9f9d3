"""The plots of a simulated traffic radar against the vehicles."""

from dataclasses import replace

import numpy as np
import pytest

from vidtrack.config.load import load
from vidtrack.radar.network.feed import read_feeds
from vidtrack.radar.network.radars import read_radars
from vidtrack.simulate import simulate_road
from vidtrack.simulate.roads.radar import TrafficRadar, road_plots, write_road_plots

PERFECT = TrafficRadar(detected=1 - 1e-9, false=0.0, body=0.0, sigma=(1e-3, 1e-5, 1e-3))


@pytest.fixture(scope="module")
def clip():
    return simulate_road("road", seed=2, fps=10.0, size=(320, 180), seconds=4.0)


def test_a_perfect_radar_measures_moving_vehicles_where_they_are(clip, tmp_path):
    write_road_plots(tmp_path, clip, PERFECT)
    feed = read_feeds([str(tmp_path / "radar.csv")], read_radars(tmp_path / "radars.toml"), load().radar)[0]
    places, rates = feed.found.z[:, :2], feed.plots.z[:, 2]
    for t in np.unique(feed.plots.time_s):
        now, states = feed.plots.time_s == t, clip.history.at(float(t))
        distance = np.linalg.norm(places[now][:, None] - states.xy[None], axis=-1)
        assert distance.min(axis=1).max() < 0.3
        speed = states.speed[distance.argmin(axis=1)]
        assert (np.abs(rates[now]) <= speed + 0.01).all()
    assert np.abs(rates).min() > PERFECT.least - 0.01
    assert (feed.coverage.share(places) > 0).all()


def test_standing_vehicles_and_misses_lack_and_false_plots_come(clip):
    def count(radar):
        return len(road_plots(clip, radar))

    full = count(PERFECT)
    assert count(replace(PERFECT, least=100.0)) == 0
    assert count(replace(PERFECT, detected=0.5)) == pytest.approx(full / 2, abs=4 * np.sqrt(full / 4))
    scans = 40
    assert count(replace(PERFECT, false=5.0)) - full == pytest.approx(5 * scans, abs=4 * np.sqrt(5 * scans))
