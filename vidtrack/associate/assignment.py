"""Optimal sparse assignment: each row takes at most one of its columns, each column serves at most one row."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import kernel


@kernel
def assign(start: Ints, column: Ints, cost: Floats, miss: Floats, columns: int) -> Ints:
    """Column of each row, -1 for none, of least total cost.

    start (T + 1,), column (N,), cost (N,): row t may take column[k] at cost[k], start[t] <= k < start[t+1];
    miss (T,) cost of taking none.
    """
    return solve(start, column, cost, miss, columns)[0]


@kernel
def solve(start: Ints, column: Ints, cost: Floats, miss: Floats, columns: int) -> tuple[Ints, Floats, Floats]:
    """The columns of `assign`, with the dual variables u (T,) and v (columns,) that prove them optimal.

    No reduced cost, cost - u - v or miss - u, is negative; the reduced costs of the assignment are zero. v is at most
    zero, and zero for an unused column. Method: shortest augmenting paths with potentials (Jonker and Volgenant
    1987) on the sparse graph. A path stays within one cluster, so separate clusters cost nothing extra. "None" is a
    private column of each row, number `columns` + t.
    """
    rows = len(start) - 1
    u, v = np.empty(rows), np.zeros(columns + rows)
    row_of = np.full(columns + rows, -1)
    column_of = np.full(rows, -1)
    reach = np.full(columns + rows, np.inf)
    before = np.full(columns + rows, -1)
    touched = np.empty(columns + rows, np.int64)
    final = np.zeros(columns + rows, np.bool_)
    for t in range(rows):
        u[t] = miss[t]
        for k in range(start[t], start[t + 1]):
            u[t] = min(u[t], cost[k])
    for free in range(rows):
        t, length, seen, sink = free, 0.0, 0, -1
        while sink < 0:
            for k in range(start[t], start[t + 1] + 1):
                last = k == start[t + 1]
                j = columns + t if last else column[k]
                if final[j]:
                    continue
                step = length + (miss[t] if last else cost[k]) - u[t] - v[j]
                if step < reach[j]:
                    if reach[j] == np.inf:
                        touched[seen] = j
                        seen += 1
                    reach[j] = step
                    before[j] = t
            nearest, length = -1, np.inf
            for s in range(seen):
                j = touched[s]
                if not final[j] and (reach[j] < length or (reach[j] == length and row_of[j] < 0)):
                    nearest, length = j, reach[j]
            final[nearest] = True
            if row_of[nearest] < 0:
                sink = nearest
            else:
                t = row_of[nearest]
        u[free] += length
        for s in range(seen):
            j = touched[s]
            if final[j] and j != sink:
                u[row_of[j]] += length - reach[j]
                v[j] -= length - reach[j]
        j = sink
        while True:
            t = before[j]
            row_of[j] = t
            j, column_of[t] = column_of[t], j
            if t == free:
                break
        for s in range(seen):
            reach[touched[s]] = np.inf
            final[touched[s]] = False
    for t in range(rows):
        if column_of[t] >= columns:
            column_of[t] = -1
    return column_of, u, v[:columns]
