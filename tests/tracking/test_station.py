"""Several stations: each has its own coverage, and its own estimates of P_D and clutter."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm

import vidtrack as vt
from vidtrack.decision import Decision
from vidtrack.estimate.fixed_gain import FixedGainBank
from vidtrack.estimate.sensor import VELOCITY
from vidtrack.radar.network.coverage import Sector, too_slow
from vidtrack.tracking.log_ratio import LogRatio
from vidtrack.tracking.register import Register
from vidtrack.tracking.station import Sight, Stations, Visibility


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
    np.testing.assert_array_equal(sector.share(xy), [1, 1, 0, 0, 0])


def test_visibility_is_the_filter_of_a_hidden_state():
    visibility = Visibility(visible_s=10.0, hidden_s=3.0)
    rate = np.array([[-1 / 10, 1 / 10], [1 / 3, -1 / 3]])  # from visible, from hidden
    expected = np.array([0.4, 0.6]) @ expm(0.7 * rate)
    assert visibility.predicted(np.array([0.4]), 0.7)[0] == pytest.approx(expected[0])
    assert visibility.predicted(np.array([0.0]), 1e6)[0] == pytest.approx(10 / 13)


def test_a_target_that_one_of_two_stations_cannot_see_is_kept():
    def confirmed_at_the_end(visibility):
        stations = [vt.Station(vt.Rates(0.9, 1e-6), visibility=visibility) for _ in range(2)]
        tracker = vt.Tracker(picture=vt.NoPicture(), life=vt.LogRatio(coast_s=30.0, coast_scans=60), stations=stations)
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


def covered(rows=1):
    return np.ones(rows)


def test_a_track_that_no_station_may_see_ends_by_time_and_not_by_scans():
    """It drove on for ever, because nobody missed it; scans of a radar that is far away do not count."""

    def alive(coast_s, step_s):
        stations = [vt.Station(vt.Rates(0.9, 1e-6), Sector((0.0, 0.0), 100.0))]
        life = vt.LogRatio(missed_track=1e-5, coast_s=coast_s, coast_scans=5)
        tracker = vt.Tracker(vt.ConstantVelocity(speed=20.0), picture=vt.NoPicture(), life=life, stations=stations)
        for k in range(10):
            tracker.step(vt.Scan(0.5 * k, np.array([[50.0 + 5 * k, 0.0]]), np.eye(2)))
        return [len(tracker.step(vt.Scan(t, np.empty((0, 2)), np.eye(2)))) for t in 4.5 + np.arange(step_s, 8, step_s)]

    assert sum(alive(3.0, 0.1)) == pytest.approx(30, abs=1)
    assert sum(alive(3.0, 0.5)) == pytest.approx(6, abs=1)


def stopping(coast_s=30.0, associate=None, blind=True, leaves_s=np.inf, until_s=12.0, camera=False):
    """Tracks of a vehicle that brakes before a radar whose Doppler filter does not pass less than 1 m/s."""
    zone = too_slow((0.0, 0.0), 1.0) if blind else None
    stations = [vt.Station(vt.Rates(0.9, 1e-6), Sector((0.0, 0.0), 200.0), blind=zone)]
    if camera:
        stations.append(vt.Station(vt.Rates(0.9, 1e-6), visibility=Visibility(10.0, 3.0)))
    model = vt.ConstantVelocity(accel=2.0, speed=20.0, hold_s=2.0)
    life = vt.LogRatio(coast_s=coast_s, coast_scans=20)
    tracker = vt.Tracker(model, associate, picture=vt.NoPicture(), life=life, stations=stations)
    sensor = vt.PositionRangeRate((0.0, 0.0))
    for k in range(round(10 * until_s)):
        t = 0.1 * k
        speed = max(0.0, 10 - 2.0 * t)
        x = 60.0 + 10 * min(t, 5.0) - min(t, 5.0) ** 2
        z = np.array([[x, 5.0, speed * x / np.hypot(x, 5.0)]])[: int(speed > 1 and t < leaves_s)]
        tracks = tracker.step(vt.Scan(t, z, np.diag([0.2, 0.2, 0.05]), sensor))
        if camera:
            tracks = tracker.step(vt.Scan(t, np.empty((0, 2)), np.eye(2), station=1))
    return tracks


def test_a_vehicle_that_stops_before_a_doppler_radar_is_where_it_stopped():
    """Without what the misses tell its track drove on at the speed of its last plot, and ended."""

    def error_m(blind):
        return float(np.hypot(*(stopping(blind=blind).xy - [85.0, 5.0]).T).min(initial=np.inf))

    assert error_m(blind=True) < 1.0
    assert error_m(blind=False) > 4.0


@pytest.mark.parametrize("rule", [vt.GNN, vt.JPDA, vt.MHT])
def test_a_vehicle_that_stands_unseen_is_kept_for_a_bounded_time(rule):
    last_s = 4.5  # of its last plot
    assert len(stopping(10.0, rule(), until_s=last_s + 9.5)) == 1
    assert len(stopping(10.0, rule(), until_s=last_s + 10.5)) == 0


def test_a_camera_that_does_not_see_what_stands_in_the_dark_does_not_end_its_track():
    """Scans of a station count for confirmed tracks only where it rather sees them."""
    assert len(stopping(coast_s=30.0, until_s=12.0, camera=True)) == 1


def test_a_vehicle_that_is_gone_while_it_drives_is_missed_and_not_taken_to_stand():
    assert len(stopping(coast_s=30.0, leaves_s=2.0, until_s=5.0)) == 0


def test_a_station_looks_at_tracks_as_they_were_predicted_and_not_as_its_miss_has_slowed_them():
    station = vt.Station(vt.Rates(0.9, 1e-6), blind=too_slow((0.0, 0.0), 1.0))
    tracker = vt.Tracker(life=vt.LogRatio(coast_s=5.0), picture=vt.NoPicture(), stations=[station])
    tracker.add(0.0, np.array([[30.0, 1.05, 0.0, 0.0]]), np.diag([1.0, 1.0, 1e-9, 1e-9])[None])
    scan = vt.Scan(0.0, np.empty((0, 2)), np.eye(2))
    assert tracker.stations.sight(scan, tracker.bank).share[0] > 0.5
    assert tracker.step(scan).status.tolist() == [vt.Status.COASTING]
    assert tracker.stations.sight(scan, tracker.bank).share[0] < 0.5


def test_a_miss_counts_by_its_probability_where_the_station_covers_and_sees_a_row_that_is_alone():
    zone = too_slow((0.0, 0.0), 1.0)
    stations = Stations([vt.Station(vt.Rates(0.8, 1e-6), Sector((0.0, 0.0), 100.0), Visibility(1.0, 1.0), blind=zone)])
    filters, register = vt.KalmanBank(vt.ConstantVelocity()), Register(2)
    x = np.array([[30.0, 0.8, 0.0, 0.0]] * 4 + [[130.0, 0.8, 0.0, 0.0]])
    filters.insert(x, np.tile(np.eye(4), (5, 1, 1)), np.ones(5))
    register.append(0.0, x[:, [0, 2]], np.full((5, 4), np.nan), 0.0, np.zeros(5, np.int64))
    register.visible[:, 0] = [1.0, 1.0, 0.5, 1.0, 1.0]
    beta0, shared = np.array([1.0, 0.3, 1.0, 1.0, 1.0]), np.array([-1, -1, -1, 0, -1])
    found = SimpleNamespace(shared=shared, decision=SimpleNamespace(beta0=beta0))
    scan = vt.Scan(0.0, np.empty((0, 2)), np.eye(2))
    there = np.array([0.8, 0.8, 0.4]) * zone.stands(filters)[:3]
    stations.miss(scan, found, stations.sight(scan, filters), register, filters, 0.0)
    beta = beta0[:3] * there / (there + 1 - [0.8, 0.8, 0.4])
    np.testing.assert_allclose(filters.x[:, 1], [*0.8 * (1 - beta / (1 + zone.sigma**2)), 0.8, 0.8])


@pytest.mark.parametrize(("inside", "missed"), [(0, {1: [0, 1], 2: [0]}), (1, {1: [0], 2: [1]})])
def test_what_a_station_sees_of_a_track_holds_for_its_hypotheses(inside, missed):
    """The first track has two where the station sees it, hit and missed; what is outside is not missed."""
    station = vt.Station(vt.Rates(0.9, 1e-3), Sector((100.0 * inside, 0.0), 50.0))
    life = vt.LogRatio(coast_s=5.0)
    tracker = vt.Tracker(vt.ConstantVelocity(), vt.MHT(), picture=vt.NoPicture(), life=life, stations=[station])
    tracker.add(0.0, np.array([[0.0, 1.0, 0.0, 0.0], [100.0, 1.0, 0.0, 0.0]]), np.tile(np.eye(4), (2, 1, 1)))
    tracker.step(vt.Scan(0.1, np.array([[1.5, 1.5]]), np.eye(2)))
    register = tracker.register
    assert {track: sorted(register.missed[register.id == track, 0].tolist()) for track in missed} == missed


def test_tentative_tracks_are_missed_by_a_station_that_rather_does_not_see_them():
    stations = Stations([vt.Station(visibility=Visibility(1.0, 9.0))])
    register = Register(2)
    register.append(0.0, np.zeros((2, 2)), np.full((2, 4), np.nan), 0.0, np.zeros(2, np.int64))
    register.visible[:] = 0.1
    register.status[1] = vt.Status.CONFIRMED
    none = np.zeros(2, bool)
    sight = Sight(covered(2), np.zeros(2))
    looked = stations.record(
        vt.Scan(0.0, np.empty((0, 2)), np.eye(2)), register, sight, none, none, np.full(2, 0.09), 0.1
    )
    assert looked.tolist() == [True, False]


def test_the_p_d_of_an_association_is_that_of_the_update_after_a_miss():
    zone = too_slow((0.0, 0.0), 1.0)
    stations = Stations([vt.Station(vt.Rates(0.8, 1e-6), Sector((0.0, 0.0), 100.0), blind=zone)])
    bank, register = vt.KalmanBank(vt.ConstantVelocity()), Register(2)
    x = np.array([[30.0, v, 0.0, 0.0] for v in (0.0, 1.0, 3.0)] + [[130.0, 3.0, 0.0, 0.0]])
    bank.insert(x, np.tile(np.eye(4), (4, 1, 1)), np.ones(4))
    register.append(0.0, x[:, [0, 2]], np.full((4, 4), np.nan), 0.0, np.zeros(4, np.int64))
    scan = vt.Scan(0.0, np.empty((0, 2)), np.eye(2))
    sight = stations.sight(scan, bank)
    detection, _ = stations.expected(scan, x[:, [0, 2]], register, sight, 0.1)
    np.testing.assert_allclose(detection[:3], 0.8 * (1 - zone.hidden(bank)[:3]))
    np.testing.assert_allclose(detection, [0.8 * 0.02, 0.8 * 0.51, 0.8, 0.0], rtol=0.01)


@pytest.mark.parametrize("bank", [vt.KalmanBank, vt.UnscentedBank])
@pytest.mark.parametrize("beta0", [1.0, 0.3])
def test_a_miss_of_what_may_stand_is_a_mixture_by_the_probability_of_a_miss(bank, beta0):
    filters = bank(vt.ConstantVelocity())
    filters.insert(np.array([[30.0, 1.5, 0.0, 0.0]]), np.diag([1.0, 1.0, 1e-9, 1e-9])[None], np.ones(1))
    zone = too_slow((0.0, 0.0), 1.0)
    there = 0.8 * zone.stands(filters)
    zone.update(filters, 0.0, np.array([beta0]), np.array([0.8]))
    beta = beta0 * there[0] / (there[0] + 0.2)
    gain = 1 / (1 + zone.sigma**2)
    slowed = 1.5 * (1 - gain)
    mean = beta * slowed + (1 - beta) * 1.5
    variance = beta * (1 - gain + slowed**2) + (1 - beta) * (1 + 1.5**2) - mean**2
    assert filters.x[0, 1] == pytest.approx(mean, rel=1e-3)
    assert filters.P[0, 1, 1] == pytest.approx(variance, rel=1e-3)


def test_how_probably_a_row_stands_is_expected_over_its_range_rate_and_by_how_its_cross_speed_fits():
    filters = vt.KalmanBank(vt.ConstantVelocity())
    P = np.diag([1e-9, 1.0, 1e-9, 2.0])
    filters.insert(np.array([[30.0, 0.5, 0.0, -0.8]]), P[None], np.ones(1))
    zone = too_slow((0.0, 0.0), 1.0)
    v = np.linspace(-10, 10, 20001)
    missed = np.average(np.exp(-(v**2) / (2 * zone.sigma**2)), weights=np.exp(-((v - 0.5) ** 2) / 2))
    expected = 0.98 * missed * np.exp(-(0.8**2) / (2 * (2 + zone.sigma**2)))
    assert zone.stands(filters)[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("bank", [vt.KalmanBank, vt.UnscentedBank])
def test_a_miss_of_one_that_may_stand_is_bayes_rule(bank):
    """One that moves only along the line of sight, whose P_D is for v = 0 next to nothing."""
    filters = bank(vt.ConstantVelocity())
    filters.insert(np.array([[30.0, 1.0, 0.0, 0.0]]), np.diag([1.0, 0.01, 1e-9, 1e-9])[None], np.ones(1))
    zone = too_slow((0.0, 0.0), 1.0)
    zone.update(filters, 0.0, np.ones(1), np.array([0.8]))
    v = np.linspace(0, 2, 20001)
    weight = np.exp(-((v - 1) ** 2) / 0.02) * (1 - 0.8 * (1 - 0.98 * 2.0 ** -(v**2)))
    assert filters.x[0, 1] - 1 == pytest.approx(np.average(v, weights=weight) - 1, rel=0.02)


def test_a_miss_does_not_stop_what_is_known_to_move_across_the_line_of_sight():
    filters = vt.KalmanBank(vt.ConstantVelocity())
    filters.insert(np.array([[30.0, 0.0, 0.0, 10.0]]), 0.25 * np.eye(4)[None], np.ones(1))
    zone = too_slow((0.0, 0.0), 1.0)
    assert zone.hidden(filters)[0] == pytest.approx(0.98)
    zone.update(filters, 0.0, np.ones(1), np.array([0.9]))
    np.testing.assert_allclose(filters.x, [[30.0, 0.0, 0.0, 10.0]])


def test_where_a_vehicle_stands_stays_known_in_all_directions_while_nobody_sees_it():
    """Told of its range rate only, its place became uncertain across the line of sight, by 14 m in 4 s."""
    tracks = stopping(until_s=10.0)  # 5.5 s after its last plot
    error = tracks.xy[0] - [85.0, 5.0]
    P = tracks.P[0][np.ix_([0, 2], [0, 2])]
    assert np.sqrt(np.trace(P)) < 5
    assert error @ np.linalg.solve(P, error) < 9.2  # chi-square of 2, .99


@pytest.mark.parametrize("doppler", [True, False])
def test_a_fast_target_seen_once_and_then_missed_is_one_track(doppler):
    """Its velocity is not known, so misses do not tell that it stands; else its next plot began another track."""
    station = vt.Station(vt.Rates(0.6, 1e-5), Sector((0.0, 0.0), 200.0), blind=too_slow((0.0, 0.0), 0.7))
    tracker = vt.Tracker(
        vt.ConstantVelocity(accel=2.0, speed=20.0, hold_s=2.0), picture=vt.NoPicture(),
        life=vt.LogRatio(coast_s=10.0, coast_scans=40), stations=[station],
    )  # fmt: skip
    sensor, R = (vt.PositionRangeRate((0.0, 0.0)), np.diag([0.16, 0.16, 0.02])) if doppler else (None, 0.16 * np.eye(2))
    for k in range(20):
        x = 10 + 2.5 * k
        z = np.array([[x, 5.0, 25.0 * x / np.hypot(x, 5.0)]])[: int(k == 0 or k > 3), : len(R)]
        tracks = tracker.step(vt.Scan(0.1 * k, z, R, sensor))
    assert tracks.id.tolist() == [1]


def test_p_d_of_one_is_no_nan_and_a_miss_is_no_hit():
    filters = vt.KalmanBank(vt.ConstantVelocity())
    x = np.array([[30.0, v, 0.0, 0.0] for v in (0.0, 3.0, 300.0)])
    filters.insert(x, np.tile(np.eye(4), (3, 1, 1)), np.ones(3))
    zone = too_slow((0.0, 0.0), 1.0)
    zone.update(filters, 0.0, np.ones(3), np.ones(3))
    assert np.isfinite(filters.x).all()
    assert np.isfinite(filters.P).all()
    assert filters.x[1, 1] < 2
    np.testing.assert_array_equal(filters.x[2], x[2])
    np.testing.assert_array_equal(filters.hits, [1, 1, 1])


def test_what_a_radar_sees_or_is_far_too_fast_for_its_blind_zone_is_left_as_it_is():
    filters = vt.KalmanBank(vt.ConstantVelocity())
    filters.insert(np.array([[30.0, 15.0, 0.0, 0.0], [30.0, 0.1, 0.0, 0.0]]), np.tile(np.eye(4), (2, 1, 1)), np.ones(2))
    before = filters.x.copy(), filters.P.copy()
    zone = too_slow((0.0, 0.0), 1.0)
    zone.update(filters, 0.0, np.array([1.0, 0.0]), np.full(2, 0.9))
    np.testing.assert_array_equal(filters.x, before[0])
    np.testing.assert_array_equal(filters.P, before[1])


def test_what_misses_tell_lasts():
    def vx(since):
        filters = vt.KalmanBank(vt.ConstantVelocity())
        filters.insert(np.array([[30.0, 0.8, 0.0, 0.0]]), np.eye(4)[None], np.ones(1))
        zone = too_slow((0.0, 0.0), 1.0)
        zone.update(filters, 0.0, np.ones(1), np.full(1, 0.9), since)
        return filters.x[0, 1]

    assert 0.8 - vx(0.1) < (0.8 - vx(1.0)) / 2


def test_a_radar_that_detects_all_speeds_has_no_blind_zone():
    assert too_slow((0.0, 0.0), 0.0) is None


def test_a_filter_of_fixed_gain_takes_positions_only():
    filters = FixedGainBank(vt.ConstantVelocity(), 1.0)
    filters.insert(np.array([[30.0, 0.5, 0.0, 0.0]]), np.eye(4)[None], np.ones(1))
    zone = too_slow((0.0, 0.0), 1.0)
    zone.update(filters, 0.0, np.ones(1), np.full(1, 0.9))
    np.testing.assert_array_equal(filters.x, [[30.0, 0.5, 0.0, 0.0]])
    none, beta0 = np.zeros(1, np.int64), np.array([0.0, 1])
    twice = Decision(np.zeros(2, np.int64), none, none, np.ones(1), beta0, shows=False)
    filters.update(twice, vt.Scan(0.0, np.zeros((1, 2)), np.eye(2), VELOCITY), VELOCITY)
    np.testing.assert_array_equal(filters.x, [[30.0, 0.5, 0.0, 0.0]] * 2)


@pytest.mark.parametrize(
    "station", [vt.Station(visibility=Visibility(1.0, 1.0)), vt.Station(blind=too_slow((0, 0), 1.0))]
)
@pytest.mark.parametrize("life", [vt.LifeCycle(), vt.LogRatio()])
def test_tracks_that_might_never_end_are_refused(station, life):
    with pytest.raises(vt.ConfigError, match="coast_s"):
        vt.Tracker(life=life, stations=[station])
    vt.Tracker(life=replace(life, coast_s=5.0), stations=[station])
