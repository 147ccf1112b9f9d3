"""Beams of headlamps on a dark road: known answers."""

import numpy as np
import pytest

from vidtrack.config.video import DetectorSettings
from vidtrack.video.background import create
from vidtrack.video.background.beam import is_dark, mark_beams, shows_lamps
from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import BEAM, start
from vidtrack.video.frame import Frame

H, W, BLACK = 120, 240, np.float32(16)
RATE = 25  # frames/s
CAR = np.s_[20:40, 10:40]


def road(level=20.0):
    """A road with lane marks and a kerb of stones."""
    scene = np.full((H, W), level, np.float32)
    scene[29:31, ::2] = 2 * level
    scene[90:110] += level * np.repeat(np.random.default_rng(0).random((5, W // 4)), 4, axis=0).repeat(4, axis=1)
    return scene + BLACK


def lit(scene, bend=0.0):
    """The scene with a beam to the right of the car, three times as bright at its middle."""
    y, x = np.mgrid[:H, :W]
    light = 1 + 2 * np.exp(-(((x - 65) / 14) ** 2) - ((y - 30 - bend) / 7) ** 2)
    return BLACK + light * (scene - BLACK)


def hits(picture, scene, red=None):
    """Hits where picture and scene (H, W) differ; `red` (H/2, W/2) is the chroma of the picture, grey without it."""
    grey = np.full((H // 2, W // 2), 128, np.uint8)
    hit = (np.abs(picture - scene) > 5).astype(np.uint8)
    seen = Picture(np.round(picture).astype(np.uint8), grey, grey if red is None else red)
    mark_beams(seen, start(Picture(scene, grey, grey)), BLACK, hit)
    return hit


def test_the_light_on_the_road_is_a_beam_and_the_car_is_not():
    scene = road()
    picture = lit(scene)
    picture[CAR] = BLACK + 70
    hit = hits(picture, scene)
    assert (hit[CAR] == 1).mean() > 0.95
    rest = np.ones((H, W), bool)
    rest[18:42, 8:42] = False
    assert (hit[rest] == BEAM).sum() > 500
    assert (hit[rest] == 1).sum() < 0.1 * (hit[rest] == BEAM).sum()


@pytest.mark.parametrize("level", [2.0, 60.0], ids=["unlit", "pale"])
def test_a_body_of_any_brightness_ends_at_an_edge(level):
    scene = road()
    picture = scene.copy()
    picture[CAR] = BLACK + level
    assert not (hits(picture, scene) == BEAM).any()


def test_a_coloured_body_in_a_beam_is_no_beam_and_the_light_of_halogen_lamps_is_one():
    scene = road()
    picture = lit(scene)
    light = (picture - BLACK).reshape(H // 2, 2, W // 2, 2).mean(axis=(1, 3))  # chroma is that of four pixels
    halogen = np.where(light > 25, 128 + 0.13 * light, 128).astype(np.uint8)
    white = hits(picture, scene) == BEAM
    assert white.sum() > 500
    assert (hits(picture, scene, halogen)[white] == BEAM).mean() > 0.95

    body = np.s_[22:38, 58:72]  # paint as bright as the light on the road around it: no edge tells it
    red = halogen.copy()
    red[11:19, 29:36] = 128 + 40
    hit = hits(picture, scene, red)
    assert (hit[body] != BEAM).all()
    assert (hit == BEAM).sum() > 300


def test_a_smooth_body_with_a_gap_in_its_edge_is_no_beam():
    scene = np.full((H, W), BLACK + 20, np.float32)
    picture = scene.copy()
    picture[30:80, 60:140] = BLACK + 32
    picture[78:82, 100:106] = [[BLACK + level] for level in (29, 27, 25, 23)]  # mud, over which the paint fades
    assert (hits(picture, scene) == 1).sum() > 3500
    assert not (hits(picture, scene) == BEAM).any()


def test_only_a_dark_scene_is_lit_by_lamps():
    dark, dusk, day = road(20), road(40), road(90)
    lamp = dark.copy()
    lamp[40, 60] = 200
    assert is_dark(dark, BLACK)
    assert not is_dark(dusk, BLACK)
    assert not is_dark(day, BLACK)
    assert shows_lamps(lamp.astype(np.uint8), BLACK)
    assert not shows_lamps(dark.astype(np.uint8), BLACK)


def played(beams, stands_s, level=20.0):
    """Share of foreground on a noisy road while a beam stands there for stands_s, and for two seconds after."""
    rng = np.random.default_rng(1)
    detector = create(DetectorSettings.model_validate({"disturbance": {"beams": beams}}))
    found = []
    for k in range(int((3 + stands_s + 2) * RATE)):
        on = 3 <= k / RATE < 3 + stands_s
        clean = lit(road(level)) if on else road(level)
        clean[56:64, 84:87] = 220  # lamps, seen all the time
        y = np.clip(np.round(clean + rng.normal(0, 1.5, clean.shape)), 0, 255).astype(np.uint8)
        frame = Frame(k, k / RATE, y)
        found.append((detector.apply(frame, np.empty((0, 4))).mask > 0).mean())
    return np.array(found[3 * RATE :])


def test_a_beam_that_waits_is_no_foreground_and_leaves_no_mark():
    share, off = played(True, 8), 8 * RATE
    assert share[:off].max() < 0.001
    assert share[off + RATE // 2 :].max() < 0.001
    assert played(False, 8)[:RATE].min() > 0.015


def test_what_rises_softly_over_the_road_at_dusk_is_a_grey_roof_and_no_beam():
    assert played(True, 1, level=40.0)[:RATE].min() > 0.015
