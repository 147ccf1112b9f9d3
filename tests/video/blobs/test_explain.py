"""One explanation of every blob: a vehicle, a piece of one, or several."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_tracks import drive, tracks_of

from vidtrack.arrays import affine
from vidtrack.config.video import BlobSettings
from vidtrack.tracking.picture.road import Road
from vidtrack.tracks import TENTATIVE
from vidtrack.video.blobs.explain import explain
from vidtrack.video.foreground import Foreground

SETTINGS = BlobSettings()
NONE = tracks_of(0.0)


@pytest.fixture(scope="module")
def road():
    """320 x 240 px, where vehicles of 40 x 20 px drove."""
    road = Road(320, 240)
    drive(road.learn, lambda y: (40.0, 20.0), vehicles=6)
    assert road.sizes.known
    return road


def foreground(*boxes, step=1, place=None, margin=0):
    mask = np.zeros((240 // step + 2 * margin, 320 // step + 2 * margin), np.uint8)
    for left, top, width, height in boxes:
        mask[margin + top : margin + top + height, margin + left : margin + left + width] = 255
    surveyed = np.array([0.0, 0.0, 320.0, 240.0])
    return Foreground(mask, np.ones(mask.shape, np.float32), step, place=place, surveyed=surveyed)


def found(blobs):
    return sorted(blobs.box.tolist())


def test_a_blob_of_vehicle_size_is_one(road):
    assert found(explain(foreground((100, 100, 42, 21)), NONE, road, SETTINGS)) == [[100, 100, 42, 21]]


def test_two_vehicles_with_a_neck_between_them_are_two(road):
    picture = foreground((100, 100, 38, 20), (142, 100, 38, 20), (138, 108, 4, 3))
    blobs = explain(picture, NONE, road, SETTINGS)
    assert len(blobs) == 2
    assert blobs.area.sum() == np.count_nonzero(picture.mask)
    np.testing.assert_allclose(found(blobs), [[100, 100, 38, 20], [142, 100, 38, 20]], atol=4)
    assert len(explain(picture, NONE, road, BlobSettings(cut=False))) == 1


def test_pieces_that_weak_foreground_links_are_one_vehicle_before_sizes_are_known():
    picture = foreground((100, 100, 40, 8), (110, 84, 12, 6))
    young = Road(320, 240)
    assert len(explain(picture, NONE, young, SETTINGS)) == 2
    linked = replace(picture, weak=foreground((100, 100, 40, 8), (110, 84, 12, 20)).mask)
    assert found(explain(linked, NONE, young, SETTINGS)) == [[100, 84, 40, 24]]
    assert len(explain(linked, NONE, young, BlobSettings(pieces=False))) == 2
    flood = replace(picture, weak=np.full_like(picture.mask, 255))
    assert len(explain(flood, NONE, young, SETTINGS)) == 2


def test_two_vehicles_nose_to_tail_are_divided_among_those_predicted(road):
    picture = foreground((100, 100, 80, 20))
    assert len(explain(picture, NONE, road, SETTINGS)) == 1
    expected = tracks_of(0.0, [[99.0, 100, 40, 20], [139.0, 100, 40, 20]])
    np.testing.assert_allclose(
        found(explain(picture, expected, road, SETTINGS)), [[100, 100, 39, 20], [139, 100, 41, 20]], atol=1
    )
    assert len(explain(picture, expected, road, BlobSettings(divide=False))) == 1


def test_a_lorry_is_not_divided_without_a_neck(road):
    assert len(explain(foreground((80, 90, 100, 35)), NONE, road, SETTINGS)) == 1


LORRY = [(100, 100, 42, 35), (152, 100, 48, 35), (142, 116, 10, 4)]  # it looks like the road where it is narrow


def test_a_neck_of_a_lorry_that_another_touches_does_not_break_it(road):
    picture = foreground(*LORRY, (160, 135, 12, 20))
    alone = explain(picture, tracks_of(0.0, [[100.0, 100, 100, 35]]), road, SETTINGS)
    assert len(alone) > 1
    both = explain(picture, tracks_of(0.0, [[100.0, 100, 100, 35], [159.0, 134, 14, 21]]), road, SETTINGS)
    np.testing.assert_allclose(found(both), [[100, 100, 100, 35], [160, 135, 12, 20]], atol=6)


def test_a_neck_between_two_known_vehicles_is_cut(road):
    picture = foreground((100, 100, 38, 20), (142, 100, 38, 20), (138, 108, 4, 3))
    expected = tracks_of(0.0, [[96.0, 100, 40, 20], [136.0, 100, 40, 20]])
    blobs = explain(picture, expected, road, BlobSettings(divide=False))
    np.testing.assert_allclose(found(blobs), [[100, 100, 38, 20], [142, 100, 38, 20]], atol=4)


def test_pieces_of_a_vehicle_are_one(road):
    assert found(explain(foreground((100, 100, 30, 20), (134, 103, 6, 12)), NONE, road, SETTINGS)) == [
        [100, 100, 40, 20]
    ]


@pytest.mark.parametrize("step", [1, 2])
def test_flakes_of_a_swarm_are_pieces_of_no_vehicle(step):
    snowy = Road(320, 240)
    drive(snowy.learn, lambda y: (40.0, 20.0), vehicles=6)
    whole, falling = [[100, 100, 40, 20]], [[100, 100, 30, 20], [132, 104, 8, 8]]
    shown = foreground(*(tuple(side // step for side in box) for box in falling), step=step)
    assert found(explain(shown, NONE, snowy, SETTINGS)) == whole
    t = float(snowy.swarm._time_s)
    for k in range(50):
        boxes = [[15.0 * i, 200.0, 9.0, 6.0] for i in range(10)]
        snowy.learn(tracks_of(t + k / 10, boxes, status=TENTATIVE, age_s=0.0))
    assert 9 < snowy.flake < 16
    assert found(explain(shown, NONE, snowy, SETTINGS)) == falling


def test_before_a_size_is_known_only_like_parts_of_an_open_shape_are_told_apart():
    apart = foreground((100, 100, 20, 20), (123, 122, 20, 20), (118, 118, 7, 6))
    assert len(explain(apart, NONE, None, SETTINGS)) == 2
    assert len(explain(foreground((100, 100, 80, 20)), NONE, None, SETTINGS)) == 1


@pytest.mark.parametrize("boxes", [[(100, 100, 80, 20)], [(100, 100, 30, 20), (134, 103, 6, 12)], [(0, 100, 70, 20)]])
def test_a_larger_canvas_changes_nothing_but_where_the_mask_begins(road, boxes):
    expected = tracks_of(0.0, [[99.0, 100, 40, 20], [139.0, 100, 40, 20]])
    plain = explain(foreground(*boxes), expected, road, SETTINGS)
    moved = explain(foreground(*boxes, place=affine.shift(-16, -16), margin=16), expected, road, SETTINGS)
    assert found(moved) == found(plain)
    np.testing.assert_allclose(np.sort(moved.centroid, axis=0), np.sort(plain.centroid, axis=0))


def test_half_the_size_tells_the_same(road):
    expected = tracks_of(0.0, [[100.0, 100, 40, 20], [140.0, 100, 40, 20]])
    fine = explain(foreground((100, 100, 80, 20)), expected, road, SETTINGS)
    coarse = explain(foreground((50, 50, 40, 10), step=2), expected, road, SETTINGS)
    assert found(coarse) == found(fine)
