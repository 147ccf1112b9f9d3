"""A metric grid on the road as it is seen in the picture, to check a calibration by eye."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.traffic.calibration.ground import Ground

_MOST_LINES = 20
_STEPS_M = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
_SAMPLES = 200


def metre_grid(ground: Ground, points: Floats) -> tuple[float, list[Floats]]:
    """The grid's step [m], and its lines (N, 2) [px] where the calibration is valid.

    points  (N, 2) [px] of the calibration; the grid reaches as far as they do
    """
    road = ground.metres(points)
    low, high = road.min(axis=0), road.max(axis=0)
    step = next((step for step in _STEPS_M if (high - low).max() / step <= _MOST_LINES), _STEPS_M[-1])
    lines = []
    for axis in (0, 1):
        for at in np.arange(np.ceil(low[axis] / step), np.floor(high[axis] / step) + 1) * step:
            line = np.empty((_SAMPLES, 2))
            line[:, axis] = at
            line[:, 1 - axis] = np.linspace(low[1 - axis], high[1 - axis], _SAMPLES)
            seen = ground.inside(ground.pixels(line))
            runs = (run[np.isfinite(run[:, 0])] for run in np.split(seen, np.flatnonzero(np.isnan(seen[:, 0]))))
            lines += [run for run in runs if len(run) > 1]
    return step, lines
