"""Clusters: connected components of the graph of gated pairs. They can be solved separately."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Ints
from vidtrack.compiled import kernel


@kernel
def clusters(row: Ints, measurement: Ints, rows: int, measurements: int) -> Ints:
    """(rows,) smallest row of each row's connected component; union-find with path halving."""
    root = np.arange(rows)
    owner = np.full(measurements, -1)
    for k in range(len(row)):
        other = owner[measurement[k]]
        if other < 0:
            owner[measurement[k]] = row[k]
            continue
        a, b = find(root, row[k]), find(root, other)
        if a < b:
            root[b] = a
        elif b < a:
            root[a] = b
    for t in range(rows):
        root[t] = find(root, t)
    return root


@kernel
def find(root: Ints, t: int) -> int:
    """Root of t."""
    while root[t] != t:
        root[t] = root[root[t]]
        t = root[t]
    return t
