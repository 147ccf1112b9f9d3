"""Which measurements may start tracks of their own."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.scan import Scan
from vidtrack.tracking.boxes import area, best_cover, widened

FRAGMENT, NEAR, SMALL = 0.6, 0.5, 0.3
"""A leftover blob smaller than SMALL of a tracked vehicle, of which the vehicle covers FRAGMENT, is a piece of it and
starts no track. One that only the vehicle widened by NEAR of its longer side covers so is beside it: it may be a piece
or the vehicle's shadow, but also a smaller vehicle, which then must travel apart from it."""


def distinct(scan: Scan, free: Mask) -> Mask:
    """(M,) one of the free measurements (M,) in each cell; a cell is the smallest standard deviation wide.

    Measurements that cannot be told apart start one track: a heap of them would otherwise start thousands of tracks
    that all gate the next heap.
    """
    candidates = free.nonzero()[0]
    if len(candidates) < 2:
        return free
    variance = scan.R.take(candidates, axis=0).diagonal(axis1=1, axis2=2)
    cell = np.floor(scan.z.take(candidates, axis=0) / np.sqrt(np.minimum.reduce(variance, axis=0)))
    if scan.run is not None:
        cell = np.column_stack([cell, scan.run[candidates]])
    order = np.lexsort(cell.T)
    cell = cell.take(order, axis=0)
    again = np.logical_and.reduce(cell[1:] == cell[:-1], axis=1)
    first = free.copy()
    first[candidates[order[1:][again]]] = False
    return first


def pieces(blobs: Floats, vehicles: Floats, near: float = 0.0) -> Ints:
    """(M,) which of the tracked vehicles (V, 4) each of the blobs (M, 4) may be a piece of; -1: of none.

    near  a margin of the vehicles, as a share of their longer sides
    """
    vehicle, share = best_cover(blobs, widened(vehicles, near))
    piece = (vehicle >= 0) & (share >= FRAGMENT)
    piece[piece] = area(blobs[piece]) < SMALL * area(vehicles[vehicle[piece]])
    return np.where(piece, vehicle, -1)
