"""The paper's disturbance map, against numbers computed independently (paper 004, its stop-line clip redrawn)."""

from __future__ import annotations

import numpy as np
import pytest

from vidtrack.config.video import BlobSettings, DetectorSettings
from vidtrack.video.background import create
from vidtrack.video.blobs.blobs import find_blobs
from vidtrack.video.frame import Frame

NONE_KNOWN = np.empty((0, 4))
STOP_LINE = [120.0, 108.5, 90]

# What a bar of 200, three wide, moving one pixel a frame to the right over a road of 100, leaves in D = I - A.
D_OF_A_MOVING_BAR = [
    [100, 100, 100, 0, 0, 0],
    [-10, 90, 90, 100, 0, 0],
    [-9, -19, 81, 90, 100, 0],
    [-8.1, -17.1, -27.1, 81, 90, 100],
    [-7.29, -15.39, -24.39, -27.1, 81, 90],
    [-6.561, -13.851, -21.951, -24.39, -27.1, 81],
    [-5.9049, -12.4659, -19.7559, -21.951, -24.39, -27.1],
    [-5.31441, -11.21931, -17.78031, -19.7559, -21.951, -24.39],
]

# Centroid x, y and area of the blobs of the stop-line clip, by frame.
ONE_SIDED = {
    10: [[222.5, 108.5, 612]],
    20: [[192.0, 108.5, 594]],
    30: [[162.0, 108.5, 594], [231.5, 108.5, 288]],
    40: [[116.5, 108.5, 36], [135.5, 108.5, 468], [213.5, 108.5, 720]],
    45: [[109.0, 108.5, 306], [128.0, 108.5, 198], [198.5, 108.5, 720]],
    50: [[101.5, 108.5, 576], [183.5, 108.5, 720]],
    55: [[87.0, 108.5, 594], [120.0, 108.5, 90], [168.5, 108.5, 720]],
    60: [[72.0, 108.5, 594], [120.0, 108.5, 90], [153.5, 108.5, 720]],
    70: [[42.0, 108.5, 594], [110.5, 108.5, 252], [133.0, 108.5, 378]],
}
TWO_SIDED = {
    10: [[222.5, 108.5, 612]],
    20: [[192.0, 108.5, 594], [227.5, 108.5, 432]],
    30: [[162.0, 108.5, 594], [197.5, 108.5, 432], [231.5, 108.5, 288]],
    40: [[132.0, 108.5, 594], [167.5, 108.5, 432], [216.5, 108.5, 828]],
    45: [[117.0, 108.5, 594], [152.5, 108.5, 432], [209.0, 108.5, 1098]],
    50: [[103.5, 108.5, 648], [137.5, 108.5, 432], [201.5, 108.5, 1368]],
    55: [[87.0, 108.5, 594], [122.5, 108.5, 432], [194.0, 108.5, 1638]],
    60: [[72.0, 108.5, 594], [109.0, 108.5, 486], [179.0, 108.5, 1638]],
    70: [[42.0, 108.5, 594], [77.5, 108.5, 432], [110.5, 108.5, 252], [158.5, 108.5, 1296]],
}


def paper(two_sided):
    return create(DetectorSettings.model_validate({"kind": "paper", "paper": {"two_sided": two_sided}}))


def grey(k, picture):
    return Frame(k, k / 15, np.asarray(picture, np.uint8), full_range=True)


def stop_line_clip(frames):
    """A road of 90 with a stop line of 220, first empty; a grey car crosses it from the right, a white one follows."""
    for k in range(-1, frames):
        picture = np.full((180, 240), 90)
        picture[84:136, 118:123] = 220
        cars = ((236 - 3 * k, 150), (236 - 3 * (k - 26), 235)) if k >= 0 else ()
        for left, level in cars:
            picture[100:118, max(left, 0) : max(left + 40, 0)] = level
        yield grey(k, picture)


def test_differences_from_the_average_of_previous_frames_are_exact():
    both, brighter = paper(True), paper(False)
    for detector in (both, brighter):
        assert not detector.apply(
            grey(0, np.full((1, 6), 100)), NONE_KNOWN
        ).mask.any()  # the first frame is the average
    for k, expected in enumerate(D_OF_A_MOVING_BAR):
        bar = np.full((1, 6), 100)
        bar[0, k : k + 3] = 200
        frame = grey(k + 1, bar)
        magnitude, positive = (detector.apply(frame, NONE_KNOWN).strength[0] * 20 for detector in (both, brighter))
        D = 2 * positive - magnitude
        np.testing.assert_allclose(D, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("two_sided", "expected"), [(False, ONE_SIDED), (True, TWO_SIDED)])
def test_blobs_of_the_stop_line_clip_are_exact(two_sided, expected):
    detector = paper(two_sided)
    for k, frame in enumerate(stop_line_clip(71), start=-1):
        foreground = detector.apply(frame, NONE_KNOWN)
        if k in expected:
            blobs = find_blobs(foreground, BlobSettings(min_area_share=0))
            found = np.column_stack([blobs.centroid, blobs.area])
            np.testing.assert_allclose(found[np.argsort(found[:, 0])], expected[k], rtol=1e-9)


def test_the_uncovered_stop_line_is_a_ghost_as_long_as_the_formula_says():
    detector, ghost_frames = paper(False), []
    for k, frame in enumerate(stop_line_clip(65), start=-1):
        blobs = find_blobs(detector.apply(frame, NONE_KNOWN), BlobSettings(min_area_share=0))
        found = np.column_stack([blobs.centroid, blobs.area])
        if len(found) and (np.abs(found - STOP_LINE) < 1e-9).all(axis=1).any():
            ghost_frames.append(k)
    covered_frames, contrast, weight, threshold = 13, 220 - 150, 0.1, 20
    first = contrast * (1 - (1 - weight) ** covered_frames)
    assert ghost_frames == list(range(53, 62))
    assert abs(len(ghost_frames) - np.log(first / threshold) / -np.log(1 - weight)) < 1


def test_full_size_luminance_is_used_whatever_the_colour():
    y = np.full((40, 60), 100, np.uint8)
    chroma = np.full((20, 30), 128, np.uint8)
    detector = paper(True)
    detector.apply(Frame(0, 0.0, y, chroma, chroma), NONE_KNOWN)
    assert not detector.apply(Frame(1, 0.1, y, chroma + 60, chroma), NONE_KNOWN).mask.any()
