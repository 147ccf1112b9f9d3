"""What a sensor does not detect by its nature, and what a miss therefore tells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Mask
from vidtrack.decision import Decision
from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.noise import as_if_new
from vidtrack.estimate.sensor import Sensor
from vidtrack.scan import Scan

LEAST = 1e-6
"""Weights below it are left out."""


@dataclass(frozen=True, slots=True)
class BlindZone:
    """Targets that are not detected where a quantity h of theirs is near zero, as slow ones by a Doppler filter.

    A target is detected with probability P (1 - exp(-h^2 / (2 sigma^2))), so that a miss has the likelihood
    (1 - P) + P exp(-h^2 / (2 sigma^2)). The state after it is a mixture of the state before and of that after a
    measurement of zero with error sigma (W. Koch, "On exploiting 'negative' sensor evidence for target tracking and
    sensor data fusion", Information Fusion 8(1), 2007): a vehicle that brakes and is seen no longer stands.

    sensor  measurement model of h, one component
    sigma   in the units of h
    """

    sensor: Sensor
    sigma: float

    def update(self, bank: Estimator, t: float, missed: Mask, detection: float | Floats, since: float = 0.0) -> None:
        """Update the rows of a bank that were missed (T,) at t [s], at P of `detection`, one for all or (T,).

        since  seconds since the sensor's last scan: how far h is from zero lasts, as errors of blobs do
        """
        zhat, cov = bank.predicted_measurement(self.sensor)
        S = cov[:, 0, 0] + self.sigma**2
        there = detection * np.sqrt(self.sigma**2 / S) * np.exp(-(zhat[:, 0] ** 2) / (2 * S))
        beta = np.where(missed, there / (there + 1 - detection), 0.0)
        beta[beta < LEAST] = 0.0
        row = beta.nonzero()[0]
        if len(row):
            zero = Scan(t, np.zeros((1, 1)), as_if_new(np.full((1, 1), self.sigma**2), since), self.sensor)
            decision = Decision(np.arange(len(bank)), row, np.zeros(len(row), np.int64), beta[row], 1 - beta)
            bank.update(decision, zero, self.sensor)
