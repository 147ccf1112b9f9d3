"""Branches of pairs of tracks as arrays, as a saved state has them."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.estimate.bank import Estimator
from vidtrack.state import gather, restore
from vidtrack.tracking.unresolved.branches import ALIKE, PAIR, Branch, Doubt, Key
from vidtrack.tracking.unresolved.correlations import Correlations

NOTHING = -2
"""In place of an explanation that there is not."""


class Packed(NamedTuple):
    """D doubts about pairs and their B branches, as `Doubt` and `Branch` have them.

    pair  (D, 2) ids; past (D, ALIKE, 3) the tracker's own explanations
    whose (B,) number of each branch's doubt; ways (B, ALIKE, 3) the branch's explanations
    cross (B, s, s) correlations, NaN for none; rows (B, L) all numbers of the bank's two rows
    """

    pair: Ints
    past: Ints
    whose: Ints
    ways: Ints
    exchange: Floats
    score: Floats
    log_odds: Floats
    plots: Ints
    shared: Mask
    cross: Floats
    rows: Floats

    @classmethod
    def of(cls, doubts: dict[tuple[int, int], Doubt]) -> Self:
        """Of the doubts about pairs of ids. Raises ConfigError for an estimator that cannot be saved."""
        every = [(k, branch) for k, doubt in enumerate(doubts.values()) for branch in doubt.branches]
        branches = [branch for _, branch in every]
        count, s = len(branches), 2 * branches[0].bank.model.dim if branches else 0
        cross = [b.correlations.cross[0] if len(b.correlations.cross) else np.full((s, s), np.nan) for b in branches]
        return cls(
            np.array(list(doubts), np.int64).reshape(-1, 2),
            _packed([doubt.past for doubt in doubts.values()]),
            np.array([k for k, _ in every], np.int64),
            _packed([branch.past for branch in branches]),
            np.array([branch.exchange for branch in branches]),
            np.array([branch.score for branch in branches]).reshape(-1, 2),
            np.array([branch.log_odds for branch in branches]),
            np.array([branch.plots for branch in branches], np.int64).reshape(-1, 2),
            np.array([branch.shared for branch in branches], bool),
            np.array(cross).reshape(count, s, s),
            np.array([np.concatenate([v.ravel() for v in gather(b.bank).values()]) for b in branches]),
        )

    def doubts(self, bank: Estimator) -> dict[tuple[int, int], Doubt]:
        """The doubts; `bank`: the tracker's own, of which a branch's is a part."""
        found = [((int(i), int(j)), Doubt(past=_keys(past))) for (i, j), past in zip(self.pair, self.past, strict=True)]
        for b, k in enumerate(self.whose):
            own = bank.only(np.zeros(2, np.int64))
            parts = gather(own)
            ends = np.cumsum([part.size for part in parts.values()])[:-1]
            numbers = zip(parts.items(), np.split(self.rows[b], ends), strict=True)
            restore(own, {name: row.reshape(part.shape).astype(part.dtype) for (name, part), row in numbers})
            there = not np.isnan(self.cross[b]).any()
            correlations = Correlations(PAIR[None], self.cross[b : b + 1].copy()) if there else Correlations()
            found[k][1].branches.append(
                Branch(
                    own, correlations, float(self.exchange[b]), self.score[b], float(self.log_odds[b]),
                    _keys(self.ways[b]), (int(self.plots[b, 0]), int(self.plots[b, 1])), bool(self.shared[b]),
                )
            )  # fmt: skip
        return dict(found)


def _packed(past: list[tuple[Key, ...]]) -> Ints:
    """(K, ALIKE, 3) explanations of K pairs, newest first."""
    packed = np.full((len(past), ALIKE, 3), NOTHING)
    for row, keys in zip(packed, past, strict=True):
        row[: len(keys)] = np.reshape(keys, (-1, 3))
    return packed


def _keys(packed: Ints) -> tuple[Key, ...]:
    """The explanations of (ALIKE, 3)."""
    return tuple((bool(shared), int(i), int(j)) for shared, i, j in packed if shared != NOTHING)
