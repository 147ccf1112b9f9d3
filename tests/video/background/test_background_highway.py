"""The robust map on a real road with known masks (CDnet 2014, baseline/highway)."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from vidtrack.config.settings import SourceSettings
from vidtrack.config.video import DetectorSettings
from vidtrack.video.background import create
from vidtrack.video.source import open_source

FIRST, LAST = 470, 1085  # image numbers with truth
VEHICLE = 255
NOT_SCORED = (85, 170)  # outside the region of interest, unknown


@pytest.mark.skipif("VIDTRACK_DATA" not in os.environ, reason="VIDTRACK_DATA does not name the folder of real data")
def test_vehicles_of_the_highway_are_found_to_the_pixel():
    folder = Path(os.environ["VIDTRACK_DATA"]) / "highway"
    region = cv2.imread(str(folder / "ROI.bmp"), cv2.IMREAD_GRAYSCALE) > 0
    detector = create(DetectorSettings())
    found = true = both = 0
    with open_source(str(folder / "input"), SourceSettings(fps=25)) as source:
        for frame in source:
            number = frame.index + 1
            if number > LAST:
                break
            mask = detector.apply(frame, np.empty((0, 4))).mask > 0
            if number >= FIRST:
                truth = cv2.imread(str(folder / f"groundtruth/gt{number:06d}.png"), cv2.IMREAD_GRAYSCALE)
                scored = region & ~np.isin(truth, NOT_SCORED)
                found += (mask & scored).sum()
                true += ((truth == VEHICLE) & scored).sum()
                both += (mask & (truth == VEHICLE) & scored).sum()
    assert 2 * both / (found + true) >= 0.95  # F-measure
