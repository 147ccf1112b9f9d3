"""Detection probability and clutter density: given for all or each run, or estimated."""

import numpy as np
import pytest

import vidtrack as vt
from vidtrack.tracking.rates import Rates

SIDE = 2000.0


def field(rng, detection, false, scans, targets=20, dim=2, dt=1.0, seen_from=None):
    """Scans of targets that cross a square, with uniform clutter."""
    place = rng.uniform(400, SIDE - 400, (targets, dim))
    velocity = rng.normal(0, 3, (targets, dim))
    for k in range(scans):
        place = place + dt * velocity
        seen = place[rng.random(targets) < detection]
        clutter = rng.uniform(0, SIDE, (rng.poisson(false), dim))
        yield vt.Scan(k * dt, np.vstack([seen + 2 * rng.normal(size=seen.shape), clutter]), 4 * np.eye(dim))


def estimated(method, detection, false, surveyed=SIDE**2, seed=3, scans=150):
    tracker = vt.Tracker(
        vt.ConstantVelocity(accel=0.3, speed=6.0),
        method(),
        detection_probability=None,
        clutter_density=None,
        surveyed=surveyed,
    )
    for scan in field(np.random.default_rng(seed), detection, false, scans):
        tracker.step(scan)
    return tracker.rates


@pytest.mark.parametrize("method", [vt.GNN, vt.PDA, vt.JPDA, vt.MHT])
@pytest.mark.parametrize(("detection", "false"), [(0.95, 20), (0.7, 5)])
def test_estimates_come_close_to_the_truth(method, detection, false):
    rates = estimated(method, detection, false)
    assert rates.detection_probability == pytest.approx(detection, abs=0.04)
    assert rates.clutter_density == pytest.approx(false / SIDE**2, rel=0.15)


def test_without_a_surveyed_area_it_is_where_measurements_lie():
    rates = estimated(vt.GNN, 0.9, 20, surveyed=None)
    assert rates.clutter_density == pytest.approx(20 / SIDE**2, rel=0.25)


def test_a_target_that_leaves_does_not_count_as_missed():
    tracker = vt.Tracker(vt.ConstantVelocity(dim=1), detection_probability=None)
    for k in range(200):
        there = k % 20 < 15
        tracker.step(vt.Scan(float(k), np.full((int(there), 1), 50.0 * (k // 20)), np.eye(1)))
    assert tracker.rates.detection_probability > 0.97


def test_old_scans_are_forgotten():
    tracker = vt.Tracker(vt.ConstantVelocity(accel=0.3, speed=6.0), clutter_density=None, surveyed=SIDE**2)
    rng = np.random.default_rng(0)
    for scan in field(rng, 0.9, 40, 50):
        tracker.step(scan)
    busy = tracker.rates.clutter_density
    assert busy == pytest.approx(40 / SIDE**2, rel=0.2)
    tracker.step(vt.Scan(1e6, np.empty((0, 2)), np.eye(2)))
    assert tracker.rates.clutter_density < 0.1 * busy


def test_the_first_scan_finds_numbers_that_can_be_used():
    rates = vt.Tracker(detection_probability=None, clutter_density=None).rates
    assert 0 < rates.detection_probability < 1
    assert rates.clutter_density > 0


def test_what_is_given_stays():
    tracker = vt.Tracker(detection_probability=0.8, clutter_density=1e-4)
    for scan in field(np.random.default_rng(0), 0.5, 30, 10):
        tracker.step(scan)
    assert (tracker.rates.detection_probability, tracker.rates.clutter_density) == (0.8, 1e-4)


def test_numbers_for_each_run_stay_with_their_run_when_tracks_die():
    """Three runs; the track of the first one dies, and the others keep their own probabilities."""
    detection = np.array([0.1, 0.5, 0.9])
    tracker = vt.Tracker(
        vt.ConstantVelocity(dim=1),
        vt.PDA(),
        life=vt.LifeCycle(coast_scans=2),
        births=False,
        detection_probability=detection,
        clutter_density=np.array([1e-3, 1e-2, 1e-1]),
    )
    tracker.add(0.0, np.zeros((3, 2)), np.tile(np.eye(2), (3, 1, 1)), run=np.arange(3))
    for k in range(4):
        tracks = tracker.step(vt.Scan(float(k), np.zeros((2, 1)), np.eye(1), run=[1, 2]))
    assert tracks.run.tolist() == [1, 2]
    given = Rates(detection, 1e-3).of(tracks.run, tracks.xy)
    np.testing.assert_array_equal(given[0], [0.5, 0.9])
    np.testing.assert_array_equal(given[1], 1e-3)


@pytest.mark.parametrize(
    "given",
    [
        {"detection_probability": -0.1},
        {"detection_probability": np.array([0.5, 1.5])},
        {"detection_probability": np.nan},
        {"clutter_density": -1e-5},
        {"clutter_density": np.inf},
        {"clutter_density": None, "surveyed": 0.0},
    ],
)
def test_what_is_no_rate_is_refused(given):
    with pytest.raises(vt.ConfigError, match="it must"):
        vt.Tracker(**given)
