"""Shadow amid a vehicle, and what haze leaves of contrast and black: known answers."""

import numpy as np
import pytest

from vidtrack.config.video import DetectorSettings
from vidtrack.video.background import create
from vidtrack.video.background.distance import contrast, haziness, veil
from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import SHADOW, start
from vidtrack.video.background.shadow import find_dark, reclaim
from vidtrack.video.frame import Frame

VEHICLE = 1


def reclaimed(hit):
    hit = np.array(hit, np.uint8)
    reclaim(hit)
    return hit


def car(shape=(40, 60)):
    """A vehicle of 30 x 20 px at (15, 10)."""
    hit = np.zeros(shape, np.uint8)
    hit[10:30, 15:45] = VEHICLE
    return hit


def test_shadow_amid_a_vehicle_is_vehicle():
    hit = car()
    hit[15:25, 22:38] = SHADOW
    np.testing.assert_array_equal(reclaimed(hit), car())


def test_dark_paint_at_one_end_is_seen_from_three_sides():
    hit = car()
    hit[15:25, 38:45] = SHADOW
    np.testing.assert_array_equal(reclaimed(hit), car())


@pytest.mark.parametrize("place", [np.s_[30:36, 15:45], np.s_[10:30, 45:58], np.s_[2:10, 20:50]])
def test_shadow_beside_a_vehicle_stays_shadow(place):
    hit = car()
    hit[place] = SHADOW
    np.testing.assert_array_equal(reclaimed(hit), hit)


def test_what_lies_between_shadow_and_vehicle_breaks_the_line():
    hit = car()
    hit[13:27, 18:42] = 0
    hit[16:24, 22:38] = SHADOW
    np.testing.assert_array_equal(reclaimed(hit), hit)


def test_the_narrow_edges_of_a_shadow_are_no_vehicle():
    hit = np.zeros((40, 60), np.uint8)
    hit[10:30, 15:45] = VEHICLE
    hit[11:29, 16:44] = SHADOW
    hit[20, 20:40] = VEHICLE
    np.testing.assert_array_equal(reclaimed(hit), hit)


def test_an_empty_map_stays_empty():
    assert not reclaimed(np.zeros((4, 5))).any()


def steps(height, share=0.5, base=100.0, shape=(80, 200)):
    """A scene with steps of this height; they take this share of the columns' differences."""
    luma = np.full(shape, base, np.float32)
    luma[:, np.arange(shape[1]) % 4 < 4 * share] += height
    return luma


@pytest.mark.parametrize(("height", "expected"), [(100, 1.0), (40, 1.0), (30, 0.75), (20, 0.5), (4, 0.5), (0, 0.5)])
def test_contrast_is_the_height_of_steep_edges_within_limits(height, expected):
    assert contrast(steps(height)) == pytest.approx(expected)


def test_contrast_of_a_picture_too_narrow_for_edges_is_that_of_clear_light():
    assert contrast(np.zeros((10, 2), np.float32)) == 1


def road(seed=0):
    """Grey levels of a road, with some black."""
    luma = np.random.default_rng(seed).normal(120, 10, (120, 160))
    luma[60:64, 40:80] = 12
    return np.clip(luma, 0, 255)


def test_the_veil_is_what_haze_adds_to_black():
    assert veil(road().astype(np.uint8)) == pytest.approx(2, abs=1)
    assert veil((0.5 * road() + 90).astype(np.uint8)) == pytest.approx(0.5 * 12 + 90 - 10, abs=1)
    black = road()
    black[60:64, 40:80] = 0
    assert veil(black.astype(np.uint8)) == 0


@pytest.mark.parametrize("haze", [0, 60])
def test_a_picture_that_shows_nothing_black_tells_nothing_of_haze(haze):
    flat = np.random.default_rng(1).uniform(90 + haze, 150 + haze, (120, 160))
    assert veil(flat.astype(np.uint8)) is None


def marked(height, base=100.0):
    """A smooth road with one mark of this height, and few edges therefore."""
    luma = np.full((120, 160), base, np.float32)
    luma[60:62, 40:80] += height
    return luma


@pytest.mark.parametrize("turn", [np.asarray, np.transpose])
@pytest.mark.parametrize(("height", "expected"), [(100, 0.0), (65, 0.0), (57.5, 0.5), (50, 1.0), (10, 1.0), (0, 1.0)])
def test_haze_is_told_by_the_steepest_edges_however_few_and_whichever_way_they_run(height, expected, turn):
    assert haziness(turn(marked(height))) == pytest.approx(expected)


@pytest.mark.parametrize("shape", [(2, 2), (10, 2), (2, 10)])
def test_a_picture_too_small_for_edges_is_flat_or_clear_but_no_error(shape):
    assert haziness(np.zeros(shape, np.float32)) in (0, 1)


def test_the_shadow_on_a_smooth_road_in_clear_light_is_no_foreground():
    """Nothing black is in view and edges are few; that is no haze, and black is not lifted."""
    assert contrast(marked(100.0)) == 0.5
    detector = create(DetectorSettings(), None, None)
    colour = np.full((60, 80), 128, np.uint8)
    colour[:2] = 140
    for k in range(30):
        light = marked(100.0)
        light[:6, :40] = 50
        if k >= 20:
            light[80:100, 60:100] *= 0.6
        seen = np.clip(light + np.random.default_rng(k).normal(0, 1, light.shape), 0, 255).astype(np.uint8)
        mask = detector.apply(Frame(k, k / 25, seen, colour, colour, full_range=True), np.empty((0, 4))).mask
    assert (mask[80:100, 60:100] > 0).mean() < 0.05


NO_COLOUR = np.empty((0, 0), np.uint8)
BLACK = np.float32(16)


def road_with(body, passes=True, rng_seed=3):
    """Hits of `body`, called with the luminance of a rough road, at 20 x 40 px, shadow where it passes for it.

    Returns the hits before and after.
    """
    rng = np.random.default_rng(rng_seed)
    road = np.clip(rng.normal(120, 12, (60, 80)), 60, 200).astype(np.uint8)
    luma = road.copy()
    luma[20:40, 20:60] = body(luma[20:40, 20:60].astype(float))
    noisy = np.clip(np.rint(luma + rng.normal(0, 1, luma.shape)), 0, 255).astype(np.uint8)
    scene = start(Picture(road, NO_COLOUR, NO_COLOUR))
    scene.noise[:] = 1
    hit = np.zeros(road.shape, np.uint8)
    hit[20:40, 20:60] = np.where(passes, SHADOW, VEHICLE)
    before = hit.copy()
    find_dark(Picture(noisy, NO_COLOUR, NO_COLOUR), scene, np.full(road.shape, BLACK), hit)
    return before, hit


@pytest.mark.parametrize("share", [0.35, 0.5, 0.8])
def test_a_shadow_through_which_the_road_is_seen_stays_shadow(share):
    before, after = road_with(lambda road: BLACK + share * (road - BLACK))
    np.testing.assert_array_equal(after, before)


def test_a_dark_vehicle_with_windows_of_its_own_is_no_shadow():
    def car(road):
        body = np.full_like(road, 70.0)
        body[3:9, 6:16] = body[3:9, 20:32] = 90.0
        body[14:, 5:35] = 55.0
        return body

    _, after = road_with(car)
    # the rim, as soft as that of a shadow may be, is not looked at
    assert np.mean(after[25:35, 25:55] == VEHICLE) > 0.8


def test_a_dark_vehicle_of_which_a_part_is_bright_is_found():
    bright = np.zeros((20, 40), bool)
    bright[:, :7] = True

    def car(road):
        body = np.where(bright, 200.0, 70.0)
        body[6:10, 10:20] = body[6:10, 23:33] = 90.0
        body[13:, 10:] = 55.0
        return body

    before, after = road_with(car, ~bright)
    assert np.mean(before[before > 0] == VEHICLE) > 0.15
    assert np.mean(after[25:35, 25:55] == VEHICLE) > 0.7


def test_the_shadow_beside_a_bright_vehicle_with_dark_windows_stays_shadow():
    window, cast = np.zeros((2, 20, 40), bool)
    window[1:4, 3:37] = cast[9:] = True

    def van(road):
        body = np.where(cast, BLACK + 0.5 * (road - BLACK), 180.0)
        body[window] = 70.0
        body[1:4, 20:37] = 90.0
        return body

    before, after = road_with(van, window | cast)
    np.testing.assert_array_equal(after[29:], before[29:])
