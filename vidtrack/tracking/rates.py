"""Detection probability and clutter density, given or estimated from the associations."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.decision import Decision
from vidtrack.errors import ConfigError
from vidtrack.scan import Scan
from vidtrack.tracking.clutter import EvenClutter

MEMORY_S = 300.0
"""Time constant with which old scans are forgotten."""
PRIOR, PRIOR_SCANS = 0.9, 10.0
"""Prior detection probability, and its weight in scans of one track."""
HIGHEST = 0.999
"""Largest estimate of P_D."""

Rate = float | Floats | None


class Rates:
    """Detection probability and clutter density, each given or, where it is None, estimated.

    detection, clutter   one number for all, or (B,) one for each Monte Carlo run; density in px^-2, m^-2, ... per scan
    space                what the sensor surveys, in px^2, m^2, ...; None: the extent of all measurements so far
    where                how the estimated clutter is distributed; None: evenly. If it is in a box that measurements
                         are outside of, the box and with it the space grow

    P_D: scans in which tracks were seen, of all scans of confirmed tracks that share no blob. Misses count once the
    track is seen again, by whatever station: those of a target that has gone say nothing of how well targets are seen.
    Clutter: what confirmed tracks leave, one measurement before the first scan included. Old scans are forgotten
    exponentially.

    Raises ConfigError for numbers that are no probability, density or area.
    """

    STATE = ("hits", "trials", "false", "scans", "low", "high", "where")

    def __init__(
        self,
        detection: Rate = 0.9,
        clutter: Rate = 1e-5,
        space: float | None = None,
        where: EvenClutter | None = None,
    ) -> None:
        if detection is not None and not np.all((np.asarray(detection) >= 0) & (np.asarray(detection) <= 1)):
            raise ConfigError(f"detection probability is {detection}; it must lie in 0..1")
        if clutter is not None and not np.all((np.asarray(clutter) >= 0) & np.isfinite(clutter)):
            raise ConfigError(f"clutter density is {clutter}; it must be finite and not negative")
        if space is not None and not 0 < space < np.inf:
            raise ConfigError(f"surveyed area is {space}; it must be finite and above zero")
        self._detection = detection
        self._clutter = clutter
        self._space = space
        self.where = where or EvenClutter()
        self.hits = 0.0
        self.trials = 0.0
        self.false = 0.0
        self.scans = 0.0
        self.low = np.empty(0)
        self.high = np.empty(0)

    @property
    def estimated(self) -> bool:
        """Whether one of them, or both, is estimated."""
        return self._detection is None or self._clutter is None

    @property
    def detection_probability(self) -> float:
        """P_D now, the mean over the runs."""
        if self._detection is not None:
            return _mean(self._detection)
        return min((self.hits + PRIOR * PRIOR_SCANS) / (self.trials + PRIOR_SCANS), HIGHEST)

    @property
    def clutter_density(self) -> float:
        """False measurements per scan and unit of the measurement space now, the mean over the runs."""
        if self._clutter is not None:
            return _mean(self._clutter)
        space = float((self.high - self.low).prod()) if self._space is None else self._space * self.where.grown
        return (self.false + 1) / (self.scans + 1) / space

    def as_dict(self) -> dict[str, float]:
        """Both, by name."""
        return {"detection_probability": self.detection_probability, "clutter_density": self.clutter_density}

    def of(self, run: Ints, zhat: Floats) -> tuple[float | Floats, float | Floats]:
        """P_D and clutter density for rows (T,) of these runs, at their predicted measurements (T, m)."""
        clutter = self._clutter[run] if isinstance(self._clutter, np.ndarray) else None
        return self.detection(run), self.clutter_density * self.where.at(zhat) if clutter is None else clutter

    def detection(self, run: Ints) -> float | Floats:
        """P_D for rows (T,) of these runs."""
        return self._detection[run] if isinstance(self._detection, np.ndarray) else self.detection_probability

    def look(self, scan: Scan) -> None:
        """Extend the surveyed space by this scan's measurements, unless it was given without a box."""
        self.where.reach(scan.z)
        if self._clutter is not None or self._space is not None or not len(scan):
            return
        reach = np.sqrt(3 * np.diagonal(scan.R, axis1=1, axis2=2))  # half the width of a uniform error
        low, high = (scan.z - reach).min(axis=0), (scan.z + reach).max(axis=0)
        first = not len(self.low)
        self.low = low if first else np.minimum(self.low, low)
        self.high = high if first else np.maximum(self.high, high)

    def forget(self, dt: float) -> None:
        """Let what is known fade by dt seconds."""
        fade = float(np.exp(-dt / MEMORY_S))
        self.hits *= fade
        self.trials *= fade
        self.false *= fade
        self.scans *= fade
        self.where.forget(fade)

    def learn_clutter(
        self, decision: Decision, shared: Ints, known: Mask, existence: Floats, scan: Scan, runs: int
    ) -> None:
        """Learn from a decision about the measurements of a scan in which confirmed tracks are `known` (K,).

        shared (K,) measurement that each row shares, -1: none; existence (K,) probability that it is a target: a slow
        one would else be taken for clutter at its place before it is confirmed; runs: number of Monte Carlo runs
        """
        self.where.learn(scan.z, _unclaimed(decision, shared, np.where(known, 1.0, existence), len(scan)))
        self.false += float(_unclaimed(decision, shared, known.astype(float), len(scan)).sum())
        self.scans += runs

    def learn_detection(self, missed: Ints, inside: Floats, seen: bool) -> None:
        """Learn from tracks (N,) that have just been seen, by this station or another.

        missed (N,) scans of this station without them since they were last seen, inside (N,) their P_G
        """
        self.hits += len(missed) * seen
        self.trials += float(((missed + seen) * inside).sum())


def _unclaimed(decision: Decision, shared: Ints, target: Floats, count: int) -> Floats:
    """(count,) probability that no row took a measurement, rows being targets with probabilities (K,)."""
    claimed = np.bincount(decision.measurement, decision.beta * target[decision.row], count)
    claimed[shared[shared >= 0]] = 1.0
    return np.maximum(1 - claimed, 0)


def _mean(rate: float | Floats) -> float:
    return float(rate.mean() if isinstance(rate, np.ndarray) else rate)
