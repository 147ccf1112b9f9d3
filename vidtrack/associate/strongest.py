"""Strongest neighbour: each track takes the strongest measurement in its gate, with or without a probability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from vidtrack.amplitude.densities import RAYLEIGH, Weibull, log_ratio, swerling1
from vidtrack.amplitude.reduction import gate_volume
from vidtrack.amplitude.strongest import Strongest
from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.hard import one_hot
from vidtrack.associate.problem import Problem
from vidtrack.associate.widening import widening
from vidtrack.compiled import kernel
from vidtrack.decision import Decision
from vidtrack.errors import ConfigError, ScanError
from vidtrack.scan import Scan

TINY = 1e-300
MOST = 0.999
"""Upper limit of scores: a score of one would be an infinite amplitude."""


@dataclass(frozen=True, slots=True)
class StrongestNeighbour:
    """Strongest neighbour: the strongest measurement in the gate updates the track with weight one.

    Strength is the amplitude, or the score if there are no amplitudes. Two tracks may take the same measurement. The
    filter is overconfident in clutter; PSN is not.

    gated_births  whether a weaker measurement in a gate may start a track
    """

    gated_births: bool = False

    def decide(self, problem: Problem) -> Decision:
        """Raises ScanError for a scan without amplitudes and scores."""
        pairs = problem.pairs
        strongest = _strongest(pairs.start, pairs.measurement, _strength(problem.scan))
        taken = np.where(strongest < 0, -1, pairs.measurement[strongest]) if len(pairs) else strongest
        return one_hot(taken)


@dataclass(frozen=True, slots=True)
class PSN:
    """Probabilistic strongest neighbour (paper 002, eqs. 21 to 26): the strongest measurement in the gate is the
    target's with a probability that follows from its amplitude and position.

    The tracker's P_D and the SNR give the detection threshold, and with the clutter density the size of a resolution
    cell. A scan without amplitudes may have scores from 0 to 1 instead. A score is read as the share of the target's
    detections that are weaker.

    snr           linear SNR of a Swerling I target; 10 is 10 dB
    clutter       the clutter's amplitudes, in the same units
    printed       widen by the average over amplitudes, as eq. (24) is printed, and not by the measured amplitude; slow,
                  for comparison
    gated_births  whether a weaker measurement in a gate may start a track

    Raises ConfigError for an SNR that is not above zero.
    """

    snr: float = 10.0
    clutter: Weibull = RAYLEIGH
    printed: bool = False
    gated_births: bool = False

    def __post_init__(self) -> None:
        if not (np.isfinite(self.snr) and self.snr > 0):
            raise ConfigError(f"the linear SNR of the strongest-neighbour filter is {self.snr}; it must be above zero")

    def decide(self, problem: Problem) -> Decision:
        """P_T of the strongest measurement in each gate; 1 - P_T is the weight of a miss, which widens the row.

        Raises ScanError for a scan without amplitudes and scores.
        """
        pairs, target = problem.pairs, swerling1(self.snr)
        k = _strongest(pairs.start, pairs.measurement, _strength(problem.scan))
        row = np.flatnonzero(k >= 0)
        k = k[row]
        p_d = np.maximum(problem.detection[row], TINY)
        a = self._amplitude(problem.scan, pairs.measurement[k], p_d)
        threshold = np.minimum(target.threshold(p_d), a)
        stronger = problem.inside[row] * target.survival(a)
        log_true = problem.log_ratio[k] + log_ratio(a, threshold, target, self.clutter)
        p_true = expit(log_true - np.log(np.maximum(1 - stronger, TINY)))
        beta0 = np.ones(problem.rows)
        beta0[row] = 1 - p_true
        seen = problem.detection * problem.inside
        seen[row] = seen[row] * self._average(problem, row, threshold) if self.printed else stronger
        return Decision(
            parent=np.arange(problem.rows),
            row=row,
            measurement=pairs.measurement[k],
            beta=p_true,
            beta0=beta0,
            inflation=widening(problem, seen),
        )

    def _amplitude(self, scan: Scan, j: Ints, p_d: Floats) -> Floats:
        """(B,) amplitudes of measurements j, or those that match their scores at the tracks' P_D `p_d`."""
        if scan.amplitude is not None:
            return np.maximum(scan.amplitude[j], TINY)
        weaker = np.clip(_strength(scan)[j], 0.0, MOST)
        return swerling1(self.snr).threshold(p_d * (1 - weaker))

    def _average(self, problem: Problem, row: Ints, threshold: Floats) -> Floats:
        """(B,) P_A of rows: the probability that a detected target is the strongest, given clutter in the gate.

        (I_A / P_D - exp(-n)) / (1 - exp(-n)) for n = density times gate volume (paper 002, eqs. 16 to 19).
        """
        p_d, limit = problem.detection[row], problem.pairs.limit[row]
        p_fa = self.clutter.survival(threshold)
        average = np.ones(len(row))
        for i in np.flatnonzero((p_d > 0) & (p_fa > 0) & (problem.clutter[row] > 0) & np.isfinite(limit)):
            assert problem.scan.noise is not None, "a row has a measurement"
            volume = gate_volume(problem.cov[row[i]] + problem.scan.noise, np.sqrt(limit[i]))
            false = problem.clutter[row[i]] * volume
            alone = Strongest(self.snr, p_fa[i], self.clutter).alone(false / p_fa[i])
            average[i] = (alone / p_d[i] - np.exp(-false)) / -np.expm1(-false)
        return average


def _strength(scan: Scan) -> Floats:
    """(M,) amplitudes, or scores without amplitudes."""
    strength = scan.score if scan.amplitude is None else scan.amplitude
    if strength is None:
        if len(scan):
            raise ScanError(
                "the scan has neither amplitudes nor scores, by which the strongest-neighbour methods choose; "
                "take another method (gnn, pda, jpda)"
            )
        return np.empty(0)
    return strength


@kernel
def _strongest(start: Ints, measurement: Ints, strength: Floats) -> Ints:
    """(T,) index of the pair with the strongest measurement of each row, the first of equals; -1 for none."""
    best = np.full(len(start) - 1, -1)
    for t in range(len(best)):
        for k in range(start[t], start[t + 1]):
            if best[t] < 0 or strength[measurement[k]] > strength[measurement[best[t]]]:
                best[t] = k
    return best
