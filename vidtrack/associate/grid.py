"""A grid over points, which finds candidates for gating without testing every pair."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import inlined


@inlined
def cells(z: Floats, run: Ints, reach: Floats) -> tuple[Ints, Ints, Floats, Floats, Ints]:
    """Sort points z (M, m) into grid cells over their first two axes, by run (M,), row and column of the cell.

    Returns order (M,), first, origin (2,), cell (2,), shape (2,): cell c, of sides `cell`, holds
    order[first[c]..first[c + 1]]. A cell is as large as the mean of reach (T, 2), the half sides of the gates, and
    larger where there would be more than about four cells for each point.
    """
    axes = min(2, z.shape[1])
    origin, extent = np.zeros(2), np.zeros(2)
    for a in range(axes if len(z) else 0):
        origin[a], last = z[0, a], z[0, a]
        for j in range(len(z)):
            origin[a], last = min(origin[a], z[j, a]), max(last, z[j, a])
        extent[a] = last - origin[a]
    runs = 1
    for j in range(len(run)):
        runs = max(runs, 1 + run[j])
    most = np.ceil(2 * np.sqrt(max(1, len(z)) / runs))
    cell, shape = _typical(reach), np.empty(2, np.int64)
    for a in range(2):
        cell[a] = max(cell[a], extent[a] / most, 1e-9)
        shape[a] = int(extent[a] / cell[a]) + 1

    key, order = np.zeros(len(z), np.int64), np.empty(len(z), np.int64)
    first = np.zeros(runs * shape[0] * shape[1] + 1, np.int64)
    for j in range(len(z)):
        key[j] = run[j]
        for a in range(1, -1, -1):
            at = np.int64((z[j, a] - origin[a]) / cell[a]) if a < axes else 0
            key[j] = key[j] * shape[a] + min(at, shape[a] - 1)
        first[key[j] + 1] += 1
    for c in range(1, len(first)):
        first[c] += first[c - 1]
    place = first.copy()
    for j in range(len(z)):
        order[place[key[j]]] = j
        place[key[j]] += 1
    return order, first, origin, cell, shape


@inlined
def _typical(reach: Floats) -> Floats:
    """(2,) mean of the finite half sides (T, 2); ones if there are none."""
    total, count = np.zeros(2), 0
    for t in range(len(reach)):
        if np.isfinite(reach[t, 0]) and np.isfinite(reach[t, 1]):
            total[0] += reach[t, 0]
            total[1] += reach[t, 1]
            count += 1
    for a in range(2):
        total[a] = total[a] / count if count else 1.0
    return total
