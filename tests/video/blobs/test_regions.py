"""Regions of a mask: cutting and joining lose no pixel."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.config.video import BlobSettings
from vidtrack.video.blobs.blobs import measured
from vidtrack.video.blobs.regions import Regions, find_regions, of_labels, patch
from vidtrack.video.foreground import Foreground


@st.composite
def masks(draw):
    shape = draw(st.integers(1, 24)), draw(st.integers(1, 24))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return (rng.random(shape) < draw(st.floats(0.1, 0.9))).astype(np.uint8)


def drawn(regions, shape):
    """(h, w) number of each pixel's region, -1 for none; fails where runs overlap."""
    picture = np.full(shape, -1)
    for row, start, stop, label in zip(*regions[:4], strict=True):
        assert (picture[row, start:stop] == -1).all()
        picture[row, start:stop] = label
    return picture


@settings(max_examples=50)
@given(masks())
def test_regions_hold_the_mask_and_their_boxes_and_areas_are_its(mask):
    regions = find_regions(mask, 0)
    picture = drawn(regions, mask.shape)
    np.testing.assert_array_equal(picture >= 0, mask > 0)
    for i, ((left, top, width, height), area) in enumerate(zip(regions.boxes(), regions.areas(), strict=True)):
        rows, columns = np.nonzero(picture == i)
        assert (columns.min(), rows.min()) == (left, top)
        assert (np.ptp(columns) + 1, np.ptp(rows) + 1) == (width, height)
        assert len(rows) == area


@settings(max_examples=50)
@given(masks(), st.integers(0, 2**32 - 1))
def test_a_region_parted_and_joined_again_is_the_same(mask, seed):
    regions = find_regions(mask, 0)
    if not regions.total:
        return
    rng = np.random.default_rng(seed)
    region = int(rng.integers(regions.total))
    box = regions.boxes()[region]
    inside = patch(regions, region, box)
    assert inside.sum() == regions.areas()[region]

    numbers = np.where(inside, rng.integers(0, 3, inside.shape), -1)
    used, numbers[inside > 0] = np.unique(numbers[inside > 0], return_inverse=True)
    parted = regions.parted(region, of_labels(numbers, len(used), box))
    picture = drawn(parted, mask.shape)
    left, top, width, height = box
    cut = picture[top : top + height, left : left + width]
    new = np.array([region, *range(regions.total, parted.total)])
    np.testing.assert_array_equal(cut[inside > 0], new[numbers[inside > 0]])

    group = np.append(np.arange(regions.total), np.full(len(used) - 1, region))
    np.testing.assert_array_equal(drawn(parted.joined(group, regions.total), mask.shape), drawn(regions, mask.shape))


@settings(max_examples=50)
@given(masks(), st.integers(1, 4))
def test_moments_of_joined_regions_are_those_of_their_pixels(mask, groups):
    regions = find_regions(mask, 0)
    groups = min(groups, regions.total)
    joined = regions.joined(np.arange(regions.total) % max(groups, 1), groups)
    strength = np.arange(mask.size, dtype=np.float32).reshape(mask.shape)
    blobs = measured(joined, Foreground(mask, strength, 1), BlobSettings())
    picture = drawn(joined, mask.shape)
    for i in range(groups):
        rows, columns = np.nonzero(picture == i)
        np.testing.assert_allclose(blobs.centroid[i], [columns.mean(), rows.mean()])
        cov = np.cov(np.stack([columns, rows]), bias=True) + np.eye(2) / 12
        np.testing.assert_allclose(blobs.cov[i], cov, atol=1e-9)
        assert blobs.area[i] == len(rows)
        assert blobs.amplitude[i] == pytest.approx(strength[rows, columns].mean())


def test_small_regions_are_left_out_and_the_others_numbered_without_gaps():
    mask = np.zeros((10, 20), np.uint8)
    mask[1, 1], mask[2:6, 4:8], mask[8:10, 15:20] = 1, 1, 1
    regions = find_regions(mask, 5)
    assert regions.boxes().tolist() == [[4, 2, 4, 4], [15, 8, 5, 2]]
    assert isinstance(regions.without(0), Regions)
    assert regions.without(0).areas().tolist() == [0, 10]
