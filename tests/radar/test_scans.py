"""Plots as scans for the tracker."""

from dataclasses import replace

import numpy as np
import pytest
from plot_files import HEADER, write

from vidtrack.config.radar import RadarSettings
from vidtrack.estimate.sensor import POSITION
from vidtrack.radar.plots import read_plots
from vidtrack.radar.scans import clutter_density, extent, measurements, surveyed
from vidtrack.radar.sensors import PositionRangeRate, RangeAzimuth, RangeAzimuthElevation


def read(path, *rows, header=HEADER, **settings):
    settings = RadarSettings(**settings)
    return measurements(read_plots(write(path / "p.csv", *rows, header=header), settings), settings)


def test_skipped_scan_numbers_are_empty_scans_at_times_between(tmp_path):
    found = read(tmp_path, "4,10,1000,0,5,0.1", "7,16,1000,1,5,0.1", "7,16,1000,9,5,0.1", "8,17,1000,2,5,0.1")
    scans = list(found)
    assert [number for number, _ in scans] == [4, 5, 6, 7, 8]
    assert [scan.t for _, scan in scans] == pytest.approx([10, 12, 14, 16, 17])
    assert [len(scan) for _, scan in scans] == [1, 0, 0, 2, 1]
    assert found.count == 5
    assert all(scan.noise.shape == (2, 2) for _, scan in scans)


def test_the_rhythm_of_scans_is_found_once(tmp_path):
    found = read(tmp_path, "0,0,1000,0,5,0.1", "1,4,1000,1,5,0.1", "3,12,1000,2,5,0.1")
    assert found.rhythm.scan_s == pytest.approx(4)
    assert found.rhythm is found.rhythm


def test_the_time_of_a_scan_is_the_mean_of_its_plots(tmp_path):
    found = read(tmp_path, "0,1,1000,0,5,0.1", "0,3,1000,90,5,0.1", "1,5,1000,0,5,0.1", "1,7,1000,90,5,0.1")
    assert [scan.t for _, scan in found] == [2, 6]


def test_linear_estimators_get_positions_as_seen_from_the_radar(tmp_path):
    found = read(tmp_path, "0,0,1000,90,5,0.1", position=(100.0, 200.0, 0.0))
    assert found.sensor is POSITION
    assert found.z[0] == pytest.approx([1100, 200], abs=0.01)
    assert found.R[0, 0, 0] == pytest.approx(25, rel=1e-3)
    assert found.R[0, 1, 1] == pytest.approx((1000 * np.radians(0.1)) ** 2, rel=1e-3)


def test_the_extended_filter_gets_range_and_azimuth(tmp_path):
    found = read(tmp_path, "0,0,1000,270,5,0.1", estimator="ekf", position=(1.0, 2.0, 3.0))
    assert found.sensor == RangeAzimuth((1.0, 2.0))
    assert found.z[0] == pytest.approx([1000, -np.pi / 2])


def test_errors_grow_by_the_extent_of_targets_in_all_directions(tmp_path):
    """Echoes that wander on a vehicle near a radar have the errors that are stated, across the line of sight too."""
    rng = np.random.default_rng(4)
    true = np.array([20.0, 15.0])
    echo = true + rng.normal(0, 0.7, (4000, 2))
    polar = np.column_stack([np.hypot(*echo.T), np.degrees(np.arctan2(*echo.T))]) + rng.normal(0, (0.4, 1), (4000, 2))
    rows = [f"{k},{k},{r},{a},0.4,1" for k, (r, a) in enumerate(polar)]
    points, vehicles = read(tmp_path, *rows), read(tmp_path, *rows, extent_m=0.7)
    nees = [np.einsum("ni,nij,nj->n", f.z - true, np.linalg.inv(f.R), f.z - true).mean() for f in (points, vehicles)]
    assert nees[0] > 4
    assert nees[1] == pytest.approx(2, abs=0.1)
    assert vehicles.R[:, 0, 0] + vehicles.R[:, 1, 1] == pytest.approx(
        0.4**2 + (25 * np.radians(1)) ** 2 + 2 * 0.7**2, rel=0.2
    )


def test_the_extent_in_positions_and_elevation(tmp_path):
    flat = read(tmp_path, "0,0,100,50,3,4", header="scan,time_s,x_m,y_m,sigma_x_m,sigma_y_m", extent_m=4)
    assert np.diag(flat.R[0]) == pytest.approx([25, 32])
    header = "scan,time_s,range_m,azimuth_deg,elevation_deg,sigma_range_m,sigma_azimuth_deg,sigma_elevation_deg"
    high = read(tmp_path, "0,0,100,50,3,3,1,2", header=header, extent_m=4, estimator="ekf")
    one = np.radians([1, 2])
    assert np.diag(high.R[0]) == pytest.approx(
        [25, one[0] ** 2 + (0.04 / np.cos(np.radians(3))) ** 2, one[1] ** 2 + 0.04**2]
    )


@pytest.mark.parametrize(
    ("estimator", "kind", "size"), [("kalman", PositionRangeRate, 4), ("ekf", RangeAzimuthElevation, 4)]
)
def test_a_range_rate_stays_one(tmp_path, estimator, kind, size):
    header = "scan,time_s,range_m,azimuth_deg,elevation_deg,doppler_m_s"
    found = read(tmp_path, "0,0,1000,0,0,-30", header=header, estimator=estimator, position=(0.0, 0.0, 5.0))
    assert isinstance(found.sensor, kind)
    assert found.sensor.origin == (0, 0, 5)
    assert found.z.shape == (1, size)
    assert found.z[0, -1] == -30


def test_the_clutter_density_is_plots_per_scan_and_area(tmp_path):
    rng = np.random.default_rng(1)
    rows = [f"{k},{k},{x},{y}" for k in range(50) for x, y in rng.uniform(0, 1e6, (20, 2))]
    found = read(tmp_path, *rows, header="scan,time_s,x_m,y_m")
    assert clutter_density(found) == pytest.approx(20e-12, rel=0.01)


def test_the_plots_of_one_target_do_not_look_like_clutter(tmp_path):
    """The space around them that a target could reach within four scans counts as surveyed too."""
    header = "scan,time_s,x_m,y_m,doppler_m_s"
    found = read(tmp_path, "0,0,0,5,1", "1,2,100,5,1", header=header, sigma_position_m=10.0, max_speed=50.0)
    error, reach = np.sqrt(12) * np.array([10.0, 10.0, 2.0]), np.array([800.0, 800.0, 100.0])
    assert surveyed(found) == pytest.approx((np.array([100.0, 0.0, 0.0]) + error + reach).prod())


def test_a_sector_to_the_south_is_no_wider_than_one_to_the_north(tmp_path):
    found = [
        read(tmp_path, *(f"{k},{k},{9000 + 10 * k},{azimuth + k},5,0.1" for k in range(20)), estimator="ekf")
        for azimuth in (-10, 170)
    ]
    north, south = map(surveyed, found)
    assert south == pytest.approx(north)
    assert north > 190 * np.radians(19)


@pytest.mark.parametrize("middle", [0.0, 90.0, 180.0])
def test_what_is_surveyed_is_a_sector_that_holds_the_plots(tmp_path, middle):
    rows = [f"{k},{k},{9000 + 10 * k},{middle + k - 10},5,0.1" for k in range(20)]
    found = read(tmp_path, *rows, estimator="ekf")
    low, high = extent(found)
    assert low[0] >= 0
    assert high[1] - low[1] < 2 * np.pi
    off = (found.z[:, 1] - (low[1] + high[1]) / 2 + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(off).max() < (high[1] - low[1]) / 2
    assert surveyed(found) == pytest.approx((high - low).prod())


def test_near_the_radar_a_full_turn_is_surveyed_at_most(tmp_path):
    low, high = extent(read(tmp_path, *(f"{k},{4 * k},{50 + k},{18 * k},5,0.1" for k in range(20)), estimator="ekf"))
    assert high[1] - low[1] == pytest.approx(2 * np.pi)
    assert low[0] == 0.0


def test_an_angle_without_ranges_may_turn_as_it_likes(tmp_path):
    """The first component is a range for a radar only: of bearings alone none is taken for one."""

    class Bearing:
        angles = (0,)

    found = replace(read(tmp_path, "0,0,1000,10,5,0.1", "1,4,1000,20,5,0.1", estimator="ekf"), sensor=Bearing(), dim=1)
    low, high = extent(replace(found, z=found.z[:, 1:], R=found.R[:, 1:, 1:]))
    assert (high - low).tolist() == pytest.approx([2 * np.pi])


def test_a_single_plot_has_a_surveyed_space(tmp_path):
    for estimator in ("kalman", "ekf"):
        assert surveyed(read(tmp_path, "0,0,1000,0,5,0.1", estimator=estimator)) > 0
