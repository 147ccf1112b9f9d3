"""The k best assignments over several problems, best first (Murty 1968, Cox and Hingorani 1996)."""

from __future__ import annotations

from heapq import heapify, heappop, heappush

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.assignment import solve
from vidtrack.compiled import kernel

IMPOSSIBLE, FEASIBLE = 1e12, 1e11
"""Cost of a row without an admissible choice; every other cost is lower."""


@kernel
def k_best(
    offset: Floats,
    held: Mask,
    start: Ints,
    column: Ints,
    cost: Floats,
    alone: Floats,
    most: int,
    slack: float,
    solutions: int,
) -> tuple[Ints, Ints, Floats]:
    """The `most` cheapest assignments over all problems; those over `slack` costlier than the cheapest are left out.

    All problems h have the same rows. Row i takes edge k (start[i] <= k < start[i + 1]), column[k] at cost[k],
    or an alternative a of its own at alone[i, a], infinite if it does not exist. At most one row takes a column.
    Problem h adds offset[h] and has only the columns held[h]. Returns problem (S,), choice (S, rows) and cost (S,); a
    choice is an edge, or -1 - a.

    A node of the search is a problem whose first rows are fixed as in its parent's solution, and whose next row may
    not make its ancestors' choices. Its bound is its parent's cost plus the smallest remaining reduced cost of that
    row. It is solved only when its bound is the smallest. After so many `solutions` the search ends with what it has
    found, the cheapest at least, so that its work is bounded however many assignments cost nearly the same.
    """
    rows, cheapest = len(start) - 1, 0.0
    for i in range(rows):
        least = alone[i].min()
        for k in range(start[i], start[i + 1]):
            least = min(least, cost[k])
        cheapest += least
    problem = list(range(len(offset)))
    parent, depth = [-1 for _ in problem], [0 for _ in problem]
    banned, elder = [0 for _ in problem], [-1 for _ in problem]  # own ban; node of the earlier bans
    solution = [-1 for _ in problem]
    choices, gaps, solved = np.empty((8, rows), np.int64), np.empty((8, rows)), 0
    heap = [(offset[h] + cheapest, h) for h in problem]
    heapify(heap)
    order, found, bans = np.empty(most, np.int64), 0, [0 for _ in range(0)]
    total = np.empty(most)
    while found < most and len(heap):
        bound, node = heappop(heap)
        if found and bound > total[0] + slack:
            break
        h = problem[node]
        if solution[node] < 0:
            if solved >= solutions and found:
                break
            if solved == len(choices):
                choices, gaps = _doubled(choices), _doubled(gaps)
            bans.clear()
            ban = node if parent[node] >= 0 else -1
            while ban >= 0:
                bans.append(banned[ban])
                ban = elder[ban]
            fixed = choices[max(0, solution[parent[node]])]
            exact = _complete(
                held[h], start, column, cost, alone, depth[node], fixed, bans, choices[solved], gaps[solved]
            )
            if exact < FEASIBLE:
                solution[node] = solved
                solved += 1
                heappush(heap, (offset[h] + exact, node))
            continue
        order[found], total[found] = node, bound
        found += 1
        for i in range(depth[node], rows):
            gap = gaps[solution[node], i]
            if gap < FEASIBLE:
                heappush(heap, (bound + gap, len(problem)))
                problem.append(h)
                parent.append(node)
                depth.append(i)
                banned.append(choices[solution[node], i])
                elder.append(node if i == depth[node] and parent[node] >= 0 else -1)
                solution.append(-1)
    of, choice = np.empty(found, np.int64), np.empty((found, rows), np.int64)
    for n in range(found):
        of[n] = problem[order[n]]
        for i in range(rows):
            choice[n, i] = choices[solution[order[n]], i]
    return of, choice, total[:found]


@kernel
def _complete(
    held: Mask, start: Ints, column: Ints, cost: Floats, alone: Floats,
    depth: int, fixed: Ints, bans: list[int], choice: Ints, gap: Floats,
) -> float:  # fmt: skip
    """Best completion of the first `depth` rows of `fixed`; returns its cost, IMPOSSIBLE or more if there is none.

    Writes choice (rows,) and gap (rows,), a lower bound on the extra cost of every other choice of a row.
    """
    rows, alternatives = alone.shape
    free = held.copy()
    total = 0.0
    for i in range(depth):
        c = fixed[i]
        choice[i] = c
        total += cost[c] if c >= 0 else alone[i, -1 - c]
        if c >= 0:
            free[column[c]] = False
    begin = np.zeros(rows - depth + 1, np.int64)
    edge = np.empty(start[rows] - start[depth], np.int64)
    own = np.empty(rows - depth, np.int64)
    miss = np.full(rows - depth, IMPOSSIBLE)
    n = 0
    for i in range(depth, rows):
        r = i - depth
        for k in range(start[i], start[i + 1]):
            if free[column[k]] and not (r == 0 and k in bans):
                edge[n] = k
                n += 1
        begin[r + 1] = n
        for a in range(alternatives):
            if alone[i, a] < miss[r] and not (r == 0 and -1 - a in bans):
                miss[r], own[r] = alone[i, a], a
    edge = edge[:n]
    taken, u, v = solve(begin, column[edge], cost[edge], miss, len(held))
    for i in range(depth, rows):
        r = i - depth
        gap[i] = IMPOSSIBLE
        if taken[r] < 0:
            choice[i] = -1 - own[r]
            total += miss[r]
        for e in range(begin[r], begin[r + 1]):
            k = edge[e]
            if column[k] == taken[r]:
                choice[i] = k
                total += cost[k]
            else:
                gap[i] = min(gap[i], cost[k] - u[r] - v[column[k]])
        for a in range(alternatives):
            if choice[i] != -1 - a and not (r == 0 and -1 - a in bans):
                gap[i] = min(gap[i], alone[i, a] - u[r])
        gap[i] = max(gap[i], 0.0)
    return total


@kernel
def _doubled(array: np.ndarray) -> np.ndarray:
    """A copy with room for twice as many rows."""
    wider = np.empty((2 * len(array), array.shape[1]), array.dtype)
    for i in range(array.shape[0]):
        for j in range(array.shape[1]):
            wider[i, j] = array[i, j]
    return wider
