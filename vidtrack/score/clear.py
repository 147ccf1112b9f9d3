"""CLEAR MOT: detection errors and identity switches.

K. Bernardin, R. Stiefelhagen, "Evaluating Multiple Object Tracking Performance: The CLEAR MOT
Metrics", EURASIP J. Image and Video Processing, 2008.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Ints, Mask
from vidtrack.score.matching import Matchup, best_pairs, split_contests

EPS = float(np.finfo(float).eps)
CONTINUES = 1000.0  # outweighs any similarity, so that pairs of the last frame come first


@dataclass(frozen=True, slots=True)
class Clear:
    """CLEAR scores; `mota` and `motp` (mean similarity of the matches) as fractions.

    A switch is a match to another track than the object's last one. A fragmentation is a match after
    frames without a match. Mostly tracked: more than 80 % of an object's rows are matched;
    mostly lost: less than 20 %.
    """

    mota: float
    motp: float
    matches: int
    false_positives: int
    misses: int
    switches: int
    fragmentations: int
    mostly_tracked: int
    partially_tracked: int
    mostly_lost: int


def clear(matchup: Matchup, threshold: float = 0.5) -> Clear:
    """CLEAR scores of a result, matched at a similarity of at least `threshold`.

    As in TrackEval, a frame in which truth or result is empty neither ends nor begins a fragment.
    """
    matched = correspondences(matchup, threshold)
    matches = int(matched.sum())
    objects, tracked = len(matchup.truth_frame), np.bincount(matchup.truth_id)
    misses, false_positives = objects - matches, len(matchup.result_frame) - matches

    truth_id = matchup.truth_id[matchup.truth[matched]]
    result_id = matchup.result_id[matchup.result[matched]]
    frame = _frames_with_both(matchup)[matchup.pair_frame[matched]]
    order = np.lexsort((frame, truth_id))
    same_object = np.diff(truth_id[order]) == 0
    switches = int(np.sum(same_object & (np.diff(result_id[order]) != 0)))
    fragmentations = int(np.sum(same_object & (np.diff(frame[order]) > 1)))

    share = np.bincount(truth_id, minlength=len(tracked)) / tracked
    mostly_tracked, mostly_lost = int(np.sum(share > 0.8)), int(np.sum(share < 0.2))
    return Clear(
        mota=1 - (misses + false_positives + switches) / max(1, objects),
        motp=float(matchup.similarity[matched].sum() / max(1, matches)),
        matches=matches,
        false_positives=false_positives,
        misses=misses,
        switches=switches,
        fragmentations=fragmentations,
        mostly_tracked=mostly_tracked,
        partially_tracked=len(tracked) - mostly_tracked - mostly_lost,
        mostly_lost=mostly_lost,
    )


def correspondences(matchup: Matchup, threshold: float = 0.5) -> Mask:
    """The pairs (B,) that CLEAR matches: in each frame first those that continue a match of the previous
    frame, then those of the largest total similarity.
    """
    close = np.flatnonzero(matchup.similarity >= threshold - EPS)
    truth, result = matchup.truth[close], matchup.result[close]
    similarity = matchup.similarity[close]
    frame = _frames_with_both(matchup)[matchup.pair_frame[close]]
    before = _same_pair_one_frame_before(matchup.identity_pairs()[2][close], frame)

    free, contests = split_contests(frame, truth, result)
    chosen = np.append(free, False)  # the last stands for "no such pair", index -1
    for pairs, i, j in contests:
        chosen[pairs] = best_pairs(i, j, similarity[pairs] + CONTINUES * chosen[before[pairs]])
    matched = np.zeros(len(matchup.similarity), bool)
    matched[close[chosen[:-1]]] = True
    return matched


def _frames_with_both(matchup: Matchup) -> Ints:
    """(F,) frames renumbered without those in which truth or result is empty."""
    return np.cumsum((matchup.truth_count > 0) & (matchup.result_count > 0)) - 1


def _same_pair_one_frame_before(which: Ints, frame: Ints) -> Ints:
    """(B,) the index of the pair of the same identities in the previous frame, -1 for none."""
    order = np.lexsort((frame, which))
    follows = (np.diff(which[order]) == 0) & (np.diff(frame[order]) == 1)
    before = np.full(len(which), -1)
    before[order[1:][follows]] = order[:-1][follows]
    return before
