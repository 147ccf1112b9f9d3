"""Draws a metric grid on the road, to check a calibration by eye."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.output.draw import Pen
from vidtrack.output.folder import replacing
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.video.frame import Image

_INK, _POINT, _FITTED = (255, 255, 0), (0, 0, 255), (0, 255, 0)
_MOST_LINES = 20
_STEPS_M = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
_SAMPLES = 200


def draw_grid(path: Path, picture: Image, ground: Ground, points: Floats, fitted: Floats) -> float:
    """Write a PNG of the picture (H, W, 3) with a grid where the calibration is valid; returns the grid's step [m].

    points, fitted  (N, 2) [px] calibration points, red, and their positions by the homography, green
    """
    drawn = picture.copy()
    pen = Pen(drawn)
    road = ground.metres(points)
    low, high = road.min(axis=0), road.max(axis=0)
    step = next((step for step in _STEPS_M if (high - low).max() / step <= _MOST_LINES), _STEPS_M[-1])
    for axis in (0, 1):
        for at in np.arange(np.ceil(low[axis] / step), np.floor(high[axis] / step) + 1) * step:
            line = np.empty((_SAMPLES, 2))
            line[:, axis] = at
            line[:, 1 - axis] = np.linspace(low[1 - axis], high[1 - axis], _SAMPLES)
            seen = ground.inside(ground.pixels(line))
            for run in np.split(seen, np.flatnonzero(np.isnan(seen[:, 0]))):
                run = run[np.isfinite(run[:, 0])]
                if len(run) > 1:
                    pen.path(run, _INK)
    for number, (point, there) in enumerate(zip(points, fitted, strict=True), start=1):
        pen.path([point, there], _FITTED, 2)
        cv2.circle(drawn, tuple(int(v) for v in np.rint(point)), 4, _POINT, 1, cv2.LINE_AA)
        pen.label(str(number), float(point[0]) + 5, float(point[1]) - 5, _POINT)
    with replacing(path) as new:
        new.write_bytes(cv2.imencode(".png", drawn)[1].tobytes())
    return step
