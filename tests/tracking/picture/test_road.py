"""What traffic teaches about a scene: the size of vehicles, and restless places."""

import numpy as np
import pytest
from drawn_tracks import drive, tracks_of
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.state import gather, restore
from vidtrack.tracking.picture.restless import RestlessMap
from vidtrack.tracking.picture.road import Road
from vidtrack.tracking.picture.sizes import SizeField
from vidtrack.tracking.picture.swarm import Swarm
from vidtrack.tracks import CONFIRMED, TENTATIVE

WIDTH, HEIGHT = 320, 240


def perspective(bottom):
    return 10 + 0.2 * bottom, 0.6 * (10 + 0.2 * bottom)


def seen_as(rng, size, fragments=0.3):
    """Sizes as a detector sees them: noisy, and often of a part only."""

    def measured(bottom):
        part = rng.uniform(0.3, 0.8, 2) if rng.random() < fragments else np.ones(2)
        return np.array(size(bottom)) * part * np.exp(0.08 * rng.normal(size=2))

    return measured


def at_bottom(x, y, size):
    return [x - size[0] / 2, y - size[1], *size]


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1))
def test_a_perspective_field_is_found_though_three_of_ten_samples_are_fragments(seed):
    road = Road(WIDTH, HEIGHT)
    drive(road.learn, seen_as(np.random.default_rng(seed), perspective), vehicles=12)
    for y in (80, 140, 200):
        typical = road.sizes.typical(np.array([at_bottom(160, y, (20, 10))]))[0]
        np.testing.assert_allclose(typical, perspective(y), rtol=0.2)


def test_nothing_is_typical_before_five_vehicles_drove():
    sizes = SizeField(WIDTH, HEIGHT)

    def learn(tracks):
        sizes.learn(tracks, np.ones(len(tracks), bool))

    drive(learn, perspective, vehicles=4)
    assert not sizes.known
    assert np.isnan(sizes.typical(np.array([[10.0, 10, 20, 10]]))).all()
    drive(learn, perspective, vehicles=1, first=4)
    assert sizes.known


@pytest.mark.parametrize("unlike", [{"travel": 5.0}, {"status": TENTATIVE}])
def test_what_has_not_driven_or_is_not_confirmed_teaches_no_size(unlike):
    sizes = SizeField(WIDTH, HEIGHT)
    for k in range(100):
        x = 10.0 * (k % 20)
        sizes.learn(tracks_of(k / 5, [[x, 100, 40, 20]], ids=[k // 20], **unlike), np.ones(1, bool))
    assert not sizes.known


def test_what_the_border_cuts_teaches_no_size():
    road = Road(WIDTH, HEIGHT)
    drive(road.learn, lambda y: (40.0, 20.0), vehicles=6, x=18.0)
    assert not road.sizes.known


def test_a_standing_vehicle_is_one_sample():
    sizes = SizeField(WIDTH, HEIGHT)
    noisy = seen_as(np.random.default_rng(1), perspective, fragments=0)
    drive(lambda tracks: sizes.learn(tracks, np.ones(len(tracks), bool)), noisy, vehicles=6)
    before = sizes.typical(np.array([at_bottom(160, 140, (20, 10))]))
    for k in range(500):
        sizes.learn(tracks_of(100 + k / 5, [at_bottom(160, 140, (90, 70))], ids=[99]), np.ones(1, bool))
    np.testing.assert_allclose(sizes.typical(np.array([at_bottom(160, 140, (20, 10))])), before, rtol=0.1)


def test_a_field_stays_while_vehicles_differ_too_much_for_another_one():
    road, box = Road(WIDTH, HEIGHT), np.array([at_bottom(160, 140, (20, 10))])
    drive(road.learn, perspective, vehicles=6)
    before = road.sizes.typical(box)
    rng = np.random.default_rng(1)
    drive(road.learn, lambda y: np.array(perspective(y)) * np.exp(rng.normal(0, 1.0, 2)), vehicles=20, first=6)
    np.testing.assert_allclose(road.sizes.typical(box), before, rtol=0.15)
    drive(road.learn, lambda y: 1.5 * np.array(perspective(y)), vehicles=20, first=26)
    np.testing.assert_allclose(road.sizes.typical(box), 1.5 * np.array([perspective(140)]), rtol=0.1)


def test_a_road_is_saved_and_restored():
    road, other = Road(WIDTH, HEIGHT), Road(WIDTH, HEIGHT)
    drive(road.learn, perspective, vehicles=7)
    restore(other, gather(road))
    box = np.array([[100.0, 100, 30, 20]])
    np.testing.assert_array_equal(other.sizes.typical(box), road.sizes.typical(box))
    for each in (road, other):
        drive(each.learn, lambda y: (50.0, 25.0), vehicles=2, first=7)
    np.testing.assert_array_equal(other.sizes.typical(box), road.sizes.typical(box))
    np.testing.assert_array_equal(other.restless.starts, road.restless.starts)
    np.testing.assert_array_equal(other.swarm.births, road.swarm.births)


PLACE = np.array([[55.0, 45.0]])
SIDE = np.array([30.0])
LEAF = [50.0, 40.0, 10.0, 10.0]


def flutter(learn, times, box=LEAF, travel=1.0, known=()):
    """Tracks that begin and end at one place, beside known vehicles."""
    for k in range(times):
        boxes = [*known, box]
        status = np.array([1] * len(known) + [TENTATIVE])
        learn(tracks_of(0.2 * k, boxes, ids=[*range(1000, 1000 + len(known)), k], status=status, travel=travel))
        learn(tracks_of(0.2 * k + 0.1, known, ids=range(1000, 1000 + len(known))))


def test_false_starts_make_a_place_restless_until_they_are_forgotten():
    road = Road(WIDTH, HEIGHT)
    assert road.travel_factor(PLACE, SIDE).tolist() == [1.0]
    flutter(road.learn, 4)
    assert road.travel_factor(PLACE, SIDE).tolist() == [3.0]
    assert road.travel_factor(np.array([[300.0, 200.0], [-50.0, 900.0]]), SIDE.repeat(2)).tolist() == [1.0, 1.0]
    before = road.restless.starts.sum()
    road.learn(tracks_of(0.7 + 30.0))
    assert road.restless.starts.sum() == pytest.approx(before / np.e, rel=1e-9)
    assert not road.restless.restless(PLACE).any()


def test_tracks_that_travelled_or_are_part_of_a_vehicle_are_no_false_starts():
    restless = RestlessMap(WIDTH, HEIGHT)
    flutter(restless.learn, 10, travel=50.0)
    flutter(restless.learn, 10, known=[[40.0, 30.0, 60.0, 40.0]])
    assert not restless.starts.any()


def fall(learn, per_s, side, seconds=10.0, rate=10.0, first=0.0):
    """Flakes of one size that begin at `per_s`; each is seen once."""
    each = round(per_s / rate)
    for k in range(round(seconds * rate)):
        boxes = [[10.0 * i, 100.0, side, side / 2] for i in range(each)]
        learn(tracks_of(first + k / rate, boxes, status=TENTATIVE, age_s=0.0))


def test_what_is_as_small_as_a_swarm_is_no_vehicle_while_it_lasts():
    road = Road(WIDTH, HEIGHT)
    places = np.array([[200.0, 100.0]] * 3)
    sizes = np.array([6.0, 8.0, 30.0])
    fall(road.learn, 100, 8.0)
    fall(road.learn, 10, 4.0, first=10.0, seconds=1.0)
    assert road.travel_factor(places, sizes).tolist() == [np.inf, np.inf, 1.0]
    road.learn(tracks_of(40.0))
    assert road.travel_factor(places, sizes).tolist() == [1.0, 1.0, 1.0]
    fall(road.learn, 100, 8.0, first=50.0)
    assert Road(WIDTH, HEIGHT, careful=False).travel_factor(places, sizes).tolist() == [1.0, 1.0, 1.0]


SHAPES = {
    "narrow": lambda rng, n: 7 * rng.lognormal(0, 0.3, n),
    "wide": lambda rng, n: 7 * rng.lognormal(0, 0.5, n),
    "wider": lambda rng, n: 7 * rng.lognormal(0, 0.8, n),
    "flat": lambda rng, n: 6 * 4 ** rng.uniform(0, 1, n),
}


@pytest.mark.parametrize("per_s", [80, 200])
@pytest.mark.parametrize("shape", SHAPES)
def test_nearly_all_of_a_swarm_is_within_its_size_and_vehicles_are_not(shape, per_s):
    rng, swarm, born = np.random.default_rng(5), Swarm(), []
    for k in range(12 * 25):
        sides = SHAPES[shape](rng, rng.poisson(per_s / 25))
        vehicle = [[300.0, 200.0, 90.0, 60.0]] if k % 25 == 0 else []
        boxes = [[10.0 * i, 100.0, side, side / 2] for i, side in enumerate(sides)] + vehicle
        swarm.learn(tracks_of(k / 25, boxes, status=TENTATIVE, age_s=0.0))
        born += list(sides)
        if k > 5 * 25:
            assert swarm.size < 90
            assert np.mean(np.array(born) <= swarm.size) > 0.8


def test_births_beside_a_vehicle_are_no_swarm():
    """Pieces of a lorry come and go around it."""
    for known, there in (([], True), ([[0.0, 60.0, 120.0, 60.0]], False)):
        swarm = Swarm()
        for k in range(12 * 25):
            pieces = [[10.0 * i, 125.0, 8.0, 4.0] for i in range(8)]
            ages = np.array([0.0] * 8 + [5.0] * len(known))
            status = np.array([TENTATIVE] * 8 + [CONFIRMED] * len(known))
            swarm.learn(tracks_of(k / 25, pieces + known, status=status, age_s=ages))
        assert (swarm.size > 0) == there


def test_dense_traffic_is_no_swarm():
    road = Road(WIDTH, HEIGHT)
    fall(road.learn, 20, 40.0, seconds=60.0)
    assert road.swarm.size == 0.0


def test_a_picture_that_changes_all_at_once_is_no_swarm():
    road = Road(WIDTH, HEIGHT)
    fall(road.learn, 4000, 40.0, seconds=0.1)
    assert road.swarm.size == 0.0


@pytest.mark.parametrize("fps", [10, 25, 30, 60])
@pytest.mark.parametrize("begin_s", [3.0, 5.0])
def test_half_a_second_of_damaged_pictures_is_no_swarm_and_snow_that_begins_then_is(fps, begin_s):
    """Lost packets leave blocks that begin by the hundred; who comes in after them is a vehicle."""
    road, rng = Road(WIDTH, HEIGHT), np.random.default_rng(0)
    for k in range(round((begin_s + 5) * fps)):
        t = k / fps
        count = 40 if begin_s <= t < begin_s + 0.5 else rng.poisson(8 / fps)
        boxes = np.column_stack([rng.uniform(0, 200, (count, 2)), np.full((count, 2), 30.0)])
        road.learn(tracks_of(t, boxes, status=TENTATIVE, age_s=0.0))
        assert road.swarm.size == 0.0
    fall(road.learn, 100, 8.0, first=begin_s + 5, seconds=6.0)
    assert road.swarm.size > 8.0


def test_a_swarm_that_was_saved_without_its_windows_goes_on():
    road, other = Road(WIDTH, HEIGHT), Road(WIDTH, HEIGHT)
    fall(road.learn, 100, 8.0)
    saved = {name: value for name, value in gather(road.swarm).items() if name not in ("_busy_s", "_window")}
    restore(other.swarm, saved)
    assert other.swarm.size == road.swarm.size > 0


def test_flakes_that_drift_are_not_confirmed_and_a_vehicle_among_them_is():
    from blob_scene import confirmed_ids, default_tracker, play

    def snow(t):
        flakes = [[20.0 * x, 20 * t + 5 * (x % 3), 6, 6] for x in range(15)]
        return [*flakes, [20 + 60 * t, 150, 30, 20]]

    assert len(confirmed_ids(play(default_tracker(), snow, 3.0))) == 16
    tracker = default_tracker()
    fall(tracker.road.learn, 200, 6.0, first=-10.0)
    assert len(confirmed_ids(play(tracker, snow, 3.0))) == 1


def test_a_restless_place_asks_for_more_travel_before_a_track_is_confirmed():
    from blob_scene import confirmed_ids, default_tracker, play

    def swaying(t):
        return [[90 + 14 * min(t / 0.6, 1), 100, 14, 14]]

    tracker = default_tracker()
    flutter(tracker.road.learn, 8, box=[95.0, 100.0, 14.0, 14.0])
    assert not confirmed_ids(play(tracker, swaying, 0.9))
    assert confirmed_ids(play(default_tracker(), swaying, 0.9))


def test_boxes_grow_and_shrink_with_the_sizes_that_are_typical_where_they_go():
    road = Road(640, 480)
    near, far = np.array([[300.0, 380.0, 80.0, 60.0]]), np.array([[310.0, 160.0, 80.0, 60.0]])
    assert road.growth(near, far).tolist() == [[1, 1, 1, 1]]  # nothing is known yet
    road.sizes.spread = np.full(2, 0.1)
    road.sizes._fit = np.array([[60.0, 40.0], [0.0, 0.0], [90.0, 60.0]])
    slow = near + np.array([0.0, -4.0, 0.0, 0.0])
    expected = road.sizes.typical(slow) / road.sizes.typical(near)
    np.testing.assert_allclose(road.growth(near, slow), np.tile(expected, 2))
    assert road.growth(near, slow).max() < 1
    np.testing.assert_allclose(road.growth(far, near), 1.2)  # nothing becomes so much larger in one scan
