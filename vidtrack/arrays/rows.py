"""Sparse entries sorted by row."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Ints
from vidtrack.compiled import kernel


@kernel
def starts(row: Ints, rows: int) -> Ints:
    """(rows + 1,) index of each row's first entry in the sorted `row` (B,); the last element is B."""
    start = np.empty(rows + 1, np.int64)
    b = 0
    for t in range(rows + 1):
        while b < len(row) and row[b] < t:
            b += 1
        start[t] = b
    return start
