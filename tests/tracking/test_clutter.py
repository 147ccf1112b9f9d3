"""The density of false measurements by place, and states that hold what every station has learnt."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import vidtrack as vt
from vidtrack.errors import FormatError
from vidtrack.state import gather, restore
from vidtrack.tracking.clutter import ClutterMap, EvenBox
from vidtrack.tracking.rates import Rates

SIDE = 3200.0


def new_map():
    return ClutterMap(np.zeros(2), np.full(2, SIDE))


def scans(count, seed=0, patch=20, false=5, station=0):
    """Scans of clutter alone, with a patch of more in a corner."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        even, more = rng.uniform(0, SIDE, (rng.poisson(false), 2)), rng.uniform(0, SIDE / 4, (rng.poisson(patch), 2))
        yield vt.Scan(float(k), np.vstack([even, more]), 25.0 * np.eye(2), station=station)


def tracker(stations=1):
    rates = [Rates(0.9, None, SIDE**2, new_map()) for _ in range(stations)]
    return vt.Tracker(
        vt.ConstantVelocity(accel=1.0, speed=5.0),
        gate=vt.LikelihoodGate(detection_probability=None, new_density=None),
        life=vt.LogRatio(),
        picture=vt.NoPicture(),
        stations=[vt.Station(one) for one in rates],
    )


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 300))
def test_the_mean_density_is_one_whatever_was_seen(seed, count):
    learnt, rng = new_map(), np.random.default_rng(seed)
    learnt.learn(rng.uniform(-SIDE, 2 * SIDE, (count, 2)), rng.random(count))
    assert learnt.density.mean() == pytest.approx(1.0)
    assert learnt.density.min() > 0


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(10, 50))
def test_the_box_grows_to_what_is_outside_and_keeps_what_was_counted(seed, count):
    learnt, rng = new_map(), np.random.default_rng(seed)
    learnt.learn(rng.uniform(0, SIDE, (100, 2)), np.ones(100))
    z = rng.uniform(-SIDE, 2 * SIDE, (count, 2))
    for _ in range(60):
        before = learnt.grown
        learnt.reach(z)
        assert learnt.grown <= 1.2**2 * before * (1 + 1e-12)  # a tenth at each of four sides
    beyond = (z < learnt.low) | (learnt.high < z)
    assert beyond.mean(axis=0).max() <= 0.02
    assert learnt.grown == pytest.approx((learnt.high - learnt.low).prod() / SIDE**2)
    assert learnt.count.sum() == pytest.approx(100)


@pytest.mark.parametrize("where", [new_map, lambda: EvenBox(np.zeros(2), np.full(2, SIDE))])
def test_wild_measurements_do_not_change_the_density(where):
    box, rng = where(), np.random.default_rng(0)
    for k in range(300):
        z = rng.uniform(0, SIDE, (20, 2))
        if k % 10 == 0:  # one in two hundred
            z[0] = 1e7, -1e7
        box.reach(z)
        box.forget(np.exp(-4 / 300))
    assert box.grown == 1.0


@given(far=st.floats(1.01 * SIDE, 1e7), times=st.integers(1, 30))
def test_a_measurement_changes_the_mean_density_by_a_tenth_along_each_axis_at_most(far, times):
    box = EvenBox(np.zeros(2), np.full(2, SIDE))
    for _ in range(times):
        before = box.grown
        box.reach(np.array([[far, -far]]))
        assert before <= box.grown <= 1.1**2 * before * (1 + 1e-12)


def test_a_patch_stays_at_its_place_when_the_box_grows():
    learnt = new_map()
    learnt.learn(np.random.default_rng(0).uniform(0, SIDE / 4, (5000, 2)), np.ones(5000))
    for _ in range(60):
        learnt.reach(np.array([[2.5 * SIDE, -SIDE]]))
    inside, outside = np.array([[0.125, 0.125]]) * SIDE, np.array([[0.6, 0.6], [2.0, -0.5]]) * SIDE
    assert learnt.at(inside)[0] > 20 * learnt.at(outside).max()


@pytest.mark.parametrize("where", [new_map, lambda: EvenBox(np.zeros(2), np.full(2, SIDE))])
def test_the_density_of_a_feed_is_right_when_its_first_scans_were_of_a_corner(where):
    own, rng = Rates(0.9, None, SIDE**2, where()), np.random.default_rng(0)
    for k in range(200):
        z = rng.uniform(0, SIDE if k < 3 else 4 * SIDE, (16, 2))
        own.look(vt.Scan(float(k), z, 25.0 * np.eye(2)))
        own.false, own.scans = own.false + 16, own.scans + 1
    assert own.clutter_density == pytest.approx(1 / SIDE**2, rel=0.25)


def polar_clutter(count, middle, width, nearest=2e3, farthest=6e4, seed=0):
    """Ranges, and azimuths in -pi..pi of a sector."""
    rng = np.random.default_rng(seed)
    azimuth = middle + width * (rng.random(count) - 0.5)
    return np.column_stack([rng.uniform(nearest, farthest, count), (azimuth + np.pi) % (2 * np.pi) - np.pi])


@pytest.mark.parametrize("middle", [0.0, np.pi / 2, np.pi, -np.pi])
def test_the_density_in_a_sector_is_the_same_wherever_it_looks(middle):
    width, z = np.pi / 2, polar_clutter(20_000, middle, np.pi / 2)
    box = np.array([2e3, middle - width / 2]), np.array([6e4, middle + width / 2])
    learnt = ClutterMap(*box, polar=True)
    learnt.reach(z)
    learnt.learn(z, np.ones(len(z)))
    assert learnt.grown == 1.0
    assert learnt.at(z).mean() == pytest.approx(1.0, abs=0.1)
    half = (z[:, 1] - middle + np.pi) % (2 * np.pi) - np.pi < 0
    learnt.learn(z[half], np.full(half.sum(), 3.0))
    assert learnt.at(z[half]).mean() > 2 * learnt.at(z[~half]).mean()


@pytest.mark.parametrize("middle", [0.0, np.pi])
def test_a_polar_box_grows_to_a_full_turn_and_to_no_range_below_zero(middle):
    box = EvenBox(np.array([500.0, middle - 0.5]), np.array([3000.0, middle + 0.5]), polar=True)
    z = polar_clutter(200, middle, 2 * np.pi, nearest=0.0, farthest=4000.0)
    for _ in range(100):
        box.reach(z)
    assert box.low[0] == 0.0
    assert 0.98 * 2 * np.pi < box.high[1] - box.low[1] <= 2 * np.pi * (1 + 1e-12)
    assert box.grown == pytest.approx((box.high - box.low).prod() / 2500)


def test_it_is_even_where_nothing_is_known():
    np.testing.assert_array_equal(new_map().density, np.ones((32, 32)))


def test_many_measurements_tell_the_density():
    many = new_map()
    for scan in scans(300):
        many.learn(scan.z, np.ones(len(scan)))
    share = 25 / (20 / (1 / 16) + 5)  # of the whole's mean density in the patch: (20 x 16 + 5) / 25
    inside = many.at(np.random.default_rng(1).uniform(50, SIDE / 4 - 50, (200, 2)))
    outside = many.at(np.random.default_rng(1).uniform(SIDE / 2, SIDE, (200, 2)))
    assert inside.mean() == pytest.approx(1 / share, rel=0.1)
    assert outside.mean() == pytest.approx((5 / 25 + 0.1) / 1.1, rel=0.25)


def test_a_tracker_expects_more_clutter_where_it_is():
    own = tracker()
    for scan in scans(60):
        own.step(scan)
    _, density = own.rates.of(np.zeros(2, int), np.array([[300.0, 300.0], [2900.0, 2900.0]]))
    assert density[0] == pytest.approx((20 * 16 + 5) / SIDE**2, rel=0.3)
    assert density[1] == pytest.approx(5 / SIDE**2, rel=0.5)


def test_a_saved_state_holds_the_rates_and_maps_of_all_stations():
    first, second = (list(scans(20, seed, station=seed)) for seed in (0, 1))
    both = sorted([*first, *second], key=lambda scan: scan.t)
    stopped, resumed = tracker(2), tracker(2)
    for scan in both[:20]:
        stopped.step(scan)
    restore(resumed, gather(stopped))
    for scan in both[20:]:
        a, b = stopped.step(scan), resumed.step(scan)
        np.testing.assert_array_equal(a.x, b.x)
        np.testing.assert_array_equal(a.existence, b.existence)
    for one, other in zip(stopped.stations.each, resumed.stations.each, strict=True):
        assert one.rates.as_dict() == other.rates.as_dict()
        np.testing.assert_array_equal(one.rates.where.density, other.rates.where.density)
    with pytest.raises(FormatError, match="other settings or another version"):
        restore(tracker(1), gather(stopped))
