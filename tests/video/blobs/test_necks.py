"""Cutting at necks, on drawn regions."""

import cv2
import numpy as np
import pytest

from vidtrack.video.blobs.necks import half_width, parts

NO_BORDER = (0, 0, 0, 0)
ANY = np.ones(2)


def cut(mask, border, neck, least):
    return parts(half_width(mask, border), neck, least)[:2]


def discs(*radii, bar=3, gap=2):
    """Discs side by side, joined by a bar of this width."""
    width, height = 2 * sum(radii) + gap * (len(radii) - 1) + len(radii), 2 * max(radii) + 1
    mask = np.zeros((height, width), np.uint8)
    x, middle, centres = 0, height // 2, []
    for radius in radii:
        centres.append(x + radius)
        cv2.circle(mask, (x + radius, middle), radius, 1, -1)
        x += 2 * radius + 1 + gap
    mask[middle - bar // 2 : middle + (bar + 1) // 2, centres[0] : centres[-1]] = 1
    return mask


@pytest.mark.parametrize("turn", [0, 1])
def test_two_discs_with_a_thin_bar_between_them_are_cut_in_the_middle(turn):
    mask = np.ascontiguousarray(np.rot90(discs(12, 12), turn))
    label, count = cut(mask, NO_BORDER, 0.5, ANY)
    assert count == 2
    np.testing.assert_array_equal(label >= 0, mask > 0)
    sizes = np.bincount(label[label >= 0])
    assert abs(sizes[0] - sizes[1]) < 0.1 * sizes.sum()


@pytest.mark.parametrize("angle", [0, 30, 45, 77])
@pytest.mark.parametrize("axes", [(20, 8), (12, 12), (30, 5)])
def test_an_ellipse_is_one(angle, axes):
    mask = np.zeros((70, 70), np.uint8)
    cv2.ellipse(mask, (35, 35), axes, angle, 0, 360, 1, -1)
    assert cut(mask, NO_BORDER, 0.85, ANY)[1] == 1


@pytest.mark.parametrize("size", [(1, 1), (3, 40), (12, 30), (25, 25)])
def test_a_rectangle_is_one(size):
    assert cut(np.ones(size, np.uint8), NO_BORDER, 0.85, ANY)[1] == 1


def test_a_wide_neck_is_none():
    assert cut(discs(12, 12, bar=18), NO_BORDER, 0.5, ANY)[1] == 1
    assert cut(discs(12, 12, bar=9), NO_BORDER, 0.5, ANY)[1] == 2


@pytest.mark.parametrize(("bar", "told"), [(3, True), (9, False), (15, False), (23, True)])
def test_whether_a_wider_neck_leaves_the_parts_as_they_are_is_told(bar, told):
    depth = half_width(discs(12, 12, bar=bar), NO_BORDER)
    label, count, same = parts(depth, 0.3, ANY, 0.85)
    wider, number, _ = parts(depth, 0.85, ANY)
    assert same == told == (count == number and np.array_equal(label, wider))


def test_a_part_smaller_than_the_least_joins_its_neighbour():
    mask = discs(12, 4, 12)
    assert cut(mask, NO_BORDER, 0.7, ANY)[1] == 3
    label, count = cut(mask, NO_BORDER, 0.7, np.array([15.0, 15.0]))
    assert count == 2
    np.testing.assert_array_equal(label >= 0, mask > 0)
    assert cut(mask, NO_BORDER, 0.7, np.array([60.0, 60.0]))[1] == 1


def test_a_region_goes_on_behind_the_picture_s_border():
    mask = np.ones((60, 20), np.uint8)
    mask[20:40, 6:] = 0
    assert cut(mask, NO_BORDER, 0.5, ANY)[1] == 2
    assert cut(mask, (1, 0, 0, 0), 0.5, ANY)[1] == 1
