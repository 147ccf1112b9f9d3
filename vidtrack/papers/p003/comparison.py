"""The experiment of table 2: a comparison of range filters while the target accelerates with 2.5 g."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from numpy.random import Generator

from vidtrack.arrays.types import Floats
from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.error_signal import ErrorSignalBank
from vidtrack.estimate.fixed_gain import FixedGainBank
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.model import Motion
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.estimate.particle import NO_GLINT, Glint, ParticleBank
from vidtrack.estimate.resampling import Resampling
from vidtrack.estimate.uniform_bins import RANGE_M, UniformBinsBank
from vidtrack.papers.p003.experiment import PARTICLES, TIMES, estimate, mean_and_se, measure, polar
from vidtrack.simulate.radar_scenarios import speed

SIGMA_M, ALPHA_M = 5.0, 25.0
GLINT = Glint(0.1, 5.0)
TOTAL_M = SIGMA_M * sqrt(1 + GLINT.probability * (GLINT.factor**2 - 1))
"""Standard deviation of the errors with glint."""

BEGIN_S, END_S = 10.0, 16.118
WINDOWS = {
    "before": (TIMES >= 3) & (TIMES < BEGIN_S),
    "manoeuvre": (TIMES >= BEGIN_S + 0.5) & (TIMES < END_S),
    "after": TIMES > END_S + 4,
    "all": TIMES > 3,
}

Make = Callable[[Motion, float, int], Estimator]
"""A bank from a motion model, the assumed standard deviation [m] of a measurement, and a seed."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A filter in the comparison.

    name   its name in the paper's table, or another one
    accel  m/s^2, assumed acceleration; None: no motion model
    make   factory of the bank; None: the measurement itself
    sigma  m, assumed standard deviation of a measurement
    """

    name: str
    accel: float | None = None
    make: Make | None = None
    sigma: float = SIGMA_M

    @property
    def title(self) -> str:
        """Name and tuning."""
        return self.name if self.accel is None else f"{self.name}, {self.accel:g} m/s²"


@dataclass(frozen=True, slots=True)
class Comparison:
    """Filters on the same measurements: errors of sigma [m] with or without glint, from an initial range [m]."""

    title: str
    candidates: Sequence[Candidate]
    sigma: float = SIGMA_M
    glint: Glint = NO_GLINT
    from_m: float = 60e3


def _kalman(model: Motion, sigma: float, seed: int) -> Estimator:
    return KalmanBank(model)


def _alpha_beta(model: Motion, sigma: float, seed: int) -> Estimator:
    return FixedGainBank(model, sigma)


def _sis(model: Motion, sigma: float, seed: int) -> Estimator:
    return ParticleBank(model, PARTICLES, resampling=Resampling.NONE, seed=seed)


def _bins(model: Motion, sigma: float, seed: int) -> Estimator:
    return UniformBinsBank(model, [RANGE_M], PARTICLES, seed=seed)


def _sir(glint: Glint = NO_GLINT) -> Make:
    return lambda model, sigma, seed: ErrorSignalBank(model, PARTICLES, alpha=ALPHA_M / sigma, glint=glint, seed=seed)


def _bootstrap(glint: Glint = NO_GLINT) -> Make:
    return lambda model, sigma, seed: ParticleBank(model, PARTICLES, least=0, glint=glint, seed=seed)


RAW = Candidate("measurement")
COMPARISONS = (
    Comparison(
        "normal errors of 5 m",
        (
            RAW,
            Candidate("Kalman", 49, _kalman),
            Candidate("alpha-beta", 49, _alpha_beta),
            Candidate("bootstrap", 49, _bootstrap()),
            Candidate("Kalman", 24.5, _kalman),
            Candidate("bootstrap", 24.5, _bootstrap()),
            Candidate("SIR of fig. 3", 49, _sir()),
            Candidate("SIR of fig. 3", 24.5, _sir()),
            Candidate("SIS of table 1", None, _bins),
            Candidate("Kalman", 2, _kalman),
            Candidate("Kalman", 1, _kalman),
            Candidate("SIS", 24.5, _sis),
        ),
    ),
    Comparison(
        "glint: a tenth of the errors is 25 m",
        (
            RAW,
            Candidate("bootstrap", 49, _bootstrap(GLINT)),
            Candidate("Kalman", 49, _kalman, TOTAL_M),
            Candidate("SIR of fig. 3", 49, _sir(GLINT)),
        ),
        glint=GLINT,
    ),
    Comparison(
        "reconstruction: errors of 3.15 m, from 85 km",
        (
            RAW,
            Candidate("Kalman", 35, _kalman, 3.15),
            Candidate("alpha-beta", 3.24, _alpha_beta, 3.15),
            Candidate("SIS of table 1", None, _bins, 3.15),
            Candidate("Kalman", 1.37, _kalman, 3.15),
        ),
        sigma=3.15,
        from_m=85e3,
    ),
)


def run(comparison: Comparison, runs: int, rng: Generator) -> dict[str, Floats]:
    """Errors (SCANS, runs) [m] of each filter, by title."""
    truth = polar(speed(rng)[0].flight)[:, :1]
    seen = measure(truth + comparison.from_m - truth[0], np.array([comparison.sigma]), runs, rng, comparison.glint)
    errors = {}
    for candidate in comparison.candidates:
        found = seen.z
        if candidate.make:
            bank = candidate.make(
                ConstantVelocity(1, accel=candidate.accel or 1.0), candidate.sigma, int(rng.integers(2**32))
            )
            found = estimate(bank, replace(seen, sigma=np.full(runs, candidate.sigma)), np.ones(runs))
        errors[candidate.title] = found - seen.truth
    return errors


def mean_abs(error: Floats, window: str = "all") -> tuple[float, float]:
    """Mean absolute error in a window, and its standard error over the runs."""
    mean, se = mean_and_se(np.abs(error[WINDOWS[window]]).mean(axis=0))
    return float(mean), float(se)
