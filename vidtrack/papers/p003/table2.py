"""Table 2: mean range error while the target speeds up with 2.5 g, by filter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.random import Generator

from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.error_signal import ErrorSignalBank
from vidtrack.estimate.fixed_gain import FixedGainBank
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion import ConstantVelocity
from vidtrack.estimate.particle import NO_GLINT, Glint, ParticleBank
from vidtrack.estimate.resampling import Resampling
from vidtrack.estimate.uniform_bins import RANGE_M, UniformBinsBank
from vidtrack.papers import style
from vidtrack.papers.p003.experiment import (
    MODEL,
    PARTICLES,
    RUNS,
    SCANS,
    TIMES,
    Channels,
    estimate,
    mean_and_se,
    measure,
    polar,
)
from vidtrack.papers.result import Result, Row
from vidtrack.scan import Floats
from vidtrack.simulate.radar_scenarios import speed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIGMA_M, GLINT = 5.0, Glint(0.1, 5.0)
ALPHA_M = 25.0
TOTAL_M = SIGMA_M * float(np.sqrt(1 + GLINT.probability * (GLINT.factor**2 - 1)))
"""Standard deviation of the errors with glint."""

BEGIN_S, END_S = 10.0, 16.118
WINDOWS = {
    "before": (TIMES >= 3) & (TIMES < BEGIN_S),
    "manoeuvre": (TIMES >= BEGIN_S + 0.5) & (TIMES < END_S),
    "after": TIMES > END_S + 4,
    "all": TIMES > 3,
}
RECONSTRUCTED_SIGMA_M, RECONSTRUCTED_RANGE_M = 3.15, 85e3
