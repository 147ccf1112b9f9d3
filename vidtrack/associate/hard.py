"""Hard association: each track takes one measurement or none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit

from vidtrack.associate.assignment import assign
from vidtrack.associate.clusters import clusters
from vidtrack.associate.gate import Pairs
from vidtrack.scan import Decision, Floats, Ints


class Associator(Protocol):
    """A rule that turns gated pairs into weights."""

    def decide(self, pairs: Pairs, rows: int, measurements: int) -> Decision:
        """Weights of the measurements for each of `rows` tracks."""


@dataclass(frozen=True, slots=True)
class NN:
    """Nearest neighbour: each track takes its nearest measurement; two tracks may take the same one."""

    def decide(self, pairs: Pairs, rows: int, measurements: int) -> Decision:
        """Smallest d2 + ln|S| in each row."""
        return one_hot(_nearest(pairs.start, pairs.measurement, pairs.d2 + pairs.log_s))


@dataclass(frozen=True, slots=True)
class GNN:
    """Global nearest neighbour: the exclusive assignment of least summed d2 + ln|S|.

    A track may stay without a measurement at the cost of one at the edge of its gate, the "missed-track"
    convention (SPEC 001, `gnn_nonassignment`): two bad pairs never beat one good pair and a miss.
    ln|S| makes tracks of different certainty comparable; a miss is priced at the largest ln|S| of the
    cluster, so that every gated pair beats a miss.
    """

    def decide(self, pairs: Pairs, rows: int, measurements: int) -> Decision:
        """Optimal assignment, cluster by cluster."""
        cost = pairs.d2 + pairs.log_s
        cluster = clusters(pairs.row, pairs.measurement, rows, measurements)
        miss = pairs.limit + _largest(cluster, pairs.row, pairs.log_s)
        finite = np.isfinite(miss)
        miss[~finite] = 1.0 + cost.max(initial=0.0) - min(0.0, cost.min(initial=0.0))  # a gate of one: never miss
        return one_hot(assign(pairs.start, pairs.measurement, cost, miss, measurements))


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


@njit(cache=True, nogil=True)
def _nearest(start: Ints, measurement: Ints, cost: Floats) -> Ints:
    taken = np.full(len(start) - 1, -1)
    for t in range(len(taken)):
        best = np.inf
        for k in range(start[t], start[t + 1]):
            if cost[k] < best:
                best, taken[t] = cost[k], measurement[k]
    return taken


@njit(cache=True, nogil=True)
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
