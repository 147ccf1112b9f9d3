"""Which counted crossing is which noted one."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching

from vidtrack.arrays.types import Floats, Ints, Mask

_WRITTEN_S = 1e-6
"""Times are written to a microsecond: a difference that is the tolerance itself is within it."""


def match(counted: Floats, noted: Floats, certain: Mask, tolerance_s: float) -> Ints:
    """(M,) the counted crossing of each noted one; -1 for those that were missed.

    counted  (N,) s, in order
    noted    (M,) s
    certain  (M,)

    One to one, within the tolerance; as many certain ones as possible, then as many of all as possible, then with the
    smallest sum of differences in time.
    """
    M, N = len(noted), len(counted)
    reach = tolerance_s + _WRITTEN_S
    found = np.full(M, -1)
    first = np.searchsorted(counted, noted - reach)
    sizes = np.searchsorted(counted, noted + reach, side="right") - first
    row = np.repeat(np.arange(M), sizes)
    if not len(row):
        return found
    column = np.arange(len(row)) - np.repeat(np.cumsum(sizes) - sizes, sizes) + first[row]
    late = np.abs(counted[column] - noted[row]) / (reach * (M + 1))  # at most 1 / (M + 1): all together below 1
    alone = np.where(certain, 2.0 * M + 5, 3.0)  # one certain one outweighs what all uncertain ones can win
    cost = coo_array(
        (
            np.concatenate([1 + late, alone]),
            (np.concatenate([row, np.arange(M)]), np.concatenate([column, N + np.arange(M)])),
        ),
        shape=(M, N + M),
    )
    rows, columns = min_weight_full_bipartite_matching(cost.tocsr())
    found[rows] = np.where(columns < N, columns, -1)
    return found
