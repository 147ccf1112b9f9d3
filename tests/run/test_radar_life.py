"""How long tracks of radars live without a plot."""

from types import SimpleNamespace

import numpy as np
import pytest

import vidtrack as vt
from vidtrack.config.load import load
from vidtrack.radar.network.feed import read_feeds
from vidtrack.radar.network.network import Network
from vidtrack.radar.network.radars import read_radars
from vidtrack.run.network import build_network_tracker
from vidtrack.run.radar_life import radar_life
from vidtrack.run.road import ROAD, build_road_tracker
from vidtrack.tracking.station import Visibility

OFTEN_UNSEEN = vt.Station(visibility=Visibility(1.0, 1.0))


@pytest.mark.parametrize(
    ("station", "scan_s", "assignments", "coast_s"),
    [
        (vt.Station(), 0.1, [], 100.0),
        (OFTEN_UNSEEN, 0.1, [], 10.0),
        (OFTEN_UNSEEN, 4.0, [], 20.0),
        (OFTEN_UNSEEN, 4.0, ["radar.unseen_s=3"], 3.0),
        (vt.Station(), 0.1, ["radar.unseen_s=3"], 3.0),
        (OFTEN_UNSEEN, 0.1, ["radar.unseen_s=1e6"], 100.0),
    ],
)
def test_the_time_without_a_plot_is_bounded_where_misses_say_little(station, scan_s, assignments, coast_s):
    feed = SimpleNamespace(rhythm=SimpleNamespace(scan_s=scan_s, limit_s=100.0))
    assert radar_life(load(assignments=assignments), [feed], [station]).coast_s == coast_s


@pytest.mark.parametrize("slowest", [0.0, 0.7])
def test_a_radar_with_a_slowest_range_rate_has_a_blind_zone_and_a_bounded_life(tmp_path, slowest):
    rows = [f"{k},{k / 10:.1f},{30 + k},0,10" for k in range(20)]
    (tmp_path / "radar.csv").write_text("\n".join(["scan,time_s,range_m,azimuth_deg,doppler_m_s", *rows, ""]))
    keys = f"x_m = 0\ny_m = 0\nscan_s = 0.1\nslowest_m_s = {slowest}\nsigma_range_m = 1\nsigma_azimuth_deg = 1\n"
    (tmp_path / "radars.toml").write_text(f"[radars.radar]\n{keys}sigma_doppler_m_s = 0.1\n")
    settings = load(base=ROAD)
    feeds = read_feeds([str(tmp_path / "radar.csv")], read_radars(tmp_path / "radars.toml"), settings.radar)
    network, road = build_network_tracker(settings, Network(feeds)), build_road_tracker(settings, feeds, None)
    for tracker in (network, road):
        zone = tracker.stations.each[0].blind
        assert (zone is not None) == (slowest > 0)
    if slowest > 0:
        bank = vt.KalmanBank(vt.ConstantVelocity())
        bank.insert(np.array([[30.0, slowest, 0.0, 0.0]]), np.eye(4)[None], np.ones(1))
        assert zone.hidden(bank)[0] == pytest.approx(0.49)
        assert network.life.coast_s == 10.0
    assert road.life.coast_s == 10.0
