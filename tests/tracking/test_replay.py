"""Scans out of order: the tracks are those of scans in order."""

import numpy as np
import pytest

import vidtrack as vt

STATIONS = 2


def tracker():
    picture, stations = vt.NoPicture(), [vt.Station(vt.Rates(0.8, 1e-5)) for _ in range(STATIONS)]
    return vt.Tracker(vt.ConstantVelocity(accel=0.5, speed=10.0), picture=picture, stations=stations)


def scans(seed, count=40, targets=4):
    """Scans of two stations with misses and clutter, in order of time."""
    rng = np.random.default_rng(seed)
    place, velocity = rng.uniform(0, 1000, (targets, 2)), rng.normal(0, 5, (targets, 2))
    for k in range(count):
        t = 0.5 * k
        seen = (place + t * velocity)[rng.random(targets) < 0.8]
        z = np.vstack([seen + rng.normal(size=seen.shape), rng.uniform(0, 1000, (rng.poisson(2), 2))])
        yield vt.Scan(t, z, np.eye(2), station=k % STATIONS)


def late(rng, each, window_s):
    """The scans in order of arrival, with delays up to the window."""
    arrival = [scan.t + rng.uniform(0, window_s) for scan in each]
    return [each[k] for k in np.argsort(arrival)]


@pytest.mark.parametrize("seed", range(4))
def test_late_scans_give_the_tracks_of_scans_in_order(seed):
    each = list(scans(seed))
    plain, replay = tracker(), vt.Replay(tracker(), 3.0)
    for scan in each:
        expected = plain.step(scan)
    order = late(np.random.default_rng(seed), each, 3.0)
    assert [scan.t for scan in order] != [scan.t for scan in each]
    for scan in order:
        found = replay.step(scan)
    assert found.t == expected.t
    np.testing.assert_array_equal(found.x, expected.x)
    np.testing.assert_array_equal(found.P, expected.P)
    np.testing.assert_array_equal(found.status, expected.status)


def test_a_track_keeps_its_id_when_its_time_is_processed_again():
    each = list(scans(1))
    replay = vt.Replay(tracker(), 3.0)
    held, order = each.pop(20), each
    for scan in order[:22]:
        before = replay.step(scan)
    after = replay.step(held)
    known = before.status == vt.Status.CONFIRMED
    assert known.sum() >= 3
    for track, xy in zip(before.id[known], before.xy[known], strict=True):
        assert np.linalg.norm(after.xy[after.id == track] - xy) < 3.0


def test_what_is_too_late_and_methods_that_wait_are_refused():
    replay = vt.Replay(tracker(), 1.0)
    for scan in scans(0, count=5):
        replay.step(scan)
    with pytest.raises(vt.ScanError, match="2 s late, more than the window of 1 s"):
        replay.step(vt.Scan(0.0, np.empty((0, 2)), np.eye(2)))
    with pytest.raises(vt.ConfigError, match="mht"):
        vt.Replay(vt.Tracker(associate=vt.MHT()), 1.0)
    with pytest.raises(vt.ConfigError, match="negative"):
        vt.Replay(tracker(), -1.0)
    with pytest.raises(vt.ScanError, match="station 2, but the tracker has 2"):
        tracker().step(vt.Scan(0.0, np.empty((0, 2)), np.eye(2), station=2))
