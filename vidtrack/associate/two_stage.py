"""Two-stage association by score: low-scored detections continue tracks, but start none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.rows import every
from vidtrack.arrays.types import Ints, Mask
from vidtrack.associate.hard import Associator
from vidtrack.associate.problem import Problem
from vidtrack.decision import Decision
from vidtrack.scan import Scan


@dataclass(frozen=True, slots=True)
class TwoStage:
    """Two-stage association by score (as in ByteTrack, Zhang et al. 2022).

    Detections with a score of at least `least` are sure; without scores all are. Tracks are associated with sure
    detections first, and the tracks left over with the others. Only sure detections start, confirm and keep tracks.
    """

    least: float

    def sure(self, scan: Scan) -> Mask:
        """(M,) the scan's sure detections."""
        if scan.score is None or self.single(scan):
            return every(len(scan))
        return scan.score >= self.least

    def surely(self, scan: Scan, taken: Ints) -> Mask:
        """(T,) rows that have `taken` (T,) a sure detection; -1: none."""
        took = taken >= 0
        if not self.single(scan):
            took[took] = self.sure(scan)[taken[took]]
        return took

    def single(self, scan: Scan) -> bool:
        """Whether all detections of a scan are sure."""
        return scan.score is None or self.least == -np.inf

    def decide(self, associate: Associator, problem: Problem, rows: Mask) -> Decision:
        """The decision about rows (T,): sure measurements in the first stage, others in the second."""
        pairs = problem.pairs
        asked = rows.take(pairs.row)
        if self.single(problem.scan):
            return associate.decide(problem.only(asked))
        first_round = self.sure(problem.scan)[pairs.measurement]
        first = associate.decide(problem.only(asked & first_round))
        second_round = asked & ~first_round
        if not np.count_nonzero(second_round):
            return first
        missed = first.beta0 > 0.5
        second = associate.decide(problem.only(second_round & missed[pairs.row]))
        return first.without(missed).joined(second)


SINGLE_STAGE = TwoStage(-np.inf)
"""One stage: all detections are sure."""
