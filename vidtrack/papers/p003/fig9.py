"""Figure 9: an altitude manoeuvre; range, azimuth and elevation by particle and Kalman filters."""

from __future__ import annotations

import numpy as np

from vidtrack.papers.p003.drawing import time_figure, time_rows
from vidtrack.papers.p003.experiment import RUNS
from vidtrack.papers.p003.fig7 import CLAIM, verdict
from vidtrack.papers.p003.scenario import study
from vidtrack.papers.result import Result
from vidtrack.simulate.radar_scenarios import altitude


def reproduce(runs: int | None, seed: int) -> Result:
    """Run all filters on the same measurements."""
    rng = np.random.default_rng(seed)
    each = study(altitude(rng)[0].flight, RUNS if runs is None else runs, rng)
    return Result(time_figure(each), time_rows(each, CLAIM), verdict(each))
