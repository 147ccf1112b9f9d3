"""Light that haze or glare adds: learnt at each place from what drives there."""

import cv2
import numpy as np
import pytest

from vidtrack.config.video import DetectorSettings
from vidtrack.state import gather, restore
from vidtrack.video.background import create
from vidtrack.video.background.veil import Haze, VeilByPlace
from vidtrack.video.frame import Frame

SHAPE = (120, 160)
BLACK = np.float32(16)
CLEAR = Haze(np.float32(0), BLACK, BLACK, np.float32(240))
HAZY = CLEAR._replace(share=np.float32(1))
NOTHING = np.empty((0, 4))


def learnt(darkest, seconds=4.0, where=np.s_[:, :]):
    """The veil after traffic whose darkest pixels are `darkest`, at places `where` of the picture."""
    veil = VeilByPlace()
    luma, mask = np.full(SHAPE, 200, np.uint8), np.zeros(SHAPE, np.uint8)
    luma[::5, ::5] = darkest
    mask[where] = 255
    for _ in range(round(25 * seconds)):
        veil.learn(luma, mask, 0.04)
    return veil


def test_black_is_lifted_where_nothing_that_drives_is_dark():
    black = learnt(150, where=np.s_[:, 80:]).air(CLEAR, SHAPE).black
    np.testing.assert_allclose(black[:, 100:], 110, atol=6)


def test_black_is_not_lifted_where_vehicles_have_dark_parts():
    np.testing.assert_array_equal(learnt(35).air(CLEAR, SHAPE).black, np.full(SHAPE, BLACK))


def test_haze_takes_away_what_it_adds():
    """Vehicles as dark as 40 under a veil of 60 % of 240: 144 + 0.4 * 40."""
    np.testing.assert_allclose(learnt(160).air(HAZY, SHAPE).black, 144)


def test_light_is_spread_where_haze_is_dense_and_not_in_glare():
    dense, thin = learnt(160), learnt(70)
    assert (dense.air(HAZY, SHAPE).spread == 1).all()
    assert not thin.air(HAZY, SHAPE).spread.any()
    assert not dense.air(CLEAR, SHAPE).spread.any()


def test_the_air_is_that_of_what_is_known_now():
    """A place next to glare passes for glare until dark vehicles were seen there."""
    veil = learnt(150, where=np.s_[:, 80:])
    veil.air(CLEAR, SHAPE)
    luma, mask = np.full(SHAPE, 30, np.uint8), np.zeros(SHAPE, np.uint8)
    mask[:, :80] = 255
    for _ in range(100):
        veil.learn(luma, mask, 0.04)
    again = VeilByPlace()
    restore(again, gather(veil))
    np.testing.assert_array_equal(veil.air(CLEAR, SHAPE).black, again.air(CLEAR, SHAPE).black)


@pytest.mark.parametrize("seconds", [0.0, 1.5])
def test_a_place_is_unknown_until_traffic_has_been_seen_for_seconds(seconds):
    np.testing.assert_array_equal(learnt(150, seconds).air(CLEAR, SHAPE).black, np.full(SHAPE, BLACK))


def test_one_pale_vehicle_after_dark_ones_says_little_and_many_of_them_much():
    veil = learnt(50, 4.0)
    pale, mask = np.full(SHAPE, 180, np.uint8), np.full(SHAPE, 255, np.uint8)
    for seconds, low, high in ((2.0, 16, 25), (120.0, 120, 141)):
        for _ in range(round(5 * seconds)):
            veil.learn(pale, mask, 0.2)
        assert low <= veil.air(CLEAR, SHAPE).black.mean() <= high


def glare(k, cars):
    """Frame k of a road, its right half under a veil of 140 grey levels; cars: (left, grey levels of roof, windows)."""
    light = 100 + np.kron(np.random.default_rng(1).uniform(-8, 8, (15, 20)), np.ones((8, 8)))
    light[::20, :60] = 10  # steep edges: the air is clear
    for left, roof, windows in cars:
        light[50:74, max(left, 0) : max(left + 40, 0)] = roof
        light[56:62, max(left + 8, 0) : max(left + 32, 0)] = windows
    light[:, 80:] += 140
    y = np.clip(light + np.random.default_rng(k).normal(0, 1, SHAPE), 0, 255).astype(np.uint8)
    colour = np.full((60, 80), 128, np.uint8)
    colour[:2] = 140  # a picture with no colour anywhere is that of a camera without
    return Frame(k, k / 25, y, colour, colour, full_range=True)


def shown(veil, roof):
    """Share of a plain car that is foreground in the glare, after patterned ones have driven by."""
    detector = create(DetectorSettings.model_validate({"disturbance": {"veil": veil}}), None, None)
    for k in range(400):
        detector.apply(glare(k, [(-40 + 4 * (k % 50), 40, 5)]), NOTHING)
    for k in range(400, 425):
        detector.apply(glare(k, []), NOTHING)
    mask = detector.apply(glare(425, [(100, roof, roof)]), NOTHING).mask
    return (mask[50:74, 100:140] > 0).mean()


def test_a_flat_car_in_glare_passes_for_no_shadow_once_the_veil_is_known():
    assert shown(veil=False, roof=20) < 0.1
    assert shown(veil=True, roof=20) > 0.9


def test_a_soft_shadow_in_glare_is_still_no_foreground():
    assert shown(veil=True, roof=75) < 0.1


def fog(k, left, roof, windows):
    """Frame k of a smooth road, of which fog leaves two fifths, and a car on it."""
    light = np.full(SHAPE, 100.0)
    light[:30] = 240  # the sky
    light[100:103] = 200  # a mark
    light[50:74, max(left, 0) : max(left + 40, 0)] = roof
    light[56:62, max(left + 8, 0) : max(left + 32, 0)] = windows
    light = cv2.GaussianBlur(240 * 0.6 + 0.4 * light, (5, 5), 0)
    y = np.clip(light + np.random.default_rng(k).normal(0, 1, SHAPE), 0, 255).astype(np.uint8)
    colour = np.full((60, 80), 128, np.uint8)
    colour[:2] = 140
    return Frame(k, k / 25, y, colour, colour, full_range=True)


@pytest.mark.parametrize(("haze", "low", "high"), [(True, 0.9, 1.0), (False, 0.0, 0.1)])
def test_a_smooth_grey_car_in_fog_passes_for_no_shadow(haze, low, high):
    """After white cars with dark windows; the grey one keeps 0.7 of the road's light."""
    detector = create(DetectorSettings.model_validate({"disturbance": {"haze": haze}}), None, None)
    for k in range(400):
        detector.apply(fog(k, -40 + 4 * (k % 50), 200, 10), NOTHING)
    for k in range(400, 425):
        detector.apply(fog(k, -40, 0, 0), NOTHING)
    mask = detector.apply(fog(425, 60, 70, 70), NOTHING).mask
    assert low <= (mask[53:71, 63:97] > 0).mean() <= high


def test_a_state_from_before_there_was_a_veil_is_taken():
    before, after = (create(DetectorSettings(), None, None) for _ in range(2))
    for k in range(5):
        before.apply(glare(k, []), NOTHING)
    state = {name: value for name, value in gather(before).items() if "_veil_by_place" not in name}
    after.apply(glare(0, []), NOTHING)
    restore(after, state)
    np.testing.assert_array_equal(after.scene(), before.scene())


def test_what_was_learnt_in_one_view_is_no_veil_in_the_next():
    detector = create(DetectorSettings(), None, None)
    for k in range(400):
        detector.apply(glare(k, [(-40 + 4 * (k % 50), 40, 5)]), NOTHING)
    light = np.kron(np.random.default_rng(2).uniform(60, 140, (15, 20)), np.ones((8, 8)))
    grey = np.full((60, 80), 128, np.uint8)
    for k in range(400, 600):
        y = light.copy()
        if k > 550:
            y[50:74, 100:140] *= 0.7
        y = np.clip(y + np.random.default_rng(k).normal(0, 1, SHAPE), 0, 255).astype(np.uint8)
        mask = detector.apply(Frame(k, k / 25, y, grey, grey, full_range=True), NOTHING).mask
    assert (mask[50:74, 100:140] > 0).mean() < 0.1
