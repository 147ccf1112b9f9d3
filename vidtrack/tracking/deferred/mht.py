"""Multiple hypothesis tracking (Reid 1979), with k-best assignments (Cox and Hingorani 1996)."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.clusters import clusters
from vidtrack.associate.problem import Problem
from vidtrack.decision import Event
from vidtrack.errors import ConfigError
from vidtrack.tracking.deferred.forest import Growth, Window, one_each
from vidtrack.tracking.deferred.generation import NEVER, agreeing, children, likeliest
from vidtrack.tracking.deferred.hypotheses import Hypotheses, surviving
from vidtrack.tracking.register import Register
from vidtrack.tracks import TENTATIVE

SURE = 0.9
"""Smallest total probability of the hypotheses with a track, for its confirmation."""
CLEAR = float(np.log(3))
"""ln of the odds for an exchange of tracks from which it is reported and decided."""


@dataclass(frozen=True, slots=True)
class MHT:
    """Multiple hypothesis tracking: the origin of a measurement is decided some scans later.

    n_scan       a scan is decided this many scans later, as the likeliest hypothesis has it
    hypotheses   largest number kept in each cluster
    threshold    hypotheses less probable than this are dropped
    mass         of each cluster the likeliest are kept whose probabilities sum to this
    branches     largest number of measurements a leaf may branch to, the likeliest
    new_share    density of the measurements that new targets begin with, per density of false ones

    A track is confirmed by its life cycle if nearly all hypotheses, by probability, contain it. The output is the
    likeliest hypothesis after each scan, so a later scan may contradict it; tracks exchange what they took only if that
    is clearly likelier. Blobs of several vehicles (Occlusion) are
    not recognised.
    """

    n_scan: int = 3
    hypotheses: int = 100
    threshold: float = 1e-4
    mass: float = 0.9999
    branches: int = 10
    new_share: float = 0.1

    def __post_init__(self) -> None:
        if not 1 <= self.n_scan <= 20:
            raise ConfigError(f"n_scan is {self.n_scan}; it must lie in 1..20 (hypotheses=1 decides at once)")
        for name in ("hypotheses", "branches"):
            if not 1 <= getattr(self, name) <= 100_000:
                raise ConfigError(f"{name} is {getattr(self, name)}; it must lie in 1..100000")
        if not 0 <= self.threshold < 1:
            raise ConfigError(f"threshold is {self.threshold}; it must be at least 0 and below 1")
        if not 0 < self.mass <= 1:
            raise ConfigError(f"mass is {self.mass}; it must be above 0, at most 1")
        if not 0 < self.new_share < np.inf:
            raise ConfigError(f"share of new targets is {self.new_share}; it must be a finite number above 0")

    @property
    def slack(self) -> float:
        """How much less probable [ln] than the likeliest a hypothesis may be: at most 1 / threshold times."""
        return float(-np.log(self.threshold)) if self.threshold > 0 else np.inf

    def forest(self) -> HypothesisForest:
        """A new tracker's trees."""
        return HypothesisForest(self)


class HypothesisForest:
    """Track trees; each hypothesis is a set of leaves.

    hypotheses  which leaves are true together
    window      what each leaf took in the undecided scans
    told        (T,) rows whose tree has been in the output
    follows     (T,) rows that continue what the output had of their tree, if it had anything
    """

    STATE = ("hypotheses", "window", "sure", "told", "follows", "shown")
    ADDED: ClassVar = {"follows": lambda forest: np.ones(len(forest.told), bool)}

    def __init__(self, rule: MHT) -> None:
        self.rule = rule
        self.hypotheses = Hypotheses.none()
        self.window = Window(rule.n_scan)
        self.sure = np.empty(0, bool)
        self.told = np.empty(0, bool)
        self.follows = np.empty(0, bool)
        self.shown = np.empty(0, np.int64)

    def grow(self, problem: Problem, register: Register, starts: Mask, events: list[Event]) -> Growth:
        """Cluster, generate, prune, decide the scan N back."""
        problem = problem.only(likeliest(problem.pairs.start, problem.pairs.log_l, self.rule.branches))
        tree = np.unique(register.id, return_inverse=True)[1]
        found = self._children(problem, tree, starts)

        rows, count = problem.rows, problem.measurements
        source = np.concatenate([problem.pairs.row, np.arange(rows)])  # leaf that a code comes from; then births
        taken = np.concatenate([problem.pairs.measurement, np.full(rows, -1)])
        window, follows = self._moved(source, taken, tree, count)
        chosen = found.steady(window.past, follows, CLEAR)
        found = found.only(self._agreeing(found, chosen, source, tree, count))
        used = np.zeros(len(source) + count, bool)
        used[found.leaf] = True
        grown, born = used[: len(source)], used[len(source) :]
        parent, taken = source[grown], taken[grown]

        self.hypotheses = found._replace(leaf=(np.cumsum(used) - 1)[found.leaf])
        window.keep(used)
        self.window, self.follows = window, follows[used]
        self.told = np.concatenate([self.told[parent], np.zeros(born.sum(), bool)])
        self.shown = self._reported()
        gone = np.setdiff1d(register.id, register.id[parent])
        events.extend(Event(problem.scan.t, int(i), "delete", "no likely hypothesis holds it") for i in gone)
        register.keep(parent)
        return Growth(problem.of(parent), one_each(parent, taken), born)

    def settle(self, register: Register, t: float, events: list[Event]) -> None:
        """Show the likeliest hypothesis, and tentative tracks that only less likely hypotheses have.

        A tree that is no longer shown comes back, if ever, under another id.
        """
        best, p = self._reported(), self._held()
        self.shown = np.concatenate([best, self._doubted(best, p, register)])
        now = np.isin(register.id, register.id[self.shown])
        for old, new in zip(*register.rename(self.told & ~now), strict=True):
            events.append(Event(t, int(old), "delete", "the likeliest hypothesis has no such track"))
            events.append(Event(t, int(new), "birth", f"less likely hypotheses go on with track {old}"))
        self.told = now
        tree = np.unique(register.id, return_inverse=True)[1]
        self.sure = np.bincount(tree, p)[tree] >= SURE

    def keep(self, kept: Mask) -> None:
        """Drop all rows but these; hypotheses that differ in others only become one."""
        kept = np.concatenate([kept, np.ones(len(self.window) - len(kept), bool)])
        label = self._cluster_of_leaf()
        label[~kept] = -1
        found = self.hypotheses.marginal(label)
        self.hypotheses = found._replace(leaf=(np.cumsum(kept) - 1)[found.leaf])
        self.window.keep(kept)
        self.told, self.follows = self.told[kept], self.follows[kept]
        self.shown = self._reported()

    def add(self, count: int) -> None:
        """Trees in the only hypothesis of a cluster of their own."""
        first, more = len(self.window), np.arange(1, count + 1)
        old = self.hypotheses
        self.hypotheses = Hypotheses(
            np.concatenate([old.first, old.first[-1] + more]),
            np.concatenate([old.log_p, np.zeros(count)]),
            np.concatenate([old.start, old.start[-1] + more]),
            np.concatenate([old.leaf, first + more - 1]),
        )
        self.window.add(count)
        self.shown = np.concatenate([self.shown, first + more - 1])
        self.told = np.concatenate([self.told, np.ones(count, bool)])
        self.follows = np.concatenate([self.follows, np.ones(count, bool)])
        self.sure = np.concatenate([self.sure, np.ones(count, bool)])

    def _reported(self) -> Ints:
        """Rows of the hypotheses that are reported, ascending."""
        return self.hypotheses.leaves(self.hypotheses.steady(self.window.past, self.follows, CLEAR))

    def _moved(self, source: Ints, taken: Ints, tree: Ints, count: int) -> tuple[Window, Mask]:
        """The window and `follows` of all codes, as of `children`."""
        window = copy(self.window)
        window.move(source, taken, np.arange(count), count)
        follows = ~np.isin(tree, tree[self.shown])
        follows[self.shown] = True
        return window, np.concatenate([follows[source], np.ones(count, bool)])

    def _children(self, problem: Problem, tree: Ints, starts: Mask) -> Hypotheses:
        """The hypotheses after this scan that survive pruning; their leaves are codes, as of `children`."""
        rule, pairs = self.rule, problem.pairs
        parents, group = self._clustered(tree, pairs.row, pairs.measurement, problem.measurements)
        log_new = np.where(starts, np.log(rule.new_share), -np.inf)
        log_ratio = np.maximum(problem.log_ratio, NEVER)
        found = children(
            parents, group, pairs.row, pairs.measurement, log_ratio, problem.log_missed, log_new,
            rule.hypotheses, rule.slack,
        )  # fmt: skip
        return found.only(surviving(found.first, found.log_p, rule.threshold, rule.hypotheses, rule.mass))

    def _agreeing(self, found: Hypotheses, chosen: Ints, source: Ints, tree: Ints, count: int) -> Mask:
        """(H,) hypotheses that have the scan N back as the chosen one (C,) of their cluster has it."""
        none = np.full(count, -1)
        whose = np.concatenate([tree[source], len(tree) + np.arange(count)])
        then = np.concatenate([self.window.past[source, -1], none])
        young = np.concatenate([self.window.age[source] + 1, none]) == self.rule.n_scan
        return agreeing(found.first, found.start, found.leaf, chosen, whose, then, young)

    def _clustered(self, tree: Ints, row: Ints, measurement: Ints, count: int) -> tuple[Hypotheses, Ints]:
        """The hypotheses in the clusters that this scan makes, and the cluster (M,) of each measurement.

        Trees that took no measurement in common in the undecided scans are independent; a measurement in the gates
        of several clusters makes them one; one in nobody's gate is a cluster by itself.
        """
        apart = self.hypotheses.marginal(self._linked(tree))
        cluster = np.zeros(len(tree), np.int64)
        cluster[apart.leaf] = apart.cluster
        joined = clusters(cluster[row], measurement, len(apart.first) - 1, count)
        names, group = np.unique(joined, return_inverse=True)
        owner = np.full(count, -1)
        owner[measurement] = group[cluster[row]]
        alone = owner < 0
        owner[alone] = len(names) + np.arange(alone.sum())
        return apart.merged(group, len(names) + int(alone.sum()), self.rule.hypotheses, self.rule.slack), owner

    def _linked(self, tree: Ints) -> Ints:
        """(T,) leaves that depend on each other have the same number."""
        past = self.window.past
        leaf, scan = np.nonzero(past >= 0)
        number = self.window.seen - 1 - past[leaf, scan]
        trees = number.max(initial=-1) + 1 + tree
        every = np.arange(len(tree))
        return clusters(
            np.concatenate([leaf, every]), np.concatenate([number, trees]), len(tree), int(trees.max(initial=-1)) + 1
        )

    def _cluster_of_leaf(self) -> Ints:
        """(T,) cluster of each row."""
        cluster = np.full(len(self.window), -1)
        cluster[self.hypotheses.leaf] = self.hypotheses.cluster
        return cluster

    def _doubted(self, best: Ints, p: Floats, register: Register) -> Ints:
        """The likeliest leaf, by probability p (T,), of each tentative tree without a leaf among the best (B,).

        Leaves that share a measurement of the undecided scans with a best leaf or an older tree's leaf are left out.
        """
        past, name = self.window.past, register.id
        taken = np.isin(past, past[best]) & (past >= 0)
        rows = np.flatnonzero((register.status == TENTATIVE) & ~np.isin(name, name[best]) & ~taken.any(axis=1))
        rows = rows[np.lexsort((-p[rows], name[rows]))]
        rows = rows[np.unique(name[rows], return_index=True)[1]]
        past = past[rows]
        _, first, place = np.unique(past, return_index=True, return_inverse=True)
        owner = first[place.reshape(past.shape)] // past.shape[1]
        return rows[((owner == np.arange(len(rows))[:, None]) | (past < 0)).all(axis=1)]

    def _held(self) -> Floats:
        """(T,) sum of the probabilities of the hypotheses that have each leaf."""
        p = np.repeat(np.exp(self.hypotheses.log_p), np.diff(self.hypotheses.start))
        held: Floats = np.bincount(self.hypotheses.leaf, p, len(self.window)).astype(float)
        return held
