"""Positions of the tracks on a shared blob, measured by the blob's edges."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import kernel
from vidtrack.estimate.noise import edge_variance

UNKNOWN = 1e8
"""Variance of a coordinate without an edge."""


@kernel
def from_edges(
    predicted: Floats, box: Floats, var: Floats, blob: Ints, blobs: Floats, cut: Mask, hides: Mask,
    gate: float, edge: float, pixel: float,
) -> tuple[Floats, Floats, Ints]:  # fmt: skip
    """Position (G, 2), variances (G, 2) and count of own edges (G,) of tracks on blobs, from the four edges of each.

    predicted (G, 4) boxes, box (G, 4) relative to the position, var (G, 2) predicted position variances,
    blob (G,) index of each track's blob, blobs (M, 4), cut (M, 4) sides of blobs that are the picture's
    border and no edge of a vehicle, hides (M,) blobs that the tracks on them do not account for.

    A track stands at a known offset from the extreme edge of all on its blob (zero for the extreme one itself); the
    farther inside, the less the edge says: sigma^2 = (edge * side)^2 + pixel^2 + offset^2.
    """
    count = len(predicted)
    z, R = np.empty((count, 2)), np.empty((count, 2))
    own = np.zeros(count, np.int64)
    for i in range(count):
        for axis in range(2):
            weight, total = 0.0, 0.0
            noise = edge_variance(predicted[i, 2 + axis], edge, pixel)
            for far in range(2):  # near: left or top, far: right or bottom
                if cut[blob[i], axis + 2 * far]:
                    continue
                sign = 1.0 - 2.0 * far
                mine = predicted[i, axis] + far * predicted[i, 2 + axis]
                extreme, rival = mine, np.inf
                for k in range(count):
                    if blob[k] == blob[i] and k != i:
                        other = predicted[k, axis] + far * predicted[k, 2 + axis]
                        extreme = min(sign * extreme, sign * other) * sign
                        rival = min(rival, sign * (other - mine))
                seen = blobs[blob[i], axis] + far * blobs[blob[i], 2 + axis]
                offset = mine - extreme
                if abs(seen - extreme) > (gate / 2 if hides[blob[i]] else gate) * np.sqrt(noise + var[i, axis]):
                    continue
                variance = noise + offset * offset
                total += (seen + offset - far * box[i, 2 + axis] - box[i, axis]) / variance
                weight += 1.0 / variance
                own[i] += rival > np.sqrt(noise)
            if weight > 0:
                z[i, axis], R[i, axis] = total / weight, 1.0 / weight
            else:
                z[i, axis], R[i, axis] = predicted[i, axis] - box[i, axis], UNKNOWN
    return z, R, own
