"""Which tracks share a blob, and which blobs hide another vehicle, by predicted boxes and assignments."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import inlined, kernel
from vidtrack.estimate.noise import edge_sigma
from vidtrack.tracking.boxes import covers

ONE_SIDED = 4.0
"""Part of a vehicle is hidden if an edge is off by so many standard deviations, and the opposite one by at most one."""


@kernel
def claims(
    predicted: Floats, taken: Ints, confirmed: Mask, whole: Mask, blobs: Floats, order: Ints,
    cover: float, growth: float, edge: float, pixel: float,
) -> tuple[Ints, Mask]:  # fmt: skip
    """(T,) the blob whose edges update each track, -1: none; (M,) blobs that may hide a vehicle without a track.

    predicted (T, 4) boxes, taken (T,) measurement of each track or -1, confirmed (T,), whole (T,) tracks whose box is
    reliable and inside the picture, blobs (M, 4) boxes, whose edges are uncertain by a pixel, order (M,) of their left
    edges.
    """
    shared = _blob_of(predicted, taken, confirmed, blobs, order, cover)
    explained = np.zeros(len(blobs))
    for t in range(len(shared)):
        own = shared[t] < 0 and taken[t] >= 0
        if own and confirmed[t] and whole[t] and _changed(predicted[t], blobs[taken[t]], growth, edge, pixel):
            shared[t] = taken[t]
        if shared[t] >= 0:
            explained[shared[t]] += predicted[t, 2] * predicted[t, 3]
    hides = np.ones(len(blobs), np.bool_)
    for j in range(len(blobs)):
        hides[j] = not explained[j] >= 0.5 * blobs[j, 2] * blobs[j, 3]
    return shared, hides


@inlined
def _blob_of(predicted: Floats, taken: Ints, confirmed: Mask, blobs: Floats, order: Ints, cover: float) -> Ints:
    """(T,) the blob each track shares with others, or lies on without being assigned it; -1 for all others."""
    shared, claims = np.full(len(predicted), -1), np.zeros(len(blobs), np.int64)
    orphans, boxes, n = np.empty(len(predicted), np.int64), np.empty_like(predicted), 0
    for t in range(len(predicted)):
        if confirmed[t] and taken[t] < 0:
            orphans[n] = t
            for side in range(4):
                boxes[n, side] = predicted[t, side]
            n += 1
        elif confirmed[t]:
            claims[taken[t]] += 1
    blob, share = covers(boxes[:n], blobs, order)
    for k in range(n):
        if share[k] >= cover:
            shared[orphans[k]] = blob[k]
            claims[blob[k]] += 1
    for t in range(len(predicted)):  # with nearest neighbour several tracks may take a blob
        if confirmed[t] and taken[t] >= 0 and claims[taken[t]] > 1:
            shared[t] = taken[t]
    return shared


@inlined
def _changed(box: Floats, blob: Floats, growth: float, edge: float, pixel: float) -> bool:
    """Whether a blob (4,) has another size than the vehicle's box (4,), or one edge where it was and the other not."""
    ratio = blob[2] * blob[3] / (box[2] * box[3])
    changed = ratio > growth or ratio < 1 / growth
    for axis in range(2):
        sigma = edge_sigma(box[2 + axis], edge, pixel)
        near = abs(blob[axis] - box[axis]) / sigma
        far = abs(blob[axis] + blob[2 + axis] - box[axis] - box[2 + axis]) / sigma
        changed |= min(near, far) < 1 and max(near, far) > ONE_SIDED
    return changed
