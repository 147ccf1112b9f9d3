"""Plots that carry their own times."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from vidtrack.config.load import load
from vidtrack.estimate.sensor import POSITION
from vidtrack.radar.sensors import RangeAzimuthElevation
from vidtrack.radar.sweep import Sweep
from vidtrack.run.radar import track_plots

PERIOD_S = 4.0


def rotating(path, aircraft, scans=40, sigma=10.0, own_times=True):
    """A plot table of a beam that goes round in PERIOD_S, and the truth (scans, aircraft, 2) at the mean of its times.

    Each plot is where the aircraft is when the beam meets it.
    """
    rng = np.random.default_rng(5)
    start, velocity = aircraft
    rows, truth = ["scan,time_s,x_m,y_m,sigma_x_m,sigma_y_m"], []
    for k in range(scans):
        times = np.full(len(start), k * PERIOD_S)
        for _ in range(5):  # when does the beam meet it?
            place = start + times[:, None] * velocity
            times = (k + np.arctan2(place[:, 0], place[:, 1]) % (2 * np.pi) / (2 * np.pi)) * PERIOD_S
        place = start + times[:, None] * velocity + sigma * rng.standard_normal(start.shape)
        told = times if own_times else np.full(len(times), times.mean())
        rows += [f"{k},{t:.6f},{x:.3f},{y:.3f},{sigma},{sigma}" for t, (x, y) in zip(told, place, strict=True)]
        truth.append(start + times.mean() * velocity)
    path.write_text("\n".join(rows) + "\n")
    return np.array(truth)


AIRCRAFT = (
    np.array([[5000.0, 20_000.0], [20_000.0, -3000.0], [-4000.0, -25_000.0], [-22_000.0, 2000.0]]),
    np.array([[150.0, 100.0], [-50.0, 200.0], [180.0, 60.0], [100.0, -150.0]]),
)


def errors(path, truth, estimator, last=20):
    """(N,) distances of all tracks of the last scans from the aircraft nearest to them."""
    settings = load(assignments=[f"radar.estimator={estimator}", "radar.accel=1"])
    found = []
    for scan, tracks in track_plots(path, settings):
        if scan >= len(truth) - last:
            assert len(tracks) == truth.shape[1]
            found.append(np.linalg.norm(tracks.xy[:, None] - truth[scan], axis=2).min(axis=1))
    return np.concatenate(found)


@pytest.mark.parametrize("estimator", ["kalman", "ekf", "ukf", "imm"])
def test_tracks_are_where_the_aircraft_are_at_the_scans_time(tmp_path, estimator):
    """Without the plots' own times the error is speed times half a turn of the beam: hundreds of metres."""
    truth = rotating(tmp_path / "plots.csv", AIRCRAFT)
    assert np.sqrt(np.mean(errors(tmp_path / "plots.csv", truth, estimator) ** 2)) < 20


def test_without_their_times_plots_mislead(tmp_path):
    truth = rotating(tmp_path / "plots.csv", AIRCRAFT, own_times=False)
    assert np.sqrt(np.mean(errors(tmp_path / "plots.csv", truth, "kalman") ** 2)) > 100


def test_a_scan_with_many_times_is_one_event(tmp_path):
    rotating(tmp_path / "plots.csv", AIRCRAFT, scans=3)
    assert [len(tracks) for _, tracks in track_plots(tmp_path / "plots.csv")] == [4, 4, 4]


@pytest.mark.parametrize("sensor", [POSITION, RangeAzimuthElevation((10.0, 20.0, 30.0), doppler=True)])
def test_the_jacobian_is_the_derivative(sensor):
    rng = np.random.default_rng(2)
    position = (0, 2, 4)
    x = np.tile([10_000.0, 200.0], 3) * rng.standard_normal((20, 6))
    sweep = Sweep(sensor, KDTree(x[:, position]), rng.uniform(-2, 2, 20), 100.0)
    H = sweep.H(x, position)
    for column in range(6):
        step = np.zeros(6)
        step[column] = 1e-3
        slope = (sweep.h(x + step, position) - sweep.h(x - step, position)) / 2e-3
        assert H[:, :, column] == pytest.approx(slope, rel=1e-4, abs=1e-7)


def test_a_track_begins_less_certain_the_farther_its_plot_is_in_time():
    plots = np.array([[0.0, 0.0], [1000.0, 0.0]])
    sweep = Sweep(POSITION, KDTree(plots), np.array([0.0, 2.0]), 100.0)
    _, cov = sweep.locate(plots, np.tile(25.0 * np.eye(2), (2, 1, 1)))
    assert cov[:, 0, 0].tolist() == [25.0, 25.0 + 200.0**2]
