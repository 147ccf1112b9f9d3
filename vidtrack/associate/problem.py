"""The association problem of one scan: the input of every associator."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vidtrack.arrays.rows import each
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.gate import Gate, Pairs
from vidtrack.associate.mixture import mixture_pairs
from vidtrack.compiled import kernel
from vidtrack.estimate.bank import Modes
from vidtrack.scan import Scan

VANISHING = 2000.0
"""Minus the logarithm that stands for ln 0 (no clutter; P_D P_G of one): exp(-2000) is negligible, so the
weights are those of the limit, and events with one such factor still rank above events with two."""


@dataclass
class Problem:
    """The possible pairs of T tracks and M measurements, with their probabilities.

    pairs      gated (row, measurement) pairs
    scan       the measurements, with their amplitudes and scores
    cov        (T, m, m) covariances H P H' of the predicted measurements
    detection  (T,) P_D
    clutter    (T,) density of false measurements [per unit of measurement space]
    inside     (T,) P_G, the share of a target's own measurements that its gate admits
    """

    pairs: Pairs
    scan: Scan
    cov: Floats
    detection: Floats
    clutter: Floats
    inside: Floats

    @classmethod
    def gated(
        cls,
        gate: Gate,
        zhat: Floats,
        cov: Floats,
        scan: Scan,
        detection: float | Floats = 0.9,
        clutter: float | Floats = 1e-5,
        *,
        run: Ints | None = None,
        label: Ints | None = None,
        angles: tuple[int, ...] = (),
        modes: Modes | None = None,
    ) -> Problem:
        """The problem of the pairs inside a gate, of predicted measurements zhat (T, m), cov (T, m, m) and a scan.

        run (T,) Monte Carlo runs, label (T,) classes, -1 unknown: both sides of a pair are of one run, and of one class
        where both classes are known. angles: components of z that wrap. modes: the predicted measurements are a
        mixture of these, with moments zhat and cov.
        """
        rows, dim = zhat.shape
        detection, clutter = each(detection, rows), each(clutter, rows)
        if modes is None:
            pairs = gate.pairs(zhat, cov, scan, run, angles, detection, clutter)
            inside = gate.inside(pairs.limit, dim)
        else:
            pairs, inside = mixture_pairs(gate, modes, scan, run, angles, detection, clutter)
        if label is not None and scan.label is not None:
            mine, theirs = label[pairs.row], scan.label[pairs.measurement]
            pairs = pairs.only((mine == theirs) | (mine < 0) | (theirs < 0))
        return cls(pairs, scan, cov, detection, clutter, inside)

    @property
    def rows(self) -> int:
        """T."""
        return len(self.cov)

    @property
    def measurements(self) -> int:
        """M."""
        return len(self.scan)

    @property
    def missed(self) -> Floats:
        """(T,) 1 - P_D P_G, the probability that a target gives no measurement in its gate."""
        return 1.0 - self.detection * self.inside

    @property
    def log_missed(self) -> Floats:
        """(T,) ln(1 - P_D P_G), with VANISHING in place of zero."""
        return self._logs[0]

    @property
    def log_ratio(self) -> Floats:
        """(N,) ln(P_D N(v; 0, S) / clutter density) of each pair: target against false measurement.

        Without clutter the density is VANISHING; -inf for a target that is never detected.
        """
        return self._logs[1]

    @cached_property
    def _logs(self) -> tuple[Floats, Floats]:
        return logs(self.detection, self.inside, self.clutter, self.pairs.row, self.pairs.log_l)

    def only(self, mask: Mask) -> Problem:
        """The problem with the pairs of a mask (N,)."""
        return self.having(self.pairs.only(mask))

    def apart(self, shared: Ints) -> Problem:
        """The problem without the rows that share a measurement (T,), -1: none, and without these measurements.

        These rows count neither as seen nor as missed.
        """
        own = shared < 0
        if np.count_nonzero(own) == len(own):
            return self
        left = self.only(own[self.pairs.row] & ~np.isin(self.pairs.measurement, shared[~own]))
        return replace(left, detection=np.where(own, self.detection, 0.0))

    def having(self, pairs: Pairs) -> Problem:
        """The problem with other pairs of the same rows."""
        if pairs is self.pairs:
            return self
        return Problem(pairs, self.scan, self.cov, self.detection, self.clutter, self.inside)

    def of(self, rows: Ints) -> Problem:
        """The problem of these rows (K,), which may repeat: successors have the pairs of their parents."""
        return replace(
            self,
            pairs=self.pairs.of(rows),
            cov=self.cov[rows],
            detection=self.detection[rows],
            clutter=self.clutter[rows],
            inside=self.inside[rows],
        )


@kernel
def logs(detection: Floats, inside: Floats, clutter: Floats, row: Ints, log_l: Floats) -> tuple[Floats, Floats]:
    """(T,) log_missed and (N,) log_ratio from the factors (T,); VANISHING for ln 0."""
    missed, density, ratio, most = np.empty(len(inside)), np.empty(len(inside)), np.empty(len(row)), 0.0
    for k in range(len(log_l)):
        most = max(most, abs(log_l[k]))
    least = -VANISHING - 4 * most
    for t in range(len(inside)):
        if t > 0 and detection[t] == detection[t - 1] and inside[t] == inside[t - 1] and clutter[t] == clutter[t - 1]:
            missed[t], density[t] = missed[t - 1], density[t - 1]  # as in most rows
            continue
        missed[t] = max(math.log(1.0 - detection[t] * inside[t]), least)
        density[t] = math.log(detection[t]) - max(math.log(clutter[t]), least)
    for k in range(len(row)):
        ratio[k] = density[row[k]] + log_l[k]
    return missed, ratio
