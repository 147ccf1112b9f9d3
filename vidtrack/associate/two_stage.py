"""The score of a detection as evidence: detections with a low score may continue a track but start none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Mask
from vidtrack.associate.hard import Associator
from vidtrack.associate.problem import Problem
from vidtrack.decision import Decision
from vidtrack.scan import Scan


@dataclass(frozen=True, slots=True)
class TwoStage:
    """Detections that score at least `least` are sure; without scores all are.

    Tracks choose among sure detections first and, where they get none, among the others. Only sure ones start tracks,
    confirm them and keep them alive.
    """

    least: float

    def sure(self, scan: Scan) -> Mask:
        """(M,) the scan's sure detections."""
        return np.ones(len(scan), bool) if scan.score is None else scan.score >= self.least

    def decide(self, associate: Associator, problem: Problem, rows: Mask, sure: Mask) -> Decision:
        """The decision about rows (T,), in two rounds: measurements that are `sure` (M,) come first."""
        pairs = problem.pairs
        asked, first_round = rows[pairs.row], sure[pairs.measurement]
        first = associate.decide(problem.only(asked & first_round))
        second_round = asked & ~first_round
        if not np.count_nonzero(second_round):
            return first
        missed = first.beta0 > 0.5
        second = associate.decide(problem.only(second_round & missed[pairs.row]))
        return first.without(missed).joined(second)


SINGLE_STAGE = TwoStage(-np.inf)
"""All detections are sure, whatever their scores."""
