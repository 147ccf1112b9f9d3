"""What a sensor does not detect by its nature: how probable that is, and what a miss therefore tells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.decision import Decision
from vidtrack.estimate.bank import Estimator
from vidtrack.estimate.noise import as_if_new
from vidtrack.estimate.sensor import Sensor
from vidtrack.scan import Scan

LEAST = 1e-6
"""Weights below it are left out."""
LEFT = 0.02
"""Share of P that is left in the middle of the zone, because how a target moves is not known exactly."""


@dataclass(frozen=True, slots=True)
class BlindZone:
    """Targets that are not detected where a quantity h of theirs is near zero, as slow ones by a Doppler filter.

    A target is detected with probability P (1 - b), b = (1 - LEFT) exp(-h^2 / (2 sigma^2)), so that a miss has the
    likelihood (1 - P) + P b. The state after it is a mixture of the state before and of that after a measurement of
    zero with error sigma (W. Koch, "On exploiting 'negative' sensor evidence for target tracking and sensor data
    fusion", Information Fusion 8(1), 2007): a vehicle that brakes and is seen no longer stands, or moves across the
    line of sight.

    sensor  measurement model of h, one component
    sigma   in the units of h
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

    def update(
        self, bank: Estimator, t: float, missed: Floats, detection: Floats, hidden: Floats, since: float = 0.0
    ) -> None:
        """Update the rows of a bank by a scan at t [s] that missed them with these probabilities (T,).

        detection, hidden  (T,) P and b of the predicted rows
        since              seconds since the sensor's last scan: how far h is from zero lasts, as errors of blobs do
        """
        there = detection * hidden
        beta = missed * there / np.maximum(there + 1 - detection, np.finfo(float).tiny)
        beta[beta < LEAST] = 0.0
        row = beta.nonzero()[0]
        if len(row):
            zero = Scan(t, np.zeros((1, 1)), as_if_new(np.full((1, 1), self.sigma**2), since), self.sensor)
            none = np.zeros(len(row), np.int64)
            bank.update(Decision(np.arange(len(bank)), row, none, beta[row], 1 - beta, shows=False), zero, self.sensor)
