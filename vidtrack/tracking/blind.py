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

    A target is detected with probability P (1 - b), b = (1 - LEFT) exp(-h^2 / (2 sigma^2)). A miss tells how it moves
    (W. Koch, "On exploiting 'negative' sensor evidence for target tracking and sensor data fusion", Information
    Fusion 8(1), 2007): one of velocity v that is missed may be one that stands. The state after a miss is a mixture of
    the state before, with the likelihood 1 - P, and that after a measurement of v = 0 with error sigma on each axis,
    with

        P (1 - LEFT) E[exp(-v'v / (2 sigma^2))]

    over the error of v. This is next to nothing for a target that is known to move across the line of sight, though b
    is not, and for one whose velocity nobody knows, as that of a track of one plot.

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
        """(T,) (1 - LEFT) E[exp(-v'v / (2 sigma^2))] of the rows."""
        v, V = bank.predicted_measurement(VELOCITY)
        spread = np.eye(v.shape[1]) + V / self.sigma**2
        distance = np.einsum("ti,tij,tj->t", v, np.linalg.inv(spread), v) / self.sigma**2
        return np.asarray((1 - LEFT) * np.exp(-distance / 2) / np.sqrt(np.linalg.det(spread)))

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
