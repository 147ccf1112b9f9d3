"""The truth must be what is drawn, in all scenarios and with every knob."""

from functools import cache

import cv2
import numpy as np
import pytest

from vidtrack.errors import ConfigError
from vidtrack.simulate import simulate_road
from vidtrack.simulate.roads.scenarios import ROADS
from vidtrack.simulate.roads.stage import draw, footprints, nearer

SMALL = (640, 360)


@cache
def clip(name, **knobs):
    return simulate_road(name, seed=3, size=SMALL, seconds=4, **knobs)


def covered(actor, view, size=SMALL):
    """Pixels (H, W) that a vehicle changes by more than the faint rim of an anti-aliased edge."""
    canvas = np.full((size[1], size[0], 3), (255, 0, 255), np.uint8)
    draw(canvas, actor, view, None)
    return np.abs(canvas.astype(int) - (255, 0, 255)).max(axis=2) > 110


def boxes(c, frame):
    rows = np.flatnonzero(c.truth.boxes.frame == frame)
    return {int(c.truth.vehicle[row]): row for row in rows}


@pytest.mark.parametrize(("name", "lens", "shake"), [(n, 0.0, 0.0) for n in ROADS] + [("junction-3d", -0.2, 2.0)])
def test_the_pixels_that_a_vehicle_changes_fill_its_box(name, lens, shake):
    c = clip(name, lens=lens, shake=shake)
    checked = 0
    for frame in (0, 40, 99):
        view = c.eye.shifted(c.camera.shake[frame])
        states = c.history.at(c.times[frame])
        rows = boxes(c, frame)
        for actor in c.actors(states, frame):
            y, x = np.nonzero(covered(actor, view))
            if len(x) == 0:
                continue
            drawn = np.array([x.min(), y.min(), x.max() + 1, y.max() + 1])
            row = rows.get(int(states.vehicle[actor.row]))
            if row is None:
                assert min(drawn[2] - drawn[0], drawn[3] - drawn[1]) <= 3
                continue
            box = c.truth.boxes.box[row]
            box = np.array([*box[:2], *(box[:2] + box[2:])])
            assert (drawn[:2] >= box[:2] - 1.5).all()
            assert (drawn[2:] <= box[2:] + 1.5).all()
            if (actor.box[:2] > 0).all() and (actor.box[2:] < SMALL).all():  # a cut vehicle's box is its whole one, cut
                assert drawn == pytest.approx(box, abs=1.5)
                checked += 1
    assert checked >= 3


def test_visibility_is_the_share_of_pixels_left_by_what_is_nearer():
    size = (960, 540)
    c = simulate_road("motorway", seed=1, size=size, seconds=6, fps=5, camera_height=5, tilt_deg=10)
    truth, hidden = c.truth, 0
    assert truth.boxes.visibility.min() >= 0
    assert truth.boxes.visibility.max() == 1
    for frame in range(0, 30, 3):
        states, rows = c.history.at(c.times[frame]), boxes(c, frame)
        actors = c.actors(states, frame)
        alone = [covered(actor, c.eye, size) for actor in actors]
        picture = np.zeros((size[1], size[0]), int)
        for k, mask in enumerate(alone):
            picture[mask] = k + 1
        for k, actor in enumerate(actors):
            row, total = rows.get(int(states.vehicle[actor.row])), alone[k].sum()
            if row is None or (actor.box[:2] < 0).any() or (actor.box[2:] > size).any() or total < 560:
                continue
            seen = (picture == k + 1).sum() / total
            assert truth.boxes.visibility[row] == pytest.approx(seen, abs=0.06)
            hidden += seen < 0.9
    assert hidden >= 3


def test_what_stands_between_the_eye_and_another_is_nearer():
    rng = np.random.default_rng(5)
    eye = np.array([-30.0, -20.0])
    xy, heading = rng.uniform(-15, 15, (60, 2)), rng.uniform(-3, 3, 60)
    base = footprints(xy, heading, rng.uniform(2, 12, 60), rng.uniform(1, 2.5, 60))
    share = np.linspace(0, 1, 200)[:, None]
    found = 0
    hides = nearer(base, eye)
    for i, j in zip(*np.triu_indices(60, 1), strict=True):
        ray = eye + share * (base[j].mean(axis=0) - eye)
        edge = np.roll(base[i], -1, axis=0) - base[i]
        off = ray[:, None] - base[i]
        if (edge[:, 0] * off[..., 1] - edge[:, 1] * off[..., 0] > 0).all(axis=1).any():
            apart = np.linalg.norm(xy[i] - xy[j]) > 14
            found += apart
            assert hides[i, j] or not apart
            assert not (hides[i, j] and hides[j, i])
    assert found > 10


@pytest.mark.parametrize("name", list(ROADS))
def test_the_same_seed_gives_the_same_frames_in_any_order(name):
    one, two = (simulate_road(name, seed=7, size=(320, 180), seconds=2) for _ in range(2))
    later, earlier = one.frame(40), one.frame(3)
    assert np.array_equal(earlier, two.frame(3))
    assert np.array_equal(later, two.frame(40))
    assert np.array_equal(one.truth.boxes.box, two.truth.boxes.box)
    other = simulate_road(name, seed=8, size=(320, 180), seconds=2)
    assert not np.array_equal(other.frame(3), earlier)


KNOBS = [
    {"weather": "rain"},
    {"weather": "fog"},
    {"light": "low-sun"},
    {"light": "dusk"},
    {"wet": True},
    {"clock": True},
]


@pytest.mark.parametrize("knobs", [*KNOBS, {"weather": "rain", "light": "night"}], ids=str)
def test_weather_and_light_change_the_picture_and_never_the_truth(knobs):
    plain, other = clip("road"), clip("road", **knobs)
    assert np.array_equal(plain.truth.boxes.box, other.truth.boxes.box)
    assert np.array_equal(plain.truth.xy, other.truth.xy)
    assert np.abs(plain.frame(9).astype(int) - other.frame(9)).max() > 60
    assert np.array_equal(other.frame(9), other.frame(9))


def test_at_night_the_road_is_dark_but_for_lamps():
    day, night = clip("road").frame(9), clip("road", light="night").frame(9)
    assert np.median(night) < 0.4 * np.median(day)
    assert night.max() > 200


def test_shadows_are_thrown_away_from_the_sun():
    c = clip("road")
    actor = c.actors(c.history.at(0.0), 0)[0]
    reach = [polygon @ c.sun[:2] for polygon in actor.shadow(c.sun)]
    base = actor.shape[..., :2] @ c.sun[:2]
    top = float(actor.shape[..., 2].max())
    assert min(part.min() for part in reach) < base.min() - 0.3 * top * np.hypot(*c.sun[:2]) ** 2 / c.sun[2]
    assert max(part.max() for part in reach) <= base.max() + 1e-3


def test_frames_per_second_change_neither_motion_nor_times():
    slow, fast = (simulate_road("road", seed=2, size=SMALL, seconds=3, fps=fps) for fps in (10, 30))
    assert (len(slow), len(fast)) == (30, 90)
    common = fast.truth.boxes.frame % 3 == 0
    assert fast.truth.xy[common] == pytest.approx(slow.truth.xy)


@pytest.mark.parametrize(
    "wrong",
    [{"seconds": 0}, {"flow": 0}, {"camera_height": 2}, {"tilt_deg": 89}, {"lens": 1}, {"click_sigma": -1}, {"fps": 0},
     {"lens": float("nan")}],
)  # fmt: skip
def test_a_value_out_of_range_is_named(wrong):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        simulate_road("road", **wrong)


def test_an_unknown_road_and_a_camera_that_sees_too_little_are_refused():
    with pytest.raises(ConfigError, match="roundabout"):
        simulate_road("roundabuot")
    with pytest.raises(ConfigError, match="camera_height"):
        simulate_road("roundabout", tilt_deg=80, camera_height=5)


@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080)])
def test_beams_at_dusk_are_as_soft_in_a_larger_picture(size):
    small, large = (
        simulate_road("junction-3d", seed=3, size=of, seconds=4, light="dusk", noise=0.0).frame(50)
        for of in ((640, 360), size)
    )
    reduced = cv2.resize(large, (640, 360), interpolation=cv2.INTER_AREA)
    difference = np.abs(cv2.blur(reduced, (9, 9)).astype(int) - cv2.blur(small, (9, 9)))
    assert difference.mean() < 1
    assert difference.max() < 25
