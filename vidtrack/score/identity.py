"""Identity scores: the share of the truth that the best single track of each object covers.

E. Ristani et al., "Performance Measures and a Data Set for Multi-Target, Multi-Camera Tracking",
ECCV Workshops 2016.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.score.matching import Matchup, assign


@dataclass(frozen=True, slots=True)
class Identity:
    """IDF1 = 2 IDTP / (truth rows + result rows), IDP = IDTP / result rows, IDR = IDTP / truth rows."""

    idf1: float
    idp: float
    idr: float


def identity(matchup: Matchup, threshold: float = 0.5) -> Identity:
    """Identity scores: objects and tracks are paired one to one for the whole run, so that they share most rows.

    Rows are shared when their similarity is at least `threshold`.
    """
    truth_id, result_id, which = matchup.identity_pairs()
    shared = np.bincount(which[matchup.similarity >= threshold], minlength=len(truth_id)).astype(float)
    some = shared > 0
    best = assign(np.zeros(some.sum(), np.int64), truth_id[some], result_id[some], shared[some])
    idtp = int(shared[some][best].sum())
    objects, results = len(matchup.truth_frame), len(matchup.result_frame)
    return Identity(2 * idtp / max(1, objects + results), idtp / max(1, results), idtp / max(1, objects))
