"""What a sensor does not detect by its nature: how probable that is, and what a miss therefore tells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.decision import Decision
from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.noise import as_if_new
from vidtrack.estimate.sensor import VELOCITY, Sensor
from vidtrack.scan import Scan

LEAST = 1e-6
"""Weights below it are left out."""
LEFT = 0.02
"""Share of P that is left in the middle of the zone, because how a target moves is not known exactly."""


@dataclass(frozen=True, slots=True)
class BlindZone:
    """Targets that are not detected where a quantity h of theirs is near zero, as slow ones by a Doppler filter.

    A target is detected with probability P (1 - b), b = (1 - LEFT) exp(-h^2 / (2 sigma^2)), so that a miss has the
    likelihood (1 - P) + P b (W. Koch, "On exploiting 'negative' sensor evidence for target tracking and sensor data
    fusion", Information Fusion 8(1), 2007). One that is missed because h is near zero stands or moves across the line
    of sight. It is taken to stand as well as its velocity v, of covariance V, agrees with that: the state after the
    miss is a mixture of the state before, with the likelihood 1 - P, and that after a measurement of v = 0 with error
    sigma on each axis, with P times

        (1 - LEFT) sigma / sqrt(sigma^2 + S) exp(-v' (V + sigma^2 I)^-1 v / 2), S the variance of h.

    Without correlation between the axes this is (1 - LEFT) E[exp(-h^2 / (2 sigma^2))], times how well the velocity
    across the line of sight agrees with zero. It is next to nothing for a target that is known to move across, though
    b is not, and for one whose velocity nobody knows, as that of a track of one plot.

    sensor  measurement model of h, one component
    sigma   in the units of h, m/s
    """

    sensor: Sensor
    sigma: float

    def hidden(self, bank: Estimator) -> Floats:
        """(T,) b of the rows, at their means.

        Its expectation would be less for a row whose h is hardly known, as of one that has stopped: where it is and how
        it moves lasts, so that its misses are not the independent evidence against it that they would be.
        """
        zhat, _ = bank.predicted_measurement(self.sensor)
        return np.asarray((1 - LEFT) * np.exp(-(zhat[:, 0] ** 2) / (2 * self.sigma**2)))

    def stands(self, bank: Estimator) -> Floats:
        """(T,) how probable it is that rows are missed because they stand, as above."""
        _, S = bank.predicted_measurement(self.sensor)
        v, V = bank.predicted_measurement(VELOCITY)
        distance = np.einsum("ti,tij,tj->t", v, np.linalg.inv(V + self.sigma**2 * np.eye(v.shape[1])), v)
        return np.asarray((1 - LEFT) * np.exp(-distance / 2) / np.sqrt(1 + S[:, 0, 0] / self.sigma**2))

    def update(self, bank: Estimator, t: float, missed: Floats, detection: Floats, since: float = 0.0) -> None:
        """Update the rows of a bank by a scan at t [s] that missed them with these probabilities (T,).

        detection  (T,) P of the rows
        since      seconds since the sensor's last scan: how far v is from zero lasts, as errors of blobs do
        """
        there = detection * self.stands(bank)
        beta = missed * there / np.maximum(there + 1 - detection, np.finfo(float).tiny)
        beta[beta < LEAST] = 0.0
        row = beta.nonzero()[0]
        if len(row):
            dim = len(bank.model.position)
            R = as_if_new(self.sigma**2 * np.eye(dim)[None], since)
            none = np.zeros(len(row), np.int64)
            decision = Decision(np.arange(len(bank)), row, none, beta[row], 1 - beta, shows=False)
            bank.update(decision, Scan(t, np.zeros((1, dim)), R, VELOCITY), VELOCITY)
