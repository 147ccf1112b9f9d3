"""What a picture adds to a tracker, and that points do without it."""

import numpy as np
import pytest
from scipy.special import logit

import vidtrack as vt
from vidtrack.tracking.picture.road import Road
from vidtrack.tracks import TENTATIVE

SIZE = (320.0, 240.0)


def driving(k, size=20.0):
    """A box that goes right at 100 px/s and crosses the right border of the picture after 1.2 s."""
    return vt.box_scan(k / 10, [[180.0 + 10 * k, 100.0, size, size]])


def played(picture, scans):
    tracker = vt.Tracker(vt.ConstantVelocity(accel=5.0, speed=200.0), picture=picture)
    return [tracker.step(scan) for scan in scans]


@pytest.mark.parametrize("box_s", [0.0, -1.0, np.nan])
def test_a_time_constant_that_is_none_is_refused(box_s):
    with pytest.raises(vt.ConfigError, match="box_s"):
        vt.Picture(SIZE, box_s=box_s)


def test_a_track_ends_where_the_picture_does():
    empty = [vt.box_scan(1.3 + k / 10, []) for k in range(4)]
    scans = [driving(k) for k in range(13)] + empty
    within, without = played(vt.Picture(SIZE), scans)[-1], played(vt.Picture(), scans)[-1]
    assert len(within) == 0
    assert len(without) == 1
    told = [event.reason for tracks in played(vt.Picture(SIZE), scans) for event in tracks.events]
    assert told.count("left the picture") == 1


def test_a_miss_tells_less_of_a_track_that_may_be_outside_the_picture():
    """A miss multiplies the odds of existence by 1 - P_D s, where s is the probability to be in the picture."""
    scans = [driving(k + 0.9) for k in range(12)] + [vt.box_scan(1.29, [])]  # at 319 px of 320 when it is missed

    def loss(picture):
        before, after = (logit(tracks.existence[0]) for tracks in played(picture, scans)[-2:])
        return before - after

    assert 0 < loss(vt.Picture(SIZE)) < 0.9 * loss(vt.Picture())


def test_the_clutter_is_counted_over_the_picture():
    tracker = vt.Tracker(picture=vt.Picture(SIZE), clutter_density=None)
    assert tracker.rates.clutter_density == 1 / (SIZE[0] * SIZE[1])
    assert vt.Tracker(picture=vt.Picture(SIZE), clutter_density=None, surveyed=10.0).rates.clutter_density == 0.1


def test_points_are_tracked_alike_with_a_picture_without_bounds_and_without_a_picture():
    rng = np.random.default_rng(4)
    scans = [vt.Scan(float(k), rng.uniform(0, 200, (rng.integers(0, 8), 2)), 4 * np.eye(2)) for k in range(30)]
    for one, other in zip(played(vt.Picture(), scans), played(vt.NoPicture(), scans), strict=True):
        np.testing.assert_array_equal(one.id, other.id)
        np.testing.assert_array_equal(one.status, other.status)
        np.testing.assert_array_equal(one.x, other.x)
        assert one.events == other.events


@pytest.mark.parametrize(("careful", "taken"), [(True, False), (False, True)])
def test_no_flake_is_a_measurement_of_a_vehicle(careful, taken):
    """Flakes of 8 px fall everywhere; where the vehicle of 20 px is missed, one lies in its place."""
    rng = np.random.default_rng(3)
    picture = vt.Picture(SIZE, road=Road(*SIZE, careful=careful))

    def scan(k, box):
        flakes = [[*rng.uniform((0, 140), SIZE), 8.0, 6.0] for _ in range(20)]
        return vt.box_scan(k / 10, [box, *flakes])

    driven = [scan(k, [20.0 + 5 * k, 100.0, 20.0, 20.0]) for k in range(40)]
    tracks = played(picture, [*driven, scan(40, [226.0, 106.0, 8.0, 8.0])])
    vehicle = np.flatnonzero(tracks[-1].id == tracks[0].id[0])
    assert bool(tracks[-1].measurement[vehicle][0] == 0) == taken


@pytest.mark.parametrize("life", [vt.LifeCycle(confirm_travel=0.0), vt.LogRatio(confirm_travel=0.0)])
@pytest.mark.filterwarnings("error")
def test_no_flake_is_confirmed_where_no_travel_is_asked_for(life):
    rng = np.random.default_rng(3)
    tracker = vt.Tracker(picture=vt.Picture(SIZE, road=Road(*SIZE)), life=life)
    for k in range(100):
        flakes = [[*rng.uniform((0, 0), SIZE), 8.0, 6.0] for _ in range(20)]
        again = [[10.0 + k, 5.0, 8.0, 8.0]] if k > 50 else []  # from when the swarm is known, one is seen all the time
        tracks = tracker.step(vt.box_scan(k / 10, [*flakes, *again]))
        seen = tracks.status[tracks.measurement == len(flakes)]
    assert seen.tolist() == [TENTATIVE]


def test_a_box_follows_with_its_time_constant():
    """A box of 20 px that becomes one of 40 px has gone 1 - exp(-dt / box_s) of the way after a scan."""
    scans = [
        vt.box_scan(k / 10, [[100.0 - size / 2, 100.0 - size / 2, size, size]]) for k, size in enumerate([20] * 20)
    ]
    scans.append(vt.box_scan(2.0, [[80.0, 80.0, 40.0, 40.0]]))
    for box_s in (0.2, 0.5):
        width = played(vt.Picture(SIZE, box_s=box_s), scans)[-1].box[0, 2]
        assert width == pytest.approx(20 + 20 * -np.expm1(-0.1 / box_s))
