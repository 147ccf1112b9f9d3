"""The truth must be what is drawn, and each knob must do what it says and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from vidtrack.errors import ConfigError
from vidtrack.simulate import SCENARIOS, Clip, simulate
from vidtrack.simulate.scene import Path


def without(clip: Clip, hidden: set[int]) -> Clip:
    """The clip with some targets (by index) moved far out of the picture."""
    away = Path(np.zeros(1), np.full((1, 2), 1e5), np.zeros(1))
    targets = tuple(replace(actor, path=away) if i in hidden else actor for i, actor in enumerate(clip.scene.targets))
    return replace(clip, scene=replace(clip.scene, targets=targets))


def changed(a, b):
    """Which pixels (H, W) differ by more than the faint rim of an anti-aliased edge."""
    return np.any(np.abs(a.astype(int) - b) > 20, axis=2)


def rows(truth, frame):
    return np.flatnonzero(truth.frame == frame)


def extent(mask):
    """left, top, right, bottom of a mask."""
    y, x = np.nonzero(mask)
    return np.array([x.min(), y.min(), x.max() + 1, y.max() + 1])


@pytest.mark.parametrize(
    ("name", "size"), [("crossing-45", None), ("nine", None), ("junction", None), ("junction", (500, 300))]
)
def test_the_pixels_that_an_actor_changes_fill_its_box(name, size):
    clip = simulate(name, seed=4, noise=0, size=size)
    clip = replace(clip, scene=replace(clip.scene, sun=None))
    for frame in (30, 60, 75, 100):
        picture = clip.frame(frame)
        for row in rows(clip.truth, frame):
            mask = changed(picture, without(clip, {int(clip.truth.id[row]) - 1}).frame(frame))
            box = clip.truth.box[row].copy()
            box[2:] += box[:2]
            if clip.truth.visibility[row] > 0.99:
                assert extent(mask) == pytest.approx(box, abs=1.25)
            elif mask.any():
                assert (extent(mask)[:2] >= box[:2] - 1.25).all()
                assert (extent(mask)[2:] <= box[2:] + 1.25).all()


def test_a_shadow_is_darker_with_the_same_chromaticity():
    clip = simulate("junction", seed=4, noise=0)
    bright = replace(clip, scene=replace(clip.scene, sun=None))
    sunny, cloudy = clip.frame(60).astype(float), bright.frame(60).astype(float)
    shadow = (sunny.sum(axis=2) < 0.75 * cloudy.sum(axis=2)) & (cloudy.min(axis=2) > 60)
    assert shadow.sum() > 50
    ratio = sunny[shadow] / cloudy[shadow]
    assert np.quantile(np.ptp(ratio, axis=1), 0.9) < 0.05  # but for half-covered pixels on edges


def test_visibility_is_the_share_of_pixels_left_by_what_is_in_front():
    clip = simulate("crossing", seed=0, noise=0)
    truth = clip.truth
    assert truth.visibility.min() >= 0
    assert truth.visibility.max() <= 1
    frame = int(truth.frame[np.argmin(np.where(np.abs(truth.time_s - 5) < 1.5, truth.visibility, 1))])
    hidden, front = truth.visibility[rows(truth, frame)]
    seen = changed(clip.frame(frame), without(clip, {0}).frame(frame)).sum()
    alone = changed(without(clip, {1}).frame(frame), without(clip, {0, 1}).frame(frame)).sum()
    assert hidden < 0.8
    assert front == 1
    assert hidden == pytest.approx(seen / alone, abs=0.08)


@pytest.mark.parametrize("name", list(SCENARIOS))
@pytest.mark.parametrize("shake", [0.0, 3.0])
def test_boxes_lie_in_the_picture_and_are_not_empty(name, shake):
    clip = simulate(name, seed=2, shake=shake)
    box = clip.truth.box
    assert (box[:, :2] >= 0).all()
    assert (box[:, :2] + box[:, 2:] <= np.array(clip.size) + 1e-9).all()
    assert (box[:, 2:] > 0.9).all()
    assert (np.diff(clip.truth.frame) >= 0).all()


def test_the_same_seed_gives_the_same_clip_and_another_seed_another():
    one, two, other = (simulate("junction", seed=seed, shake=1, light_steps=1) for seed in (3, 3, 4))
    assert np.array_equal(one.truth.box, two.truth.box)
    assert all(np.array_equal(one.frame(k), two.frame(k)) for k in (0, 100, 254))
    assert not np.array_equal(one.frame(100), other.frame(100))


def test_a_frame_is_the_same_whether_drawn_in_order_or_alone():
    clip = simulate("crossing", seed=1)
    assert np.array_equal(list(clip)[40], simulate("crossing", seed=1).frame(40))


def test_fps_changes_the_number_of_frames_and_not_the_motion():
    slow, fast = simulate("junction", seed=1, fps=10), simulate("junction", seed=1, fps=30)
    assert (len(slow), len(fast)) == (170, 510)
    common = np.isin(fast.truth.frame, 3 * np.arange(170))
    assert fast.truth.time_s[common] == pytest.approx(slow.truth.time_s)
    assert fast.truth.box[common] == pytest.approx(slow.truth.box)


def test_size_scales_the_truth_exactly():
    small, large = simulate("junction", seed=1), simulate("junction", seed=1, size=(720, 360))
    assert large.frame(0).shape == (360, 720, 3)
    assert large.truth.box == pytest.approx(small.truth.box * [3, 2, 3, 2])
    assert np.array_equal(large.truth.visibility, small.truth.visibility)


@pytest.mark.parametrize("sigma", [0.0, 2.0, 6.0])
def test_noise_has_the_standard_deviation_asked_for(sigma):
    clip = simulate("crossing", seed=1, noise=sigma)
    corner = np.stack([clip.frame(k)[:40, :40] for k in range(60)]).astype(float)
    assert corner.std(axis=0).mean() == pytest.approx(sigma, abs=0.15)


def test_shake_moves_the_background_and_the_truth_with_it():
    still, shaken = simulate("crossing", seed=1, noise=0), simulate("crossing", seed=1, noise=0, shake=2.0)
    assert shaken.camera.shake.std() == pytest.approx(2.0, rel=0.25)
    corner = [clip.frame(k)[:40, :40].astype(float) for clip in (still, shaken) for k in (0, 20)]
    assert np.array_equal(corner[0], corner[1])
    assert np.abs(corner[2] - corner[3]).mean() > 2
    at = np.flatnonzero((still.truth.frame == 60) & (still.truth.id == 2))
    moved = np.flatnonzero((shaken.truth.frame == 60) & (shaken.truth.id == 2))
    assert shaken.truth.centre[moved] - still.truth.centre[at] == pytest.approx(shaken.camera.shake[60][None])


def test_light_steps_change_the_whole_picture_that_often():
    clip = simulate("crossing", seed=1, noise=0, light_steps=3)
    level = np.array([clip.frame(k)[:30, :30].mean() for k in range(len(clip))])
    assert (np.abs(np.diff(level)) > 0.05 * level[0]).sum() == 3


@pytest.mark.parametrize(
    "wrong",
    [{"fps": 0}, {"size": (8, 8)}, {"noise": -1}, {"shake": float("nan")}, {"light_steps": -1}, {"seed": -1}],
)
def test_a_value_out_of_range_is_named(wrong):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        simulate("crossing", **wrong)


def test_an_unknown_scenario_names_the_nearest():
    with pytest.raises(ConfigError, match="junction"):
        simulate("juntion")
