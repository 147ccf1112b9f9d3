"""Common parts of the experiments: range, azimuth and elevation, filtered separately, 7.7 scans/s for 30 s.

The paper gives neither measurement errors nor the tuning of its filters. Sigma 5 m and 0.04 degrees are our choice, and
the acceleration that a filter assumes is part of its name.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from vidtrack.arrays.types import Floats
from vidtrack.decision import Decision
from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.estimate.particle import NO_GLINT, Glint
from vidtrack.estimate.sensor import POSITION
from vidtrack.scan import Scan
from vidtrack.simulate.flight import Flight
from vidtrack.simulate.radar_scenarios import MULTIFUNCTION

RUNS = 100
SCANS = 232
PARTICLES = 2000
SCAN_S = MULTIFUNCTION.scan_s
TIMES: Floats = SCAN_S * np.arange(SCANS, dtype=float)
SETTLED = TIMES > 3.0

MODEL = ConstantVelocity(1, accel=1.0)
"""A channel's state is its value and rate; a row's scale is the acceleration that its filter assumes."""


@dataclass(frozen=True, slots=True, eq=False)
class Channels:
    """Channels as rows: truth (SCANS, rows), measurements z (SCANS, rows), their standard deviations sigma (rows,)."""

    truth: Floats
    z: Floats
    sigma: Floats


def polar(flight: Flight) -> Floats:
    """(SCANS, 3) true range [m], unwrapped azimuth [deg], elevation [deg]."""
    measured = MULTIFUNCTION.measures(flight(TIMES)[0])
    azimuth = np.degrees(np.unwrap(np.radians(measured[:, 1])))
    return np.column_stack([measured[:, 0], azimuth, measured[:, 2]])


def measure(truth: Floats, sigma: Floats, runs: int, rng: Generator, glint: Glint = NO_GLINT) -> Channels:
    """Runs of channels truth (SCANS, channels) with errors of sigma (channels,); rows are channels within runs."""
    truth, sigma = np.tile(truth, runs), np.tile(sigma, runs)
    error = sigma * rng.standard_normal(truth.shape)
    error *= np.where(rng.random(truth.shape) < glint.probability, glint.factor, 1.0)
    return Channels(truth, truth + error, sigma)


def estimate(bank: Estimator, seen: Channels, accel: Floats) -> Floats:
    """(SCANS, rows) estimates of a bank initialised from two measurements; accel (rows,) that it assumes."""
    z, rows = seen.z, len(seen.sigma)
    R = (seen.sigma**2)[:, None, None]
    start = np.column_stack([z[1], (z[1] - z[0]) / SCAN_S])
    bank.insert(start, R * np.array([[1, 1 / SCAN_S], [1 / SCAN_S, 2 / SCAN_S**2]]), accel)
    everyone = np.arange(rows)
    certain = Decision(everyone, everyone, everyone, np.ones(rows), np.zeros(rows))
    found = z.copy()
    for k in range(2, SCANS):
        bank.predict(SCAN_S)
        bank.update(certain, Scan(TIMES[k], z[k][:, None], R), POSITION)
        found[k] = bank.x[:, 0]
    return found


def mean_and_se(of_runs: Floats) -> tuple[Floats, Floats]:
    """Mean over the last axis and its standard error; zero for a single run."""
    runs = of_runs.shape[-1]
    return of_runs.mean(axis=-1), of_runs.std(axis=-1, ddof=min(1, runs - 1)) / np.sqrt(runs)
