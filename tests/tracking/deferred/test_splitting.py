"""Track splitting: branches, their score, and what becomes of them."""

import numpy as np
import pytest

import vidtrack as vt

PREDICTED = np.array([[0.0, 0.0], [3.0, 0.0]])
OBSERVED = np.array([[-1.5, 1.0], [1.2, 0.3], [2.0, -0.4], [9.0, 9.0]])
HALF = 0.5 * np.eye(2)


def standing(rule, positions, gate):
    """A tracker of targets known to half a unit, whose next innovations have unit variance."""
    tracker = vt.Tracker(vt.ConstantVelocity(), rule, gate=gate)
    x = np.zeros((len(positions), 4))
    x[:, ::2] = positions
    tracker.add(0.0, x, np.tile(0.5 * np.eye(4), (len(x), 1, 1)))
    return tracker


def branches(tracker):
    """{(track, measurement or None)} of all rows."""
    newest = tracker.timing.forest.window.past[:, 0]
    rows = zip(tracker.register.id.tolist(), newest.tolist(), strict=True)
    return {(track, j if j >= 0 else None) for track, j in rows}


def test_every_gated_measurement_and_the_miss_make_a_branch():
    """The survey's four observations: seven branches, and the fourth starts a track."""
    tracker = standing(vt.Split(), PREDICTED, gate=0.99)
    tracker.step(vt.Scan(0.0, OBSERVED, HALF))
    assert branches(tracker) == {(1, None), (1, 0), (1, 1), (1, 2), (2, None), (2, 1), (2, 2), (3, 3)}


def track_line(tracker, targets, scans, rng=None, noise=0.0, start=0.0):
    for k in range(scans):
        z = np.array([[x + vx * k, y + vy * k] for x, y, vx, vy in targets])
        z = z + (0 if rng is None else noise * rng.normal(size=z.shape))
        tracks = tracker.step(vt.Scan(start + k, z, 0.25 * np.eye(2)))
    return tracks


def test_two_targets_that_began_as_one_become_two_tracks():
    """The second target appears in the first one's gate and goes elsewhere."""
    tracker = vt.Tracker(vt.ConstantVelocity(accel=0.3, speed=3.0), vt.Split())
    track_line(tracker, [(0, 0, 2, 0)], 5)
    events = []
    for k in range(6):
        z = np.array([[10.0 + 2 * k, 0.0], [10.0 + 2 * k, 0.5 + 0.9 * k]])
        tracks = tracker.step(vt.Scan(5.0 + k, z, 0.25 * np.eye(2)))
        events += tracks.events
    assert any("went its own way" in e.reason for e in events)
    confirmed = tracks.status == vt.Status.CONFIRMED
    assert confirmed.sum() == 2
    assert sorted(tracks.measurement[confirmed].tolist()) == [0, 1]


def test_tracks_that_took_the_same_measurements_are_one():
    tracker = vt.Tracker(vt.ConstantVelocity(accel=0.3, speed=3.0), vt.Split(), births=False)
    x = np.array([[0.0, 1.0, 0.0, 0.0], [0.3, 1.0, 0.2, 0.0]])
    tracker.add(0.0, x, np.tile(0.5 * np.eye(4), (2, 1, 1)))
    for k in range(1, 6):
        tracks = tracker.step(vt.Scan(float(k), np.array([[float(k), 0.0]]), 0.25 * np.eye(2)))
    assert tracks.id.tolist() == [1]


def test_a_branch_that_scores_badly_is_dropped_but_never_the_last():
    tracker = standing(vt.Split(probability=0.5), PREDICTED[:1], gate=0.999)
    tracker.step(vt.Scan(0.0, np.array([[0.5, 0.0], [3.0, 0.0]]), HALF))
    assert branches(tracker) == {(1, None), (1, 0)}, "the far one is beyond the median of its distance"
    tracker = standing(vt.Split(probability=1e-6), PREDICTED[:1], gate=0.999)
    tracker.step(vt.Scan(0.0, np.array([[0.5, 0.0]]), HALF))
    assert (1, 0) in branches(tracker)


def test_the_number_of_branches_is_bounded():
    tracker = vt.Tracker(
        vt.ConstantVelocity(speed=3.0), vt.Split(leaves=6), clutter_density=1e-3, life=vt.LifeCycle(coast_scans=20)
    )
    rng = np.random.default_rng(0)
    for k in range(20):
        tracker.step(vt.Scan(float(k), rng.uniform(0, 30, (30, 2)), np.eye(2)))
        assert np.unique(tracker.register.id, return_counts=True)[1].max() <= 6
        assert len(tracker.bank) == len(tracker.register) == len(tracker.timing.forest.window)


@pytest.mark.parametrize("wrong", [{"n_scan": 0}, {"leaves": 0}, {"branches": 0}, {"probability": 1.0}])
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(vt.ConfigError, match=str(next(iter(wrong.values())))):
        vt.Split(**wrong)
