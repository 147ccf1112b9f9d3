"""One scan's association problem: what every associator is given."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vidtrack.associate.gate import Gate, Pairs
from vidtrack.scan import Floats, Ints, Scan


@dataclass(frozen=True)
class Problem:
    """Which of M measurements belongs to which of T tracks.

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
        angles: tuple[int, ...] = (),
    ) -> Problem:
        """The problem that a gate leaves of predicted measurements zhat (T, m), cov (T, m, m) and a scan."""
        pairs = gate.pairs(zhat, cov, scan, run, angles)
        rows, dim = zhat.shape
        inside = gate.inside(pairs.limit, dim)
        return cls(pairs, scan, cov, np.broadcast_to(detection, rows), np.broadcast_to(clutter, rows), inside)

    @property
    def rows(self) -> int:
        """T."""
        return len(self.cov)

    @property
    def measurements(self) -> int:
        """M."""
        return len(self.scan)

    @cached_property
    def missed(self) -> Floats:
        """(T,) 1 - P_D P_G, the probability that a target gives no measurement in its gate."""
        return 1.0 - self.detection * self.inside

    @cached_property
    def log_ratio(self) -> Floats:
        """(N,) ln(P_D N(v; 0, S) / clutter density) of each pair: a target's measurement against a false one.

        Infinite without clutter: a measurement in the gate is then a target's for certain.
        """
        row = self.pairs.row
        with np.errstate(divide="ignore"):
            return np.log(self.detection)[row] + self.pairs.log_l - np.log(self.clutter)[row]

    def only(self, mask: np.ndarray) -> Problem:
        """The same with the pairs of a mask (N,)."""
        return replace(self, pairs=self.pairs.only(mask))
