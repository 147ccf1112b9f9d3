"""Which measurements may start tracks of their own."""

from __future__ import annotations

import numpy as np

from vidtrack.scan import Scan

Mask = np.ndarray


def distinct(scan: Scan, free: Mask) -> Mask:
    """(M,) the free measurements (M,) of which no earlier one lies in the same cell, a least standard deviation wide.

    Measurements that cannot be told apart start one track: a heap of them at one place is one target until shown
    otherwise, and not thousands of tracks that all gate the next heap.
    """
    candidates = np.flatnonzero(free)
    first = np.zeros(len(scan), bool)
    if len(candidates) < 2:
        first[candidates] = True
        return first
    sigma = np.sqrt(np.diagonal(scan.R[candidates], axis1=1, axis2=2).min(axis=0))
    cell = np.floor(scan.z[candidates] / sigma).T
    keys = tuple(cell) if scan.run is None else (*cell, scan.run[candidates])
    order = np.lexsort(keys)
    new = np.ones(len(order), bool)
    new[1:] = np.any([key[order][1:] != key[order][:-1] for key in keys], axis=0)
    first[candidates[order[new]]] = True
    return first
