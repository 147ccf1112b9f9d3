"""What each scenario promises must hold for every seed; most is checked on the geometry, without drawing."""

from itertools import combinations

import numpy as np
import pytest

from vidtrack.simulate import SCENARIOS, simulate
from vidtrack.simulate.ground import PAINT
from vidtrack.simulate.scene import bounds, inside, touching


def scene(name, seed):
    return SCENARIOS[name](np.random.default_rng(seed))


def stop_line(s):
    """The polygon of the painted part that reaches farthest down the picture."""
    return max((part.polygon for part in s.ground if part.colour == PAINT[0]), key=lambda xy: np.ptp(xy[:, 1]))


def overlap_area(a, b):
    """Common area (N,) of boxes (N, 4) of left, top, right, bottom."""
    sides = np.minimum(a[:, 2:], b[:, 2:]) - np.maximum(a[:, :2], b[:, :2])
    return np.maximum(sides, 0).prod(axis=1)


@pytest.mark.parametrize("name", ["crossing", "crossing-45"])
def test_crossing_vehicles_are_one_blob_for_five_frames_and_apart_a_second_before_and_after(name):
    for seed in range(40):
        s = scene(name, seed)
        for fps in (10, 15, 30):
            times = s.times(fps)
            a, b = (actor.outline(times) for actor in s.targets)
            together = np.flatnonzero(touching(a, b))
            assert len(together) >= 5, (seed, fps)
            assert (overlap_area(bounds(a), bounds(b))[together] > 0).all()
            whole = inside(bounds(a), s.size) & inside(bounds(b), s.size)
            assert whole[: together[0]].sum() >= fps
            assert whole[together[-1] + 1 :].sum() >= fps


@pytest.mark.parametrize(("name", "turn"), [("crossing", 0.0), ("crossing-45", np.pi / 4)])
def test_crossing_goes_upwards_and_to_the_right_turned_as_the_name_says(name, turn):
    for actor, heading in zip(scene(name, 5).targets, (turn - np.pi / 2, turn), strict=True):
        start, end = actor.path.at(np.array([1.0, 9.0]))[0]
        assert np.arctan2(*(end - start)[::-1]) == pytest.approx(heading, abs=1e-9)


def test_crossing_speeds_differ_between_seeds():
    travelled = [
        np.ptp(scene("crossing", seed).targets[1].path.at(np.array([3.0, 7.0]))[0][:, 0]) for seed in range(30)
    ]
    assert np.mean(travelled) == pytest.approx(4 * 30, rel=0.15)
    assert np.std(travelled) > 5


def test_nine_vehicles_cross_several_times():
    for seed in range(15):
        s = scene("nine", seed)
        outlines = [actor.outline(s.times()) for actor in s.targets]
        assert len(outlines) == 9
        meetings = sum(touching(a, b).any() for a, b in combinations(outlines, 2))
        assert 3 <= meetings <= 8
        assert all(inside(bounds(outline), s.size).sum() >= 2 * s.fps for outline in outlines)


def test_junction_has_fourteen_targets_that_are_all_seen_and_not_hidden_for_long():
    for seed in range(4):
        clip = simulate("junction", seed=seed)
        truth = clip.truth
        assert set(truth.id) == set(range(1, 15)), seed
        assert len(clip) == 255
        for target in range(1, 15):
            seen = truth.visibility[truth.id == target] > 0.9
            assert seen.sum() >= 1.5 * clip.fps, (seed, target)
            whole = clip.scene.targets[target - 1].outline(truth.time_s[truth.id == target])
            hidden = (truth.visibility[truth.id == target] < 0.5) & inside(bounds(whole), clip.scene.size)
            assert hidden.sum() <= 0.5 * clip.fps, (seed, target)


def test_junction_has_people_a_motorcycle_cars_and_a_lorry():
    kinds = [actor.name.split()[0] for actor in scene("junction", 0).targets]
    assert kinds.count("person") == 4
    assert kinds.count("motorcycle") == 1
    assert kinds.count("lorry") == 1
    assert sum("car" in actor.name for actor in scene("junction", 0).targets) == 8


def test_grey_car_covers_the_stop_line_at_two_seconds_and_the_white_car_follows_on_its_path():
    for seed in range(12):
        s = scene("junction", seed)
        grey, white = s.targets[:2]
        middle = stop_line(s).mean(axis=0)
        times = s.times()
        over = [times[(np.abs(actor.path.at(times)[0] - middle) < 4).all(axis=1)].mean() for actor in (grey, white)]
        assert over[0] == pytest.approx(2.0, abs=0.15)
        assert 1.5 < over[1] - over[0] < 2.2
        moved = grey.path.at(times)[0]
        assert moved[-1, 0] < moved[0, 0]
        assert moved[0, 1] > moved[-1, 1]
        at_line = [actor.path.at(np.array([t]))[0][0] for actor, t in zip((grey, white), over, strict=True)]
        assert np.linalg.norm(at_line[0] - at_line[1]) < 4


def test_the_stop_line_is_left_as_a_ghost_that_fades_before_the_white_car_covers_it():
    for seed in range(2):
        clip = simulate("junction", seed=seed)
        average, disturbed = None, []
        line = stop_line(clip.scene)
        box = np.concatenate([line.min(axis=0), line.max(axis=0)]).round().astype(int)
        for k in range(70):
            grey = clip.frame(k).mean(axis=2)[box[1] + 3 : box[3] - 3, box[0] + 2 : box[2] - 2]
            average = grey if average is None else average
            disturbed.append(np.median(grey - average) > 20)
            average = 0.9 * average + 0.1 * grey
        right = clip.truth.box[:, 0] + clip.truth.box[:, 2]
        gone = clip.truth.frame[(clip.truth.id == 1) & (right < box[0])][0]
        reached = clip.truth.frame[(clip.truth.id == 2) & (clip.truth.box[:, 0] < box[2])][0]
        assert 6 <= np.sum(disturbed[gone:reached]) <= reached - gone
