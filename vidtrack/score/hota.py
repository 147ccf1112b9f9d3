"""HOTA: the geometric mean of detection and association accuracy.

J. Luiten et al., "HOTA: A Higher Order Metric for Evaluating Multi-Object Tracking", IJCV 2021.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.score.matching import Matchup, assign

ALPHAS = np.arange(0.05, 0.99, 0.05)
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True, slots=True)
class Hota:
    """HOTA = sqrt(DetA AssA), DetA and AssA: each the mean over the localisation thresholds alpha."""

    hota: float
    deta: float
    assa: float


def hota(matchup: Matchup, alphas: Floats = ALPHAS) -> Hota:
    """HOTA of a result, averaged over similarity thresholds `alphas` (A,), by default 0.05 to 0.95.

    Rows are matched once for all thresholds, by similarity times the Jaccard index of the two whole tracks.
    """
    truth_id, result_id, which = matchup.identity_pairs()
    rows = np.bincount(matchup.truth_id)[truth_id] + np.bincount(matchup.result_id)[result_id]
    potential = np.bincount(which, _share_of_similarity(matchup), minlength=len(rows))
    alignment = potential / (rows - potential)
    score = alignment[which] * matchup.similarity
    matched = assign(matchup.pair_frame, matchup.truth, matchup.result, score)

    by_alpha = [
        _at(which[matched & (matchup.similarity >= alpha - EPS)], rows, matchup) for alpha in np.asarray(alphas)
    ]
    deta, assa = np.array(by_alpha).T
    return Hota(float(np.sqrt(deta * assa).mean()), float(deta.mean()), float(assa.mean()))


def _share_of_similarity(matchup: Matchup) -> Floats:
    """(B,) each pair's similarity over the summed similarity of its two rows: the soft count of a match."""
    of_truth = np.bincount(matchup.truth, matchup.similarity)[matchup.truth] if len(matchup.truth) else np.zeros(0)
    of_result = np.bincount(matchup.result, matchup.similarity)[matchup.result] if len(matchup.truth) else np.zeros(0)
    total = of_truth + of_result - matchup.similarity
    return np.divide(matchup.similarity, total, out=np.zeros_like(total), where=total > EPS)


def _at(which: Ints, rows: Ints, matchup: Matchup) -> tuple[float, float]:
    """DetA and AssA from the identity pair of each match; rows (K,) of both tracks of each identity pair."""
    matches = len(which)
    together = np.bincount(which, minlength=len(rows))
    deta = matches / max(1, len(matchup.truth_frame) + len(matchup.result_frame) - matches)
    assa = np.sum(together * together / np.maximum(1, rows - together)) / max(1, matches)
    return deta, float(assa)
