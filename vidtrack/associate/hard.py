"""Hard association: each track takes at most one measurement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from vidtrack.arrays.rows import every, starts
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.assignment import assign
from vidtrack.associate.clusters import clusters
from vidtrack.associate.problem import Problem
from vidtrack.compiled import inlined, kernel
from vidtrack.decision import Decision
from vidtrack.errors import ConfigError


class Associator(Protocol):
    """A rule that turns gated pairs into weights.

    gated_births  whether an unassigned measurement in a track's gate may start a track
    """

    @property
    def gated_births(self) -> bool: ...

    def decide(self, problem: Problem) -> Decision:
        """Weights of the measurements for each track."""


@dataclass(frozen=True, slots=True)
class NN:
    """Nearest neighbour: each track takes its nearest measurement; two tracks may take the same one.

    gated_births  off: a measurement in a gate starts no track, else every redundant measurement would start one
    """

    gated_births: bool = False

    def decide(self, problem: Problem) -> Decision:
        """Smallest cost in each row."""
        pairs = problem.pairs
        return one_hot(_nearest(pairs.start, pairs.measurement, pairs.cost))


@dataclass(frozen=True, slots=True)
class GNN:
    """Global nearest neighbour: the exclusive assignment of least summed cost, d2 + ln|S|.

    ln|S| makes tracks with different covariances comparable.

    convention    cost of an unassigned track (SPEC 001, `gnn_nonassignment`). missed-track: the cost of a measurement
                  at the edge of its gate, with the largest ln|S| of the cluster. Every gated pair then costs less
                  than a miss, and a good pair and a miss cost less than two bad pairs. maximum-cardinality: larger
                  than any saving by pairs, so that as few tracks as possible are unassigned
    gated_births  whether an unassigned measurement in a track's gate may start a track

    Raises ConfigError for another convention.
    """

    convention: Literal["missed-track", "maximum-cardinality"] = "missed-track"
    gated_births: bool = True

    def __post_init__(self) -> None:
        _refuse_unknown("convention", self.convention, ("missed-track", "maximum-cardinality"))

    def decide(self, problem: Problem) -> Decision:
        """Optimal assignment, cluster by cluster."""
        return one_hot(self.taken(problem, every(problem.rows), every(problem.measurements)))

    def taken(self, problem: Problem, rows: Mask, free: Mask) -> Ints:
        """(T,) measurement of each track, -1 for none; only these rows (T,) may take one, and only free ones (M,)."""
        pairs = problem.pairs
        cardinal = self.convention == "maximum-cardinality"
        return _assigned(pairs.row, pairs.measurement, pairs.d2, pairs.cost, pairs.limit, rows, free, cardinal)


@dataclass(frozen=True, slots=True)
class GreedyGNN:
    """Sub-optimal global nearest neighbour (SPEC 001): exclusive and greedy.

    order         cost: pairs in order of cost; track: the first track takes its nearest measurement, then the second
                  its nearest of the rest, and so on
    gated_births  whether an unassigned measurement in a track's gate may start a track

    Raises ConfigError for another order.
    """

    order: Literal["cost", "track"] = "cost"
    gated_births: bool = True

    def __post_init__(self) -> None:
        _refuse_unknown("order", self.order, ("cost", "track"))

    def decide(self, problem: Problem) -> Decision:
        """Each pair in that order, if track and measurement are still free."""
        pairs = problem.pairs
        keys = (pairs.cost,) if self.order == "cost" else (pairs.cost, pairs.row)
        return one_hot(_first_come(np.lexsort(keys), pairs.row, pairs.measurement, problem.rows, problem.measurements))


def _refuse_unknown(name: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise ConfigError(f"the {name} of the global nearest neighbour is {value!r}; choose from {', '.join(known)}")


HARD = (NN, GNN, GreedyGNN)
"""Rules that assign whole measurements by distance alone."""


def one_hot(taken: Ints) -> Decision:
    """Decision of a hard rule: taken (T,) measurement of each track, -1 for none."""
    return Decision(*_one_hot(taken))


@kernel
def _one_hot(taken: Ints) -> tuple[Ints, Ints, Ints, Floats, Floats]:
    row, measurement, beta0 = np.empty_like(taken), np.empty_like(taken), np.ones(len(taken))
    n = 0
    for t in range(len(taken)):
        if taken[t] >= 0:
            row[n], measurement[n], beta0[t] = t, taken[t], 0.0
            n += 1
    return np.arange(len(taken)), row[:n], measurement[:n], np.ones(n), beta0


@kernel
def _nearest(start: Ints, measurement: Ints, cost: Floats) -> Ints:
    taken = np.full(len(start) - 1, -1)
    for t in range(len(taken)):
        best = np.inf
        for k in range(start[t], start[t + 1]):
            if cost[k] < best:
                best, taken[t] = cost[k], measurement[k]
    return taken


@kernel
def _first_come(order: Ints, row: Ints, measurement: Ints, rows: int, measurements: int) -> Ints:
    """(T,) measurement of each row, -1 for none, if pairs are taken in this order."""
    taken, free = np.full(rows, -1), np.ones(measurements, np.bool_)
    for k in order:
        if taken[row[k]] < 0 and free[measurement[k]]:
            taken[row[k]] = measurement[k]
            free[measurement[k]] = False
    return taken


@kernel
def _assigned(
    row: Ints, measurement: Ints, d2: Floats, cost: Floats, limit: Floats, rows: Mask, free: Mask, cardinal: bool
) -> Ints:
    """(T,) the assignment of least cost; `cardinal`: with as few unassigned rows as possible."""
    n, most = 0, len(row)
    taker, choice, near, price = np.empty_like(row), np.empty_like(row), np.empty(most), np.empty(most)
    for k in range(most):
        if rows[row[k]] and free[measurement[k]]:
            taker[n], choice[n], near[n], price[n] = row[k], measurement[k], d2[k], cost[k]
            n += 1
    taker, choice, near, price = taker[:n], choice[:n], near[:n], price[:n]
    if cardinal:
        miss = np.full(len(limit), _never(price, len(limit)))
    else:
        miss = _edge(taker, choice, near, price, limit, len(free))
    return assign(starts(taker, len(limit)), choice, price, miss, len(free))


@inlined
def _never(cost: Floats, rows: int) -> float:
    """A cost larger than any difference between two assignments."""
    most = 0.0
    for k in range(len(cost)):
        most = max(most, abs(cost[k]))
    return (1 + rows) * (1.0 + most)


@inlined
def _edge(row: Ints, measurement: Ints, d2: Floats, cost: Floats, limit: Floats, measurements: int) -> Floats:
    """(T,) cost of a measurement at the edge of each row's gate, with the largest ln|S| of the cluster."""
    cluster = clusters(row, measurement, len(limit), measurements)
    most = np.full(len(limit), -np.inf)
    for k in range(len(row)):
        most[cluster[row[k]]] = max(most[cluster[row[k]]], cost[k] - d2[k])
    edge, never = np.empty(len(limit)), _never(cost, len(limit))
    for t in range(len(limit)):
        edge[t] = min(never, limit[t] + (most[cluster[t]] if most[cluster[t]] > -np.inf else 0.0))
    return edge
