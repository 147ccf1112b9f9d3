"""Connected regions and their moments, against OpenCV and against numbers by hand."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.config.video import BlobSettings
from vidtrack.video.blobs.blobs import find_blobs, measured
from vidtrack.video.blobs.fragments import together
from vidtrack.video.blobs.regions import find_regions
from vidtrack.video.foreground import Foreground

EVERY = BlobSettings(min_area_share=0)
JOIN = BlobSettings(min_area_share=0, join_gap=0.3)


def foreground(mask, step=1, strength=None):
    mask = np.asarray(mask, np.uint8) * np.uint8(255)
    return Foreground(mask, np.ones(mask.shape, np.float32) if strength is None else strength, step)


def painted(*boxes, shape=(60, 80), step=1):
    """Foreground of filled boxes (left, top, width, height) in mask pixels."""
    mask = np.zeros(shape, np.uint8)
    for left, top, width, height in boxes:
        mask[top : top + height, left : left + width] = 1
    return foreground(mask, step)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 50), st.integers(1, 70), st.floats(0, 1), st.integers(0, 2**32 - 1))
def test_components_are_those_of_opencv(h, w, density, seed):
    mask = np.random.default_rng(seed).random((h, w)) < density
    count, _, stats, centroids = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    blobs = find_blobs(foreground(mask), EVERY)
    assert len(blobs) == count - 1
    ours = np.column_stack([blobs.box, blobs.area, blobs.centroid])
    theirs = np.column_stack([stats[1:], centroids[1:]])
    np.testing.assert_allclose(ours[np.lexsort(ours.T)], theirs[np.lexsort(theirs.T)], rtol=1e-12)


def test_a_box_has_the_moments_of_a_box():
    blobs = find_blobs(painted((10, 20, 12, 6), step=2), EVERY)
    assert blobs.box.tolist() == [[20, 40, 24, 12]]
    assert blobs.area.tolist() == [24 * 12]
    np.testing.assert_allclose(blobs.centroid, [[20 + 11.5, 40 + 5.5]])
    np.testing.assert_allclose(blobs.cov, [np.diag([24**2 / 12, 12**2 / 12])], atol=1e-9)


def test_moments_are_the_same_at_any_step():
    mask = np.random.default_rng(3).random((40, 50)) < 0.6
    coarse = find_blobs(foreground(mask, step=3), EVERY)
    fine = find_blobs(foreground(mask.repeat(3, axis=0).repeat(3, axis=1)), EVERY)
    big, same = coarse.area.argmax(), fine.area.argmax()
    for name in ("centroid", "cov", "box", "area", "amplitude"):
        np.testing.assert_allclose(getattr(coarse, name)[big], getattr(fine, name)[same], rtol=1e-9)


def test_amplitude_is_the_mean_strength():
    strength = np.zeros((60, 80), np.float32)
    strength[20:26, 10:16] = 2
    strength[20:26, 16:22] = 4
    mask = painted((10, 20, 12, 6)).mask
    assert find_blobs(Foreground(mask, strength, 1), EVERY).amplitude.tolist() == [3]


def test_a_look_is_the_mean_luminance_and_chroma_of_the_region():
    mask = painted((10, 10, 20, 8), (40, 30, 8, 12))
    random = np.random.default_rng(0)
    luma = random.integers(0, 255, mask.mask.shape, np.uint8)
    cb, cr = random.integers(0, 255, (2, *(side // 2 for side in luma.shape)), np.uint8)
    mask.planes = luma, cb, cr
    blobs = find_blobs(mask, BlobSettings())
    label = cv2.connectedComponents(mask.mask)[1]
    whole = [luma, *(plane.repeat(2, axis=0).repeat(2, axis=1) for plane in (cb, cr))]
    np.testing.assert_allclose(blobs.look, [[plane[label == i + 1].mean() for plane in whole] for i in range(2)])
    mask.planes = luma, cb[:0], cr[:0]
    np.testing.assert_array_equal(find_blobs(mask, BlobSettings()).look[:, 1:], 128.0)


def test_specks_are_left_out_and_a_far_vehicle_is_not():
    blobs = find_blobs(painted((5, 5, 2, 2), (100, 50, 6, 5), shape=(240, 320)), BlobSettings())
    assert blobs.box.tolist() == [[100, 50, 6, 5]]


def test_an_empty_mask_is_an_empty_scan():
    scan = find_blobs(painted(), BlobSettings()).scan(1.5)
    assert len(scan) == 0
    assert scan.t == 1.5


def test_a_scan_has_centroids_relative_boxes_and_noise_along_the_extent():
    scan = find_blobs(painted((10, 20, 40, 6)), BlobSettings(jitter_px=0.5, jitter_share=0.1)).scan(0.2)
    np.testing.assert_allclose(scan.z, [[29.5, 22.5]])
    np.testing.assert_allclose(scan.box, [[-19.5, -2.5, 40, 6]])
    np.testing.assert_allclose(scan.R, [np.diag([0.25 + 0.01 * 1600 / 12, 0.25 + 0.01 * 36 / 12])])
    np.testing.assert_allclose(scan.lasting, [np.diag([0.01 * 1600 / 12, 0.01 * 36 / 12])])
    np.testing.assert_allclose(scan.amplitude, [1])


def joined(foreground, predicted, settings=JOIN):
    """Blobs whose pieces are joined inside predicted boxes, where no size is typical."""
    regions = find_regions(foreground.mask, 0)
    box, unknown = regions.boxes().astype(float), np.full((regions.total, 2), np.nan)
    group, count = together(
        box, regions.areas().astype(float), np.arange(regions.total),
        np.asarray(predicted, float).reshape(-1, 4), unknown, 0.0, True,
        settings.join_overlap, settings.join_gap,
    )  # fmt: skip
    return measured(regions.joined(group, count), foreground, settings)


def test_fragments_of_one_predicted_vehicle_become_one():
    parts = painted((10, 10, 8, 12), (20, 11, 8, 10), (60, 40, 6, 6))
    blobs = joined(parts, [[9, 9, 22, 14]])
    assert sorted(blobs.box.tolist()) == [[10, 10, 18, 12], [60, 40, 6, 6]]
    rows, columns = np.nonzero(parts.mask[:, :40])
    vehicle = blobs.box[:, 0].argmin()
    np.testing.assert_allclose(blobs.centroid[vehicle], [columns.mean(), rows.mean()])
    pixels = np.cov(np.stack([columns, rows]), bias=True)
    np.testing.assert_allclose(blobs.cov[vehicle], pixels + np.eye(2) / 12, atol=1e-9)
    assert blobs.area[vehicle] == len(rows)
    assert blobs.amplitude[vehicle] == pytest.approx(1)


def test_fragments_of_two_vehicles_are_not_mixed():
    parts = painted((10, 10, 8, 5), (10, 17, 8, 5), (40, 10, 8, 5), (40, 17, 8, 5))
    blobs = joined(parts, [[9, 9, 10, 14], [39, 9, 10, 14]])
    assert sorted(blobs.box.tolist()) == [[10, 10, 8, 12], [40, 10, 8, 12]]


def test_pieces_far_apart_in_one_predicted_box_are_not_joined():
    assert len(joined(painted((10, 10, 8, 12), (20, 11, 8, 10)), [[9, 9, 22, 14]], EVERY)) == 2


@pytest.mark.parametrize("predicted", [[], [[50, 50, 5, 5]]])
def test_without_a_vehicle_near_nothing_is_joined(predicted):
    assert len(joined(painted((10, 10, 8, 5), (10, 17, 8, 5)), predicted)) == 2


def test_full_size_masks_repeat_pixels_up_to_the_source_s_edge():
    mask = painted((0, 0, 1, 1), (4, 2, 1, 1), shape=(3, 5), step=2).full_size((7, 11))
    assert mask.shape == (7, 11)
    assert (mask[:2, :2] == 255).all()
    assert (mask[4:, 8:] == 255).all()
    assert (mask > 0).sum() == 4 + 9
