"""The experiment of table 2: filters of the range in a contest, while the target speeds up with 2.5 g."""

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
"""A bank from a motion model, the standard deviation [m] that it is told, and a seed."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A filter in the contest.

    name   as the paper's table calls its kind, or what else it is
    accel  m/s^2 that it is told; None: it knows no motion
    make   None: the measurement as it is
    sigma  m, standard deviation of a measurement that it is told
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
class Contest:
    """Entries on measurements of one kind: errors of sigma [m] with or without glint, target from a range [m] on."""

    title: str
    entries: Sequence[Entry]
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
    return lambda model, sigma, seed: ParticleBank(model, PARTICLES, glint=glint, seed=seed)


RAW = Entry("measurement")
CONTESTS = (
    Contest(
        "normal errors of 5 m",
        (
            RAW,
            Entry("Kalman", 49, _kalman),
            Entry("alpha-beta", 49, _alpha_beta),
            Entry("bootstrap", 49, _bootstrap()),
            Entry("Kalman", 24.5, _kalman),
            Entry("bootstrap", 24.5, _bootstrap()),
            Entry("SIR of fig. 3", 49, _sir()),
            Entry("SIR of fig. 3", 24.5, _sir()),
            Entry("SIS of table 1", None, _bins),
            Entry("Kalman", 2, _kalman),
            Entry("Kalman", 1, _kalman),
            Entry("SIS", 24.5, _sis),
        ),
    ),
    Contest(
        "glint: a tenth of the errors is 25 m",
        (
            RAW,
            Entry("bootstrap", 49, _bootstrap(GLINT)),
            Entry("Kalman", 49, _kalman, TOTAL_M),
            Entry("SIR of fig. 3", 49, _sir(GLINT)),
        ),
        glint=GLINT,
    ),
    Contest(
        "reconstruction: errors of 3.15 m, from 85 km",
        (
            RAW,
            Entry("Kalman", 35, _kalman, 3.15),
            Entry("alpha-beta", 3.24, _alpha_beta, 3.15),
            Entry("SIS of table 1", None, _bins, 3.15),
            Entry("Kalman", 1.37, _kalman, 3.15),
        ),
        sigma=3.15,
        from_m=85e3,
    ),
)


def run(contest: Contest, runs: int, rng: Generator) -> dict[str, Floats]:
    """Errors (SCANS, runs) [m] of each entry, by title."""
    truth = polar(speed(rng)[0].flight)[:, :1]
    seen = measure(truth + contest.from_m - truth[0], np.array([contest.sigma]), runs, rng, contest.glint)
    errors = {}
    for entry in contest.entries:
        found = seen.z
        if entry.make:
            bank = entry.make(ConstantVelocity(1, accel=entry.accel or 1.0), entry.sigma, int(rng.integers(2**32)))
            found = estimate(bank, replace(seen, sigma=np.full(runs, entry.sigma)), np.ones(runs))
        errors[entry.title] = found - seen.truth
    return errors


def mean_abs(error: Floats, window: str = "all") -> tuple[float, float]:
    """Mean absolute error in a window, and its standard error over the runs."""
    mean, se = mean_and_se(np.abs(error[WINDOWS[window]]).mean(axis=0))
    return float(mean), float(se)
