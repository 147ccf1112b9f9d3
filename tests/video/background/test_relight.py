"""Light that returns when a cloud moves on: known answers."""

import numpy as np
import pytest

from vidtrack.config.video import DetectorSettings
from vidtrack.video.background import create
from vidtrack.video.background.picture import Picture
from vidtrack.video.background.relight import Relight
from vidtrack.video.background.scene import start
from vidtrack.video.frame import Frame

H, W, BLACK = 120, 240, np.float32(16)
RATE = 25  # frames/s
LORRY = np.s_[30:70, 40:100]
GREY = np.full((H // 2, W // 2), 128, np.uint8)


def road():
    """A road with stones, between grass."""
    rng = np.random.default_rng(0)
    stones = rng.normal(0, 6, (H // 3, W // 3)).repeat(3, axis=0).repeat(3, axis=1)
    scene = np.full((H, W), 60.0, np.float32) + stones
    scene[::24, ::2] += 60
    return (scene + BLACK).astype(np.float32)


def lit(scene, by=1.4, part=np.s_[:, :160]):
    picture = scene.copy()
    picture[part] = BLACK + by * (scene[part] - BLACK)
    return picture


class Follower:
    """What has been disturbed is brought to the light of pictures, one a second."""

    def __init__(self, scene):
        self.scene, self.relight = start(Picture(scene, GREY, GREY)), Relight()

    def hits(self, picture, dt=1.0):
        hit = (np.abs(picture - self.scene.luma) > 8).astype(np.uint8)
        seen = Picture(np.round(picture).astype(np.uint8), GREY, GREY)
        self.relight.follow(seen, self.scene, np.full((H, W), BLACK), hit, hit.copy(), dt)
        return hit


def test_more_light_becomes_scene_and_the_vehicle_in_it_stays():
    scene, rest = road(), np.ones((H, W), bool)
    picture = lit(scene)
    picture[LORRY] = 230
    rest[28:72, 38:102] = False
    follower = Follower(scene)
    hit = follower.hits(picture)
    assert hit[LORRY].mean() > 0.98
    assert hit[rest].mean() < 0.02
    behind = (follower.scene.luma[LORRY] - BLACK) / (scene[LORRY] - BLACK)
    assert np.mean(np.abs(behind - 1.4) < 0.05) > 0.95


@pytest.mark.parametrize("level", [150, 230])
def test_a_large_pale_vehicle_is_no_light(level):
    scene = road()
    picture = scene.copy()
    picture[20:110, 20:200] = level
    follower = Follower(scene)
    hit = follower.hits(picture)
    assert hit[20:110, 20:200].mean() > 0.95
    np.testing.assert_array_equal(follower.scene.luma, scene)


def test_small_parts_follow_while_light_returns():
    scene, small = road(), np.s_[20:50, 200:215]
    alone = Follower(scene)
    assert alone.hits(lit(scene, part=small))[small].any()

    returning = Follower(scene)
    returning.hits(lit(scene))
    picture = lit(lit(scene), part=small)
    assert returning.hits(picture)[small].mean() < 0.05

    late = Follower(scene)
    late.hits(lit(scene))
    assert late.hits(picture, dt=11.0)[small].any()


@pytest.mark.parametrize("relight", [True, False])
def test_a_cloud_that_moves_on_is_no_foreground(relight):
    settings = DetectorSettings.model_validate({"disturbance": {"relight": relight, "registration": False}})
    detector, scene = create(settings), road()
    rng, share = np.random.default_rng(1), []
    for k in range(8 * RATE):
        front = (k / RATE - 3) * W / 3  # from 3 s on, in 3 s across the picture
        light = 1 + 0.5 / (1 + np.exp((np.arange(W) - front) / 12))
        luma = BLACK + light * (scene - BLACK) + rng.normal(0, 1, (H, W))
        frame = Frame(k, k / RATE, np.clip(luma, 0, 255).astype(np.uint8), GREY, GREY)
        mask = detector.apply(frame, np.empty((0, 4))).mask
        share.append(np.mean(mask > 0))
    moving = np.array(share[3 * RATE : 6 * RATE])
    assert (moving.max() < 0.05) == relight
