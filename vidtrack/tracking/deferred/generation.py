"""From the hypotheses of one scan to those of the next (Reid 1979; Cox and Hingorani 1996)."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.median import ranked
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.kbest import k_best
from vidtrack.compiled import kernel
from vidtrack.tracking.deferred.hypotheses import Hypotheses, log_sum

WORK = 2_000_000
"""Measurements, leaves and pairs of a cluster that the search for its children may go through, in all its solutions."""

NEVER = -1e6
"""ln of the factor that stands for probability zero; hypotheses with the fewest such factors win."""


def children(
    parents: Hypotheses,
    group: Ints,
    pair_row: Ints,
    pair_measurement: Ints,
    log_ratio: Floats,
    log_missed: Floats,
    log_new: Floats,
    most: int,
    slack: float,
) -> Hypotheses:
    """The `most` likeliest children of all hypotheses of each cluster, and their probabilities.

    group (M,) cluster of each measurement; pairs (P,) of leaves and measurements with log_ratio = ln(P_D N(v; 0, S)
    / clutter density); log_missed (T,) = ln(1 - P_D); log_new (M,) = ln(new density / clutter density), -inf for
    what starts no track. In each child every measurement continues one leaf of its parent, starts a track or is
    false (Reid's formula over the clutter density of all measurements, SPEC 001). Children less probable than the
    likeliest by over `slack` [ln] are left out, in very large clusters those that WORK does not reach too.

    The children's leaves are codes: pair p is p, leaf t missed is P + t, a track that measurement j starts is
    P + T + j.
    """
    clusters, measurements = len(parents.first) - 1, len(group)
    in_cluster = np.argsort(group, kind="stable")
    begin = np.searchsorted(group[in_cluster], np.arange(clusters + 1))
    of_measurement = np.argsort(pair_measurement, kind="stable")
    pairs = np.searchsorted(pair_measurement[of_measurement], np.arange(measurements + 1))
    return Hypotheses(
        *_children(
            parents.first, parents.log_p, parents.start, parents.leaf, begin, in_cluster, pairs, of_measurement,
            pair_row, log_ratio, log_missed, log_new, most, slack,
        )
    )  # fmt: skip


@kernel
def _children(
    first: Ints, log_p: Floats, start: Ints, leaf: Ints, begin: Ints, in_cluster: Ints,
    pairs: Ints, of_measurement: Ints, pair_row: Ints, log_ratio: Floats, log_missed: Floats, log_new: Floats,
    most: int, slack: float,
) -> tuple[Ints, Floats, Ints, Ints]:  # fmt: skip
    n_pairs, leaves = len(pair_row), len(log_missed)
    local, got = np.full(leaves, -1), np.full(leaves, -1)
    out_first, out_start = [0], [0]
    out_p, out_code = [0.0 for _ in range(0)], [0 for _ in range(0)]  # empty, of a type the compiler knows
    for c in range(len(first) - 1):
        a, b = first[c], first[c + 1]
        members = [0 for _ in range(0)]
        for e in range(start[a], start[b]):
            if local[leaf[e]] < 0:
                local[leaf[e]] = len(members)
                members.append(leaf[e])
        offset, held = -log_p[a:b], np.zeros((b - a, len(members)), np.bool_)
        for i in range(b - a):
            for e in range(start[a + i], start[a + i + 1]):
                held[i, local[leaf[e]]] = True
                offset[i] -= log_missed[leaf[e]]
        own = in_cluster[begin[c] : begin[c + 1]]
        edge, column, cost = [0 for _ in range(0)], [0 for _ in range(0)], [0.0 for _ in range(0)]
        bound, alone = np.zeros(len(own) + 1, np.int64), np.zeros((len(own), 2))
        for i in range(len(own)):
            for s in range(pairs[own[i]], pairs[own[i] + 1]):
                p = of_measurement[s]
                t = pair_row[p]
                if local[t] >= 0:
                    edge.append(p)
                    column.append(local[t])
                    cost.append(log_missed[t] - log_ratio[p])
            bound[i + 1] = len(edge)
            alone[i, 1] = -log_new[own[i]]
        solutions = WORK // (len(edge) + len(own) + len(members) + 1)
        problem, choice, total = k_best(
            offset, held, bound, np.array(column), np.array(cost), alone, most, slack, solutions
        )
        total = -total - log_sum(-total)
        for n in range(len(problem)):
            h = a + problem[n]
            for i in range(len(own)):
                if choice[n, i] >= 0:
                    p = edge[choice[n, i]]
                    got[pair_row[p]] = p
                elif choice[n, i] == -2:
                    out_code.append(n_pairs + leaves + own[i])
            for e in range(start[h], start[h + 1]):
                t = leaf[e]
                out_code.append(n_pairs + t if got[t] < 0 else got[t])
                got[t] = -1
            out_p.append(total[n])
            out_start.append(len(out_code))
        out_first.append(len(out_p))
        for t in members:
            local[t] = -1
    return np.array(out_first), np.array(out_p), np.array(out_start), np.array(out_code)


@kernel
def agreeing(first: Ints, start: Ints, leaf: Ints, chosen: Ints, tree: Ints, decided: Ints, young: Mask) -> Mask:
    """(H,) hypotheses that agree with the chosen one (C,) of their cluster about one scan in the past.

    Of each leaf: tree (T,), decided (T,) its measurement in that scan, young (T,) whether its tree began in that scan.
    A track that only one of two hypotheses has is no disagreement: the other has deleted it since.
    """
    agrees = np.ones(len(start) - 1, np.bool_)
    taken = np.empty(tree.max() + 1 if len(tree) else 0, np.int64)
    has = np.zeros(len(taken), np.bool_)
    for c in range(len(first) - 1):
        best = chosen[c]
        begun = 0
        for e in range(start[best], start[best + 1]):
            t = leaf[e]
            has[tree[t]], taken[tree[t]] = True, decided[t]
            begun += young[t]
        for h in range(first[c], first[c + 1]):
            others = 0
            for e in range(start[h], start[h + 1]):
                t = leaf[e]
                others += young[t]
                agrees[h] &= taken[tree[t]] == decided[t] if has[tree[t]] else not young[t]
            agrees[h] &= others == begun
        for e in range(start[best], start[best + 1]):
            has[tree[leaf[e]]] = False
    return agrees


@kernel
def likeliest(start: Ints, value: Floats, most: int) -> Mask:
    """(P,) the `most` pairs of largest value in each row, the first of equals; row t has start[t]..start[t + 1]."""
    chosen = np.ones(len(value), np.bool_)
    for t in range(len(start) - 1):
        mine = value[start[t] : start[t + 1]]
        if len(mine) <= most:
            continue
        least = ranked(mine.copy(), len(mine) - most)
        equals = most
        for k in range(len(mine)):
            equals -= mine[k] > least
        for k in range(len(mine)):
            if mine[k] == least and equals > 0:
                equals -= 1
            else:
                chosen[start[t] + k] = mine[k] > least
    return chosen
