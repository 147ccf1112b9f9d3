"""Hard association: each track takes one measurement or none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numba import njit

from vidtrack.associate.assignment import assign
from vidtrack.associate.clusters import clusters
from vidtrack.associate.problem import Problem
from vidtrack.compiled import CACHE
from vidtrack.scan import Decision, Floats, Ints


class Associator(Protocol):
    """A rule that turns gated pairs into weights.

    gated_births  whether a measurement in a track's gate that no track got may start one
    """

    gated_births: ClassVar[bool]

    def decide(self, problem: Problem) -> Decision:
        """Weights of the measurements for each track."""


@dataclass(frozen=True, slots=True)
class NN:
    """Nearest neighbour: each track takes its nearest measurement; two tracks may take the same one.

    What lies in a gate starts no track, or each redundant measurement would.
    """

    gated_births: ClassVar[bool] = False

    def decide(self, problem: Problem) -> Decision:
        """Smallest cost in each row."""
        pairs = problem.pairs
        return one_hot(_nearest(pairs.start, pairs.measurement, pairs.cost))


@dataclass(frozen=True, slots=True)
class GNN:
    """Global nearest neighbour: the exclusive assignment of least summed cost, d2 + ln|S|.

    A track may stay without a measurement at the cost of one at the edge of its gate, the "missed-track"
    convention (SPEC 001, `gnn_nonassignment`): two bad pairs never beat one good pair and a miss.
    ln|S| makes tracks of different certainty comparable; a miss is priced with the largest ln|S| of the
    cluster, so that every gated pair beats a miss.
    """

    gated_births: ClassVar[bool] = True

    def decide(self, problem: Problem) -> Decision:
        """Optimal assignment, cluster by cluster."""
        pairs, measurements = problem.pairs, problem.measurements
        cluster = clusters(pairs.row, pairs.measurement, problem.rows, measurements)
        miss = pairs.limit + _largest(cluster, pairs.row, pairs.cost - pairs.d2)
        finite = np.isfinite(miss)
        miss[~finite] = (
            1.0 + pairs.cost.max(initial=0.0) - min(0.0, pairs.cost.min(initial=0.0))
        )  # a gate of one: never miss
        return one_hot(assign(pairs.start, pairs.measurement, pairs.cost, miss, measurements))


def one_hot(taken: Ints) -> Decision:
    """Decision of a hard rule: taken (T,) measurement of each track, -1 for none."""
    row = np.flatnonzero(taken >= 0)
    return Decision(
        parent=np.arange(len(taken)),
        row=row,
        measurement=taken[row],
        beta=np.ones(len(row)),
        beta0=(taken < 0).astype(float),
    )


@njit(cache=CACHE, nogil=True)
def _nearest(start: Ints, measurement: Ints, cost: Floats) -> Ints:
    taken = np.full(len(start) - 1, -1)
    for t in range(len(taken)):
        best = np.inf
        for k in range(start[t], start[t + 1]):
            if cost[k] < best:
                best, taken[t] = cost[k], measurement[k]
    return taken


@njit(cache=CACHE, nogil=True)
def _largest(cluster: Ints, row: Ints, value: Floats) -> Floats:
    """(T,) largest value over the pairs of each row's cluster; zero without pairs."""
    most = np.full(len(cluster), -np.inf)
    for k in range(len(row)):
        c = cluster[row[k]]
        most[c] = max(most[c], value[k])
    result = np.empty(len(cluster))
    for t in range(len(cluster)):
        result[t] = max(most[cluster[t]], most[t]) if most[cluster[t]] > -np.inf else 0.0
    return result
