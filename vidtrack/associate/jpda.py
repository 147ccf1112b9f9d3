"""Joint probabilistic data association: weights from all joint events of tracks and measurements."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.assignment import solve
from vidtrack.associate.belief import propagate
from vidtrack.associate.clusters import clusters
from vidtrack.associate.events import Side, exact, frontier, plan, reverse
from vidtrack.associate.jpda_star import likeliest_events
from vidtrack.associate.problem import Problem
from vidtrack.compiled import kernel
from vidtrack.decision import Decision

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class JPDA:
    """Joint probabilistic data association (SPEC 001), exact, cluster by cluster.

    In a joint event each track takes at most one gated measurement, and each measurement belongs to at most one track.
    The weight of a pair is the probability of all joint events that contain it. A cluster that needs more than
    `largest` steps times states gets the weights of loopy belief propagation; the decision marks its rows as
    approximate, and the log reports it.

    largest       bounds the time for a cluster; with 2^16, 12 tracks that share 14 measurements are still exact
    star          JPDA* (Blom and Bloem 2000): of the events that give the same measurements to the same tracks in
                  another order, only the likeliest counts; tracks of close targets then do not coalesce
    gated_births  a measurement in a gate may start a track if its weights are small
    """

    largest: int = 2**16
    star: bool = False
    gated_births: bool = True

    def decide(self, problem: Problem) -> Decision:
        """Marginal probabilities of the joint events.

        The factors are scaled by the potentials of the likeliest event, which does not change the probabilities. That
        event then has weight one and all others less: nothing overflows, and what underflows is negligible.
        """
        pairs = problem.pairs
        log_pair, log_miss = problem.log_ratio, problem.log_missed
        _, u, v = solve(pairs.start, pairs.measurement, -log_pair, -log_miss, problem.measurements)
        beta, beta0, approximate = _marginals(
            pairs.start,
            pairs.row,
            pairs.measurement,
            np.exp(log_pair + u[pairs.row] + v[pairs.measurement]),
            np.exp(log_miss + u),
            np.exp(v),
            self.largest,
            self.star,
        )
        if approximate.any():
            log.info(
                "JPDA: belief propagation for %d of %d tracks, in clusters too large for exact weights",
                approximate.sum(),
                problem.rows,
            )
        return Decision(
            parent=np.arange(problem.rows),
            row=pairs.row,
            measurement=pairs.measurement,
            beta=beta,
            beta0=beta0,
            approximate=approximate,
        )


@kernel
def _marginals(
    start: Ints, row: Ints, measurement: Ints, factor: Floats, miss: Floats, unused: Floats, largest: int, star: bool
) -> tuple[Floats, Floats, Mask]:
    """beta (N,), beta0 (T,) and which rows (T,) are approximate."""
    first, back, pair = reverse(start, measurement, len(unused))
    rows = Side(start, measurement, np.arange(len(measurement)), miss)
    columns = Side(first, back, pair, unused)
    row_frontier, column_frontier = frontier(start), frontier(first)
    beta, beta0, idle = np.zeros(len(row)), np.zeros(len(miss)), np.zeros(len(unused))
    approximate = np.zeros(len(miss), np.bool_)
    met, place = np.zeros(len(unused), np.bool_), np.empty(len(unused), np.int64)
    cluster = clusters(row, measurement, len(miss), len(unused))
    members = np.argsort(cluster, kind="mergesort")
    begin = 0
    while begin < len(members):
        end = begin + 1
        while end < len(members) and cluster[members[end]] == cluster[members[begin]]:
            end += 1
        tracks = members[begin:end]
        begin = end
        if start[tracks[0]] == start[tracks[0] + 1]:
            beta0[tracks[0]] = 1.0
            continue
        contested = _met(tracks, rows, met)
        if star:
            solved = likeliest_events(tracks, contested, rows, columns, place, factor, beta, beta0, largest)
        else:
            by_row, row_width = plan(tracks, rows, column_frontier, largest)
            by_column, column_width = plan(contested, columns, row_frontier, largest)
            solved = row_width >= 0 or column_width >= 0
            if row_width >= 0 and (column_width < 0 or len(by_row) << row_width < len(by_column) << column_width):
                exact(by_row, row_width, rows, column_frontier, unused, factor, beta, beta0, idle)
            elif solved:
                exact(by_column, column_width, columns, row_frontier, miss, factor, beta, idle, beta0)
        if not solved:
            for t in tracks:
                approximate[t] = True
            propagate(tracks, contested, rows, columns, factor, beta, beta0)
    return beta, beta0, approximate


@kernel
def _met(tracks: Ints, rows: Side, met: Mask) -> Ints:
    """The measurements that a cluster's tracks can take, in order of first occurrence."""
    found, n = np.empty(rows.start[tracks + 1].sum() - rows.start[tracks].sum(), np.int64), 0
    for t in tracks:
        for e in range(rows.start[t], rows.start[t + 1]):
            if not met[rows.other[e]]:
                met[rows.other[e]] = True
                found[n] = rows.other[e]
                n += 1
    return found[:n].copy()
