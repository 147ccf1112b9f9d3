"""Track splitting, or branching (Smith and Buechler 1975): a branch for each gated measurement of a track."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.problem import Problem
from vidtrack.decision import Event
from vidtrack.errors import ConfigError
from vidtrack.tracking.deferred.forest import Growth, Window, one_each
from vidtrack.tracking.deferred.generation import NEVER, likeliest
from vidtrack.tracking.register import Register


@dataclass(frozen=True, slots=True)
class Split:
    """Track splitting: a branch of the track for every gated measurement, and one for the miss.

    n_scan       branches that took the same measurements in this many scans are merged
    leaves       largest number of branches kept of each track, the likeliest
    branches     largest number of measurements a branch may split into, the likeliest
    probability  share of true branches that the test of their score admits: the sum of v' S^-1 v over the last
                 n_scan scans is chi-square distributed

    A measurement may update several tracks. A branch without a miss, and without a measurement in common with its
    track's likeliest branch, in n_scan scans becomes a separate track. A measurement in a gate starts no track.
    """

    n_scan: int = 3
    leaves: int = 20
    branches: int = 10
    probability: float = 0.999

    def __post_init__(self) -> None:
        for name, most in (("n_scan", 20), ("leaves", 10_000), ("branches", 10_000)):
            if not 1 <= getattr(self, name) <= most:
                raise ConfigError(f"{name} is {getattr(self, name)}; it must lie in 1..{most}")
        if not 0 < self.probability < 1:
            raise ConfigError(f"branch probability is {self.probability}; it must lie between 0 and 1")

    def forest(self) -> BranchForest:
        """A new tracker's trees."""
        return BranchForest(self)


class BranchForest:
    """Independent track trees, without joint hypotheses.

    score  (T, N) v' S^-1 v of the last scans, newest first, zero for a miss
    log_l  (T,) log-likelihood ratio of each branch, target against none
    """

    STATE = ("window", "score", "log_l", "shown")

    def __init__(self, rule: Split) -> None:
        self.rule = rule
        self.window = Window(rule.n_scan)
        self.score = np.empty((0, rule.n_scan))
        self.log_l = np.empty(0)
        self.shown = np.empty(0, np.int64)

    @property
    def sure(self) -> Mask:
        """(T,) true: no hypothesis competes with a branch."""
        return np.ones(len(self.window), bool)

    def grow(self, problem: Problem, register: Register, starts: Mask, events: list[Event]) -> Growth:
        """Branch, drop implausible branches, merge duplicates; measurements outside all gates start trees."""
        in_gate = np.zeros(problem.measurements, bool)
        in_gate[problem.pairs.measurement] = True
        born = starts & ~in_gate
        problem = problem.only(likeliest(problem.pairs.start, problem.pairs.log_l, self.rule.branches))
        parent, taken = self._branched(problem, np.flatnonzero(born))
        alive = self._thinned(register.id[parent], problem.cov.shape[1])
        parent, taken = parent[alive], taken[alive]
        new = int(born.sum())
        self.window.keep(np.concatenate([alive, len(self.window) - new + np.arange(new)]))
        self.score = np.concatenate([self.score[alive], np.zeros((new, self.rule.n_scan))])
        self.log_l = np.concatenate([self.log_l[alive], np.zeros(new)])
        gone = np.setdiff1d(register.id, register.id[parent])
        reason = "another track took the same measurements"
        events.extend(Event(problem.scan.t, int(track), "delete", reason) for track in gone)
        register.keep(parent)
        self._show(np.concatenate([register.id, -1 - np.arange(new)]))
        return Growth(problem.of(parent), one_each(parent, taken), born)

    def settle(self, register: Register, t: float, events: list[Event]) -> None:
        """Make a branch without measurements in common with its tree's likeliest branch a separate tree.

        Of each tree and each measurement one, the likeliest, and only with what no tree's likeliest took.
        """
        self._show(register.id)
        past, log_l = self.window.past, self.log_l
        trees, tree = np.unique(register.id, return_inverse=True)
        best = np.empty(len(trees), np.int64)
        best[tree[self.shown]] = self.shown
        unexplained = ~np.isin(past[:, 0], past[self.shown, 0])
        leaving = np.flatnonzero((past >= 0).all(axis=1) & (past != past[best[tree]]).all(axis=1) & unexplained)
        for group in (tree, past[:, 0]):
            leaving = leaving[_rank(group[leaving], log_l[leaving]) == 0]
        for old, new in zip(*register.rename(leaving), strict=True):
            events.append(Event(t, int(new), "birth", f"a branch of track {old} went its own way"))
        self._show(register.id)

    def keep(self, kept: Mask) -> None:
        """Drop all rows but these."""
        kept = np.concatenate([kept, np.ones(len(self.window) - len(kept), bool)])
        self.window.keep(kept)
        self.score, self.log_l = self.score[kept], self.log_l[kept]
        self.shown = np.empty(0, np.int64)  # until it is settled

    def add(self, count: int) -> None:
        """Trees of one branch each."""
        self.shown = np.concatenate([self.shown, len(self.window) + np.arange(count)])
        self.window.add(count)
        self.score = np.concatenate([self.score, np.zeros((count, self.rule.n_scan))])
        self.log_l = np.concatenate([self.log_l, np.zeros(count)])

    def _branched(self, problem: Problem, born: Ints) -> tuple[Ints, Ints]:
        """Parents (K,) and measurements (K,), -1 for none, of all branches; their scores are brought up to date."""
        pairs, every = problem.pairs, np.arange(problem.rows)
        parent = np.concatenate([pairs.row, every])
        taken = np.concatenate([pairs.measurement, np.full(len(every), -1)])
        newest = np.concatenate([pairs.nis, np.zeros(len(every))])
        self.score = np.column_stack([newest, self.score[parent, :-1]])
        self.log_l = self.log_l[parent] + np.concatenate([np.maximum(problem.log_ratio, NEVER), problem.log_missed])
        self.window.move(parent, taken, born, problem.measurements)
        return parent, taken

    def _thinned(self, tree: Ints, dim: int) -> Ints:
        """Rows, ascending, of plausible branches among the likeliest of their tree, without duplicates."""
        alive = self._plausible(tree, dim)
        alive = alive[self._different(tree[alive], self.window.past[alive], self.window.age[alive], self.log_l[alive])]
        return np.sort(alive[_rank(tree[alive], self.log_l[alive]) < self.rule.leaves])

    def _plausible(self, tree: Ints, dim: int) -> Ints:
        """Rows whose score passes the test, and the likeliest of each tree."""
        updates = (self.window.past[: len(tree)] >= 0) & (self.score > 0)
        limit = chdtri(np.maximum(1, dim * updates.sum(axis=1)), 1 - self.rule.probability)
        return np.flatnonzero((self.score.sum(axis=1) <= limit) | (_rank(tree, self.log_l) == 0))

    def _different(self, tree: Ints, past: Ints, age: Ints, log_l: Floats) -> Ints:
        """One of the rows that took the same measurements: a tree's likeliest, then the oldest, then the likeliest.

        Rows with a miss are the same in one tree only. A tree whose likeliest is another's too goes altogether.
        """
        whose = np.where((past >= 0).all(axis=1), -1, tree)
        best = _rank(tree, log_l) == 0
        order = np.lexsort((-log_l, -age, ~best, whose, *past.T))
        same = (past[order[1:]] == past[order[:-1]]).all(axis=1) & (np.diff(whose[order]) == 0)
        first = np.ones(len(order), bool)
        first[1:] = ~same
        lost = np.setdiff1d(tree[best], tree[order[first]][best[order[first]]])
        return order[first & ~np.isin(tree[order], lost)]

    def _show(self, tree: Ints) -> None:
        """Each tree shows its likeliest branch."""
        self.shown = np.flatnonzero(_rank(tree, self.log_l) == 0)


def _rank(tree: Ints, log_l: Floats) -> Ints:
    """(T,) place of each row among those of its tree, the likeliest first."""
    order = np.lexsort((-log_l, tree))
    first = np.searchsorted(tree[order], tree[order])
    rank = np.empty(len(tree), np.int64)
    rank[order] = np.arange(len(tree)) - first
    return rank
