"""What queues hide in the first scene is taken from the pictures that show it."""

import cv2
import numpy as np
import pytest

from vidtrack.video.background.patches import patched
from vidtrack.video.background.picture import Picture, smooth
from vidtrack.video.background.scene import FRESH_NOISE, start

SHAPE = (98, 162)
LANE = slice(36, 60)  # rows
CARS = ((230, 90, 150), (40, 150, 110), (200, 128, 128))  # luminance and chroma


def road(marked=False):
    ground = np.full(SHAPE, 110.0)
    ground[:32] += cv2.GaussianBlur(np.random.default_rng(0).normal(0, 60, (32, SHAPE[1])), (0, 0), 1.5)  # grass
    ground[70:72] = 200
    if marked:
        ground[44:48, ::12] = ground[45:47, 1::12] = 220
    return ground


def picture(ground, cars=(), coloured=True):
    """The road with cars (left [px], length, paint) in its lane."""
    luma = ground.copy()
    chroma = np.full((2, SHAPE[0] // 2, SHAPE[1] // 2), 128.0)
    for left, length, (y, cb, cr) in cars:
        at = slice(max(round(left), 0), max(round(left + length), 0))
        luma[LANE, at] = y
        luma[44:52, at.start + 4 : max(at.stop - 4, at.start + 4)] = 60  # panes
        chroma[:, LANE.start // 2 : LANE.stop // 2, at.start // 2 : at.stop // 2] = np.array([cb, cr])[:, None, None]
    luma += np.random.default_rng(round(luma.sum())).normal(0, 2, SHAPE)
    planes = [np.clip(plane, 0, 255).astype(np.uint8) for plane in (luma, *chroma)]
    return smooth(Picture(*planes) if coloured else Picture(planes[0], planes[1][:0, :0], planes[2][:0, :0]))


def queue(t):
    """Three cars that creep along, a car's length apart."""
    return [(20 + 4 * t + 44 * k, 26, paint) for k, paint in enumerate(CARS)]


def off(scene, ground):
    return np.abs(scene.luma - smooth(Picture(ground.astype(np.uint8), *np.empty((2, 0, 0), np.uint8))).luma) > 15


@pytest.mark.parametrize("coloured", [True, False])
@pytest.mark.parametrize("down", [0, 38])  # px; the lane is amid the picture, or its last rows
def test_the_road_under_a_queue_that_creeps_is_found(coloured, down):
    def seen(t):
        luma, *chroma = picture(ground, queue(t), coloured)
        return Picture(np.roll(luma, down, 0), *(np.roll(plane, down // 2, 0) for plane in chroma))

    ground = road()
    pictures = [seen(t) for t in range(-20, 30)]
    before = start(seen(0))
    after = patched(before, pictures)
    ground = np.roll(ground, down, 0)
    assert off(before, ground).sum() > 1500
    assert off(after, ground).sum() < 250
    assert all(np.abs(plane - 128).max(initial=0) < 10 for plane in (after.cb, after.cr)) or not coloured
    assert (after.noise[np.abs(after.luma - before.luma) > 15] == FRESH_NOISE).all()


def test_a_car_that_stands_for_most_of_the_time_is_the_scene():
    ground = road()
    pictures = [picture(ground, [(60 if t < 30 else 60 + 8 * (t - 30), 26, CARS[0])]) for t in range(50)]
    before = start(pictures[0])
    assert np.array_equal(patched(before, pictures).luma, before.luma)


def test_marks_on_the_road_that_smooth_lorries_hide_for_most_of_the_time_stay():
    ground = road(marked=True)
    lorries = [[(4 * t - 160 * k - 80, 120, (140, 128, 128)) for k in (0, 1)] for t in range(50)]
    pictures = [picture(ground, shown) for shown in lorries]
    before = start(picture(ground))
    assert np.array_equal(patched(before, pictures).luma, before.luma)


def test_the_smooth_side_of_a_lorry_is_not_taken_for_a_marked_road():
    ground = road(marked=True)
    pictures = [picture(ground, [(30, 90, (140, 128, 128))] if t < 30 else ()) for t in range(50)]
    before = start(picture(ground, [(62, 26, CARS[0])]))
    assert off(before, ground).sum() > 500
    assert off(patched(before, pictures), ground).sum() < 50


def test_after_a_change_of_the_whole_light_the_scene_stays():
    ground = road()
    pictures = [picture(ground, queue(t)) for t in range(-20, 30)]
    before = start(picture(ground - 40, queue(0)))
    assert np.array_equal(patched(before, pictures).luma, before.luma)


def test_a_picture_smaller_than_a_patch_has_none():
    tiny = start(Picture(*(np.zeros((side, side), np.uint8) for side in (4, 2, 2))))
    found = patched(tiny, [Picture(*(np.full((side, side), 200, np.uint8) for side in (4, 2, 2)))] * 5)
    assert not found.luma.any()
