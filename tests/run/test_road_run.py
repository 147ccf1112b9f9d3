"""Radar and camera on one road: what a run says of sensors that never meet."""

import json

import numpy as np
import pytest
from pinhole import HEIGHT, POINTS, WIDTH, Pinhole, site_of

import vidtrack as vt
from vidtrack.config.load import load
from vidtrack.config.settings import SourceSettings
from vidtrack.errors import ConfigError
from vidtrack.output.sink import Step
from vidtrack.radar.network.feed import read_feeds
from vidtrack.radar.network.radars import read_radars
from vidtrack.run.road import (
    ROAD,
    Camera,
    build_road_tracker,
    is_shown,
    road_steps,
    run_road,
    stated_span,
    told_if_apart,
)
from vidtrack.simulate import simulate_road
from vidtrack.simulate.roads.write import write_road
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.road_scans import InPicture


def steps(times_s):
    """Steps of stations (N,) at times (N,), as pairs."""
    return [
        Step(k, t, vt.Scan(t, np.zeros((0, 2)), np.eye(2), station=station), None, None, None, {})
        for k, (station, t) in enumerate(times_s)
    ]


@pytest.mark.parametrize(
    ("times_s", "said"),
    [
        ([(0, 0), (1, 1), (0, 2), (1, 3)], ""),
        ([(0, 0), (0, 2), (1, 2)], ""),
        ([(0, 0), (0, 2), (1, 6)], ""),  # as near as a track coasts
        ([(0, 0), (0, 2)], ""),
        ([(1, 0), (1, 14), (0, 1000), (0, 1010)], "scans 1000 to 1010 s, pictures 0 to 14 s"),
        ([(0, 0), (0, 10), (1, 20), (1, 30)], "scans 0 to 10 s, pictures 20 to 30 s"),
    ],
)
def test_a_radar_and_a_camera_without_a_common_time_are_told(caplog, times_s, said):
    given = steps(times_s)
    assert list(told_if_apart(given, 1, 5.0)) == given
    assert ("have no common time" in caplog.text) is (said != "")
    assert said in caplog.text


@pytest.mark.parametrize(("x_m", "common"), [(0, True), (99999, False)])
def test_a_radar_whose_plots_the_camera_does_not_show_has_no_common_place(tmp_path, x_m, common):
    rows = [f"{k},{k},{20 + 2 * k},0,1,1" for k in range(5)]
    header = "scan,time_s,range_m,azimuth_deg,sigma_range_m,sigma_azimuth_deg"
    (tmp_path / "radar.csv").write_text("\n".join([header, *rows]) + "\n")
    (tmp_path / "radars.toml").write_text(f"[radars.radar]\nx_m = {x_m}\ny_m = 0\n")
    feeds = read_feeds([str(tmp_path / "radar.csv")], read_radars(tmp_path / "radars.toml"), load().radar)
    ground = calibrated(site_of(Pinhole().picture(POINTS), POINTS))
    assert is_shown(feeds[0], InPicture(ground, (WIDTH, HEIGHT))) is common


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """A folder with a second of a simulated road."""
    folder = tmp_path_factory.mktemp("road")
    write_road(simulate_road("road", seed=2, fps=10.0, size=(320, 180), seconds=1.0), folder)
    return folder


def test_a_run_tells_of_a_radar_that_the_camera_never_meets(clip, tmp_path, caplog):
    header = "scan,time_s,range_m,azimuth_deg,sigma_range_m,sigma_azimuth_deg"
    (tmp_path / "radar.csv").write_text("\n".join([header, *(f"{k},{5000 + k},{20 + 2 * k},0,1,1" for k in range(5))]))
    (tmp_path / "radars.toml").write_text("[radars.radar]\nx_m = 99999\ny_m = 0\n")
    given = [str(tmp_path / "radar.csv")], tmp_path / "radars.toml", str(clip / "video.avi"), clip / "site.toml"
    with run_road(*given, load(base=ROAD), tmp_path / "run") as run:
        assert "no plot of a radar is where the camera shows the road" in caplog.text
        assert "scans 5000 to 5004 s, pictures 0 to 1 s" in caplog.text  # nothing is tracked yet
        assert len(list(run)) == 15
    assert caplog.text.count("have no common time") == 1


def test_two_radars_beside_a_camera_tell_their_biases(clip, tmp_path):
    header = "scan,time_s,range_m,azimuth_deg,sigma_range_m,sigma_azimuth_deg"
    rng = np.random.default_rng(4)
    for k, (name, bias_m) in enumerate((("a", 0.0), ("b", 1.0))):
        noise = rng.normal(size=(100, 2)) * [0.4, 1.0]
        rows = [
            f"{j},{(2 * j + k) / 20:.2f},{60 + bias_m - (j + k / 2) / 2 + r:.3f},{20 + a:.3f},0.4,1"
            for j, (r, a) in enumerate(noise)
        ]
        (tmp_path / f"{name}.csv").write_text("\n".join([header, *rows]) + "\n")
    place = "x_m = 0\ny_m = 0\nfarthest_m = 120\n"
    (tmp_path / "radars.toml").write_text(f"[radars.a]\nbias_range_m = 0\n{place}[radars.b]\nbias_range_m = 3\n{place}")
    tables = [str(tmp_path / f"{name}.csv") for name in "ab"]
    given = tables, tmp_path / "radars.toml", str(clip / "video.avi"), clip / "site.toml"
    with run_road(*given, load(base=ROAD), tmp_path / "run") as run:
        steps = list(run)
    found = json.loads((tmp_path / "run" / "summary.json").read_text())["stations"]
    assert found["b"]["bias_range_m"] == pytest.approx(1.0, abs=3 * found["b"]["bias_range_sigma_m"])
    assert found["b"]["bias_range_sigma_m"] < 0.3
    assert set(found) == {"a", "b", "camera"}
    assert len((tmp_path / "run" / "registration.csv").read_text().splitlines()) == 1 + 2 * len(steps)


def test_the_times_of_the_pictures_of_a_file_are_those_of_the_part_that_is_read(clip):
    video = str(clip / "video.avi")
    assert stated_span(video, SourceSettings()) == pytest.approx((0, 1))
    assert stated_span(video, SourceSettings(start_s=0.2, end_s=0.5)) == pytest.approx((0.2, 0.5))
    assert stated_span(str(clip), SourceSettings()) is None
    assert stated_span(video, SourceSettings(fps=5.0)) == pytest.approx((0, 2))  # the file states 10 frames/s


class Asked:
    """Stands for the scans of a camera, and notes where it is told that vehicles are."""

    def scan(self, blobs, tracks, vehicles, station, *, dark=False):
        self.vehicles = vehicles
        return blobs


def test_a_camera_is_told_where_the_confirmed_vehicles_in_its_picture_are_by_now():
    ground, asked = calibrated(site_of(Pinhole().picture(POINTS), POINTS)), Asked()
    camera = Camera(steps([(0, 1.0)]), asked, InPicture(ground, (WIDTH, HEIGHT)))
    tracker = build_road_tracker(load(base=ROAD), [], camera)
    ahead, behind = [0.0, 0.0, 20.0, 2.0], [0.0, 0.0, -20.0, 2.0]
    tracker.add(0.5, np.array([ahead, behind]), np.tile(np.eye(4), (2, 1, 1)))
    assert len(list(road_steps(None, camera, tracker))) == 1
    np.testing.assert_allclose(asked.vehicles, [[0.0, 21.0]])


def test_one_gain_for_two_rates_of_scans_is_refused():
    settings = load(assignments=["radar.estimator=alpha-beta"], base=ROAD)
    with pytest.raises(ConfigError, match="take kalman"):
        build_road_tracker(settings, [], None)
