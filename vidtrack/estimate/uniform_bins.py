"""The particle filter of paper 003, table 1: uniform particles in the measurement's bin, without memory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.decision import Decision
from vidtrack.errors import ConfigError
from vidtrack.estimate.kalman import KalmanBank
from vidtrack.estimate.motion.model import Motion
from vidtrack.estimate.sensor import Sensor
from vidtrack.scan import Scan

RANGE_M = (10e3, 30e3, 50e3, 70e3, 100e3)
"""m; edges of the range bins of paper 003, table 1."""


class UniformBinsBank(KalmanBank):
    """Filters without memory, one per row: N uniform particles in the measurement's bin, weighted by its likelihood.

    The literal reading of paper 003, table 1. The particles represent one component of a measurement; their mean and
    variance replace it. After each update a row's state is that of a new row, with unknown velocity; earlier states
    count for the association only. Between scans rows move by the motion model.

    edges  bin edges of each component of a measurement, in its unit; values outside use the nearest bin, so that the
           estimate stays within the table; angles are in 0..2 pi
    """

    def __init__(self, model: Motion, edges: Sequence[Sequence[float]], number: int = 2000, *, seed: int = 0) -> None:
        if any(len(each) < 2 or not (np.diff(each) > 0).all() for each in edges):
            raise ConfigError(f"uniform bins: edges {edges}; give two at least, in ascending order")
        super().__init__(model)
        self.edges = [np.asarray(each, float) for each in edges]
        self.number = number
        self.rng = np.random.default_rng(seed)

    def update(self, decision: Decision, scan: Scan, sensor: Sensor) -> None:
        """Successor rows: new states from the particles of each measurement, mixed with the prediction by beta0."""
        parent, row, beta = decision.parent, decision.row, decision.beta
        z = scan.z[decision.measurement]
        z[:, sensor.angles] %= 2 * np.pi
        z, variance = self._estimate(z, scan.R[decision.measurement])
        position, cov = sensor.locate(z, variance[:, :, None] * np.eye(z.shape[1]))
        x, P = self.model.birth(position, cov, self.scale[parent[row]])
        before = self.x[parent]
        off = x - before[row]
        mean = _summed(row, beta[:, None] * off, len(parent))
        second = P + off[:, :, None] * off[:, None]
        self.x = before + mean
        self.P = (
            decision.beta0[:, None, None] * self.P[parent]
            + _summed(row, beta[:, None, None] * second, len(parent))
            - mean[:, :, None] * mean[:, None]
        )
        self.hits = self.hits[parent] + decision.hit
        self.scale = self.scale[parent]

    def _estimate(self, z: Floats, R: Floats) -> tuple[Floats, Floats]:
        """Mean (B, m) and variance (B, m) of uniform particles in the bins of z (B, m), weighted by N(z; x, R_aa)."""
        mean, variance = np.empty_like(z), np.empty_like(z)
        for a, edges in enumerate(self.edges):
            bin_ = np.clip(np.searchsorted(edges, z[:, a], side="right") - 1, 0, len(edges) - 2)
            x = self.rng.uniform(edges[bin_, None], edges[bin_ + 1, None], (len(z), self.number))
            log_weight = -0.5 * (x - z[:, a, None]) ** 2 / R[:, a, a, None]
            weight = np.exp(log_weight - log_weight.max(axis=1, keepdims=True))
            weight /= weight.sum(axis=1, keepdims=True)
            mean[:, a] = (weight * x).sum(axis=1)
            spread = (weight * (x - mean[:, a, None]) ** 2).sum(axis=1)
            spacing = (edges[bin_ + 1] - edges[bin_]) / self.number
            variance[:, a] = spread + spacing**2  # often a single particle has all the weight: its error
        return mean, variance


def _summed(row: np.ndarray, term: Floats, rows: int) -> Floats:
    """Sums of the terms (B, ...) of each row, (K, ...)."""
    total = np.zeros((rows, *term.shape[1:]))
    np.add.at(total, row, term)
    return total
