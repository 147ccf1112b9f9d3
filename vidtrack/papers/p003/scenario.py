"""The experiment of figures 7 to 10: Kalman and particle filters on the three channels of a flight."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from vidtrack.arrays.types import Floats
from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.error_signal import ErrorSignalBank
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.particle import ParticleBank
from vidtrack.papers import style
from vidtrack.papers.p003.experiment import MODEL, PARTICLES, SCAN_S, SCANS, SETTLED, estimate, measure, polar
from vidtrack.simulate.flight import Flight
from vidtrack.simulate.radar_scenarios import MULTIFUNCTION

CHANNELS = ("range", "azimuth", "elevation")
UNITS = ("m", "deg", "deg")
INDEX = 0.02
"""Tracking index accel dt^2 / sigma of a filter for a channel with little acceleration."""

TOLD = 0.1
"""Acceleration of an under-tuned filter as a share of the right one."""


@dataclass(frozen=True, slots=True)
class Way:
    """A filter.

    bank   factory of the bank from a seed; None: the measurement itself
    knows  assumed share of the channel's acceleration
    line   line style
    """

    name: str
    colour: str
    bank: Callable[[int], Estimator] | None
    knows: float = 1.0
    line: str = "-"


WAYS = (
    Way("measurement", style.GREY, None),
    Way("Kalman, told a tenth", style.ORANGE, lambda seed: KalmanBank(MODEL), TOLD),
    Way("Kalman, tuned", style.BLUE, lambda seed: KalmanBank(MODEL)),
    Way(
        "particles, bootstrap", style.GREEN, lambda seed: ParticleBank(MODEL, PARTICLES, least=0, seed=seed), line="--"
    ),
    Way("particles, the paper's", style.RED, lambda seed: ErrorSignalBank(MODEL, PARTICLES, seed=seed)),
)


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """Errors (SCANS, runs, 3) of each filter, by name, and the accelerations (3,) of the tuned filters."""

    error: dict[str, Floats]
    accel: Floats

    def mean_abs(self, name: str, channel: int) -> float:
        """Mean absolute error of all runs after the first three seconds."""
        return float(np.abs(self.error[name][SETTLED, :, channel]).mean())

    def half_width(self, name: str, channel: int) -> float:
        """95th percentile of a channel's absolute errors after the first three seconds."""
        return float(np.quantile(np.abs(self.error[name][SETTLED, :, channel]), 0.95))


def study(flight: Flight, runs: int, rng: Generator) -> Study:
    """Run all filters on the same measurements of a flight.

    Tuned filters assume each channel's largest acceleration; in the altitude manoeuvre that is the initial jump of the
    climb rate, spread over three scans.
    """
    truth, sigma = polar(flight), np.array(MULTIFUNCTION.sigma)
    largest = np.abs(np.gradient(np.gradient(truth, SCAN_S, axis=0), SCAN_S, axis=0)).max(axis=0)
    accel = np.maximum(largest, INDEX * sigma / SCAN_S**2)
    seen = measure(truth, sigma, runs, rng)
    error = {}
    for way in WAYS:
        found = seen.z
        if way.bank:
            found = estimate(way.bank(int(rng.integers(2**32))), seen, np.tile(way.knows * accel, runs))
        error[way.name] = (found - seen.truth).reshape(SCANS, runs, len(sigma))
    return Study(error, accel)
