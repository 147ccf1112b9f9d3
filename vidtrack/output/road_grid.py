"""Draws a metric grid on the road, to check a calibration by eye."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.output.draw import Pen
from vidtrack.output.folder import replacing
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.calibration.metre_grid import metre_grid
from vidtrack.video.frame import Image

_INK, _POINT, _FITTED = (255, 255, 0), (0, 0, 255), (0, 255, 0)


def draw_grid(path: Path, picture: Image, ground: Ground, points: Floats, fitted: Floats) -> float:
    """Write a PNG of the picture (H, W, 3) with a grid where the calibration is valid; returns the grid's step [m].

    points, fitted  (N, 2) [px] calibration points, red, and their positions by the homography, green
    """
    drawn = picture.copy()
    pen = Pen(drawn)
    step, lines = metre_grid(ground, points)
    for line in lines:
        pen.path(line, _INK)
    for number, (point, there) in enumerate(zip(points, fitted, strict=True), start=1):
        pen.path([point, there], _FITTED, 2)
        cv2.circle(drawn, tuple(int(v) for v in np.rint(point)), 4, _POINT, 1, cv2.LINE_AA)
        pen.label(str(number), float(point[0]) + 5, float(point[1]) - 5, _POINT)
    with replacing(path) as new:
        new.write_bytes(cv2.imencode(".png", drawn)[1].tobytes())
    return step
