"""Monte Carlo simulation of single targets in clutter: thousands of runs as one bank of filters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.amplitude.reduction import gated
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.gate import Gate
from vidtrack.associate.hard import Associator
from vidtrack.associate.problem import Problem
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.sensor import POSITION
from vidtrack.radar.performance.in_gate import AllPlots, Gates, StrongestPlot
from vidtrack.radar.performance.prediction import Scenario, position_error

BLOCK = 1000
"""Runs per block; bounds the memory for clutter."""

LAST_SCANS = 5


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """Result of the runs.

    error     (scans, runs) distance of the estimate from the truth after each update
    expected  (scans, runs) the filter's own root mean square position error
    p_fa      (scans, runs)
    outside   (runs,) number of last scans in a row with the target's measurement outside the gate
    """

    error: Floats
    expected: Floats
    p_fa: Floats
    outside: Ints

    def lost(self, limit: float) -> Mask:
        """(runs,) error above `limit` at the end, or target outside the gate in the last five scans."""
        return np.asarray((self.error[-1] > limit) | (self.outside >= LAST_SCANS))

    def strayed(self, limit: float) -> Mask:
        """(runs,) error above `limit` in any scan."""
        return np.asarray((self.error > limit).any(axis=0))


def root_mean_square(error: Floats) -> tuple[Floats, Floats]:
    """(scans,) RMS of error (scans, runs) over the runs, and its standard error; NaN without runs."""
    if not error.shape[1]:
        return np.full(len(error), np.nan), np.full(len(error), np.nan)
    square = error**2
    rms = np.sqrt(square.mean(axis=1))
    return rms, square.std(axis=1) / (2 * rms * np.sqrt(error.shape[1]))


def simulate(
    scenario: Scenario,
    radar: AllPlots | StrongestPlot,
    associate: Associator,
    *,
    scans: int,
    runs: int,
    rng: np.random.Generator,
) -> Outcome:
    """Track one target per run; the initial errors have covariance P0."""
    blocks = [
        _block(scenario, radar, associate, scans, min(BLOCK, runs - first), rng) for first in range(0, runs, BLOCK)
    ]
    error, expected, p_fa, outside = (
        np.concatenate([getattr(block, name) for block in blocks], axis=-1)
        for name in ("error", "expected", "p_fa", "outside")
    )
    return Outcome(error, expected, p_fa, outside)


def _block(
    scenario: Scenario,
    radar: AllPlots | StrongestPlot,
    associate: Associator,
    scans: int,
    runs: int,
    rng: np.random.Generator,
) -> Outcome:
    gate = Gate(gated(scenario.dim, scenario.gate))
    bank, run = KalmanBank(scenario.model), np.arange(runs)
    truth = np.zeros((runs, scenario.model.states))
    at = list(scenario.model.position)
    bank.insert(_scattered(rng, truth, scenario.P0), np.tile(scenario.P0, (runs, 1, 1)), np.ones(runs))
    error, expected, p_fa = np.empty((3, scans, runs))
    outside = np.zeros(runs, np.int64)
    for k in range(scans):
        truth = _scattered(rng, truth @ scenario.F.T, scenario.Q)
        bank.predict(scenario.dt)
        zhat, cov = bank.predicted_measurement(POSITION)
        gates = Gates(zhat, cov + scenario.R, scenario.gate, _scattered(rng, truth[:, at], scenario.R))
        plots = radar.draw(rng, k * scenario.dt, gates, scenario.R)
        problem = Problem.gated(gate, zhat, cov, plots.scan, plots.p_d, plots.density, run=run)
        bank.update(associate.decide(problem), plots.scan, POSITION)
        outside = np.where(gates.holds_target, 0, outside + 1)
        error[k] = np.linalg.norm(bank.x[:, at] - truth[:, at], axis=1)
        expected[k] = position_error(scenario, bank.P)
        p_fa[k] = plots.p_fa
    return Outcome(error, expected, p_fa, outside)


def _scattered(rng: np.random.Generator, mean: Floats, cov: Floats) -> Floats:
    """Rows of mean (T, n) plus Gaussian noise of covariance cov (n, n), which may be singular."""
    variance, axis = np.linalg.eigh(cov)
    return mean + (rng.standard_normal(mean.shape) * np.sqrt(np.maximum(variance, 0.0))) @ axis.T
