"""The filters of a detector's picture, against the same written in the slow and obvious way."""

from __future__ import annotations

from typing import get_args

import cv2
import numpy as np
import pytest

from vidtrack.config.names import Detector
from vidtrack.config.video import DetectorSettings
from vidtrack.video.background import create
from vidtrack.video.background.filters import LARGEST_STEP, area_average, smoothed
from vidtrack.video.frame import Frame


def noise(shape, seed=1):
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)


@pytest.mark.parametrize("step", [1, 2, 3, 4, 7])
def test_reduced_pixels_are_means_with_halves_rounded_up(step):
    plane = noise((61, 83))
    h, w = 61 // step, 83 // step
    windows = plane[: h * step, : w * step].reshape(h, step, w, step)
    assert (area_average(plane, (h, w), step) == np.floor(windows.mean(axis=(1, 3)) + 0.5)).all()


def test_planes_of_padded_rows_and_strides_are_reduced_alike():
    padded = noise((60, 96))
    padded.flags.writeable = False
    for plane in (padded[:, :80], padded[::2, ::2]):
        shape = plane.shape[0] // 2, plane.shape[1] // 2
        assert (area_average(plane, shape, 2) == area_average(plane.copy(), shape, 2)).all()


def test_the_largest_step_still_adds_up():
    white = np.full((LARGEST_STEP, 2 * LARGEST_STEP), 255, np.uint8)
    assert area_average(white, (1, 2), LARGEST_STEP).tolist() == [[255, 255]]


@pytest.mark.parametrize("shape", [(48, 64), (37, 51), (1, 9), (7, 1), (1, 1)])
def test_smoothing_is_that_of_opencv(shape):
    plane = noise(shape)
    assert (smoothed(plane) == cv2.GaussianBlur(plane, (3, 3), 0)).all()


@pytest.mark.parametrize("kind", get_args(Detector))
@pytest.mark.parametrize("shape", [(2, 3), (5, 400), (9, 9)])
def test_a_picture_smaller_than_the_step_is_reduced_as_far_as_it_goes(kind, shape):
    detector = create(DetectorSettings(kind=kind), scale=0.01)
    half = noise(((shape[0] + 1) // 2, (shape[1] + 1) // 2))
    foreground = detector.apply(Frame(0, 0.0, noise(shape), half, half), np.empty((0, 4)))
    assert min(foreground.mask.shape) >= 2
    assert foreground.full_size(shape).shape == shape
