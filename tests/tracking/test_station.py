"""Several stations: each has its own coverage, and its own estimates of P_D and clutter."""

import numpy as np
import pytest
from scipy.linalg import expm

import vidtrack as vt
from vidtrack.radar.network.coverage import Sector
from vidtrack.tracking.log_ratio import LogRatio
from vidtrack.tracking.station import Visibility


def scans(rng, detection, false, count, targets=15):
    """Scans of stations in turn, each with its detection probability and number of false measurements."""
    place, velocity = rng.uniform(300, 1700, (targets, 2)), rng.normal(0, 2, (targets, 2))
    for k in range(count):
        s = k % len(detection)
        seen = (place + 0.5 * k * velocity)[rng.random(targets) < detection[s]]
        clutter = rng.uniform(0, 2000, (rng.poisson(false[s]), 2))
        yield vt.Scan(0.5 * k, np.vstack([seen + rng.normal(size=seen.shape), clutter]), np.eye(2), station=s)


def test_each_station_learns_its_own_rates():
    stations = [vt.Station(vt.Rates(None, None, 4e6)) for _ in range(2)]
    tracker = vt.Tracker(vt.ConstantVelocity(accel=0.3, speed=5.0), picture=vt.NoPicture(), stations=stations)
    for scan in scans(np.random.default_rng(0), (0.9, 0.3), (5, 20), 200):
        tracker.step(scan)
    found = [station.rates for station in stations]
    assert [rates.detection_probability for rates in found] == pytest.approx([0.9, 0.3], abs=0.06)
    assert [rates.clutter_density * 4e6 for rates in found] == pytest.approx([5, 20], rel=0.3)


def test_a_track_outside_a_stations_coverage_is_not_missed_by_it():
    far = Sector((1e5, 1e5), 100.0)
    z = np.array([[10.0, 20.0]])

    def tracks(coverage):
        stations = [vt.Station(), vt.Station(coverage=coverage)]
        tracker = vt.Tracker(picture=vt.NoPicture(), stations=stations)
        for k in range(30):
            sees = k % 10 == 0
            tracks = tracker.step(vt.Scan(0.1 * k, z[: int(sees)], np.eye(2), station=int(not sees)))
        return tracks

    assert len(tracks(far)) == 1
    assert tracks(far).status[0] == vt.Status.CONFIRMED
    assert len(tracks(vt.Station().coverage)) == 0


def test_a_sector_covers_its_range_and_its_angles():
    sector = Sector((10.0, 0.0), 100.0, middle=np.pi / 2, width=np.pi / 2)
    xy = np.array([[60.0, 0.0], [60.0, 45.0], [60.0, 60.0], [120.0, 0.0], [-40.0, 0.0]])
    np.testing.assert_array_equal(sector.share(xy, 0 * xy), [1, 1, 0, 0, 0])
    slow = Sector((0.0, 0.0), 100.0, slowest=1.0).share(
        np.tile([10.0, 0.0], (3, 1)), np.array([[3, 0], [0, 3], [1.5, 0]])
    )
    np.testing.assert_allclose(slow, [1, 0.02, 0.5])


def test_visibility_is_the_filter_of_a_hidden_state():
    visibility = Visibility(visible_s=10.0, hidden_s=3.0)
    rate = np.array([[-1 / 10, 1 / 10], [1 / 3, -1 / 3]])  # from visible, from hidden
    expected = np.array([0.4, 0.6]) @ expm(0.7 * rate)
    assert visibility.predicted(np.array([0.4]), 0.7)[0] == pytest.approx(expected[0])
    assert visibility.predicted(np.array([0.0]), 1e6)[0] == pytest.approx(10 / 13)


def test_a_target_that_one_of_two_stations_cannot_see_is_kept():
    def confirmed_at_the_end(visibility):
        stations = [vt.Station(vt.Rates(0.9, 1e-6), visibility=visibility) for _ in range(2)]
        tracker = vt.Tracker(picture=vt.NoPicture(), life=vt.LogRatio(coast_scans=60), stations=stations)
        rng = np.random.default_rng(1)
        for k in range(400):
            dark = k > 100 and k % 12  # station 1, much faster than the other, sees nothing after 10 s
            z = np.array([[10.0 + 0.1 * k, 20.0]]) + rng.normal(size=(1, 2))
            tracks = tracker.step(vt.Scan(0.1 * k, z[: int(not dark)], np.eye(2), station=int(k % 12 > 0)))
        return tracks.id[tracks.status != vt.Status.TENTATIVE].tolist()

    assert confirmed_at_the_end(Visibility(10.0, 3.0)) == [1]
    assert confirmed_at_the_end(None) == []


def test_what_stands_and_only_looks_like_a_target_is_not_confirmed_by_a_station_that_errs_for_long():
    camera = vt.Station(vt.Rates(0.9, 1e-3, 4e6), lasting_s=1.0, lasting_m=5.0)

    def status(speed):
        tracker = vt.Tracker(
            vt.ConstantVelocity(accel=1.0, speed=10.0), life=LogRatio(1e-2, 1e-2), picture=vt.NoPicture(),
            stations=[camera],
        )  # fmt: skip
        for k in range(100):
            tracks = tracker.step(vt.Scan(0.1 * k, np.array([[0.1 * speed * k, 0.0]]), 0.2 * np.eye(2)))
        return tracks.status.tolist()

    assert status(speed=10.0) == [vt.Status.CONFIRMED]
    assert vt.Status.CONFIRMED not in status(speed=0.0)


@pytest.mark.parametrize(("lasting_s", "lasting_m"), [(0.0, 5.0), (-1.0, 0.0), (1.0, np.nan)])
def test_lasting_errors_that_have_no_effect_or_no_sense_are_refused(lasting_s, lasting_m):
    with pytest.raises(vt.ConfigError, match="lasting_m"):
        vt.Station(lasting_s=lasting_s, lasting_m=lasting_m)
