"""Merged and partial blobs: several tracks that share one measurement stay several tracks.

A confirmed track that got no measurement of its own, but whose predicted box lies on a blob, lives on that
blob together with whoever else is on it. So does a track whose blob has suddenly become much larger or
smaller than the vehicle. The blob's centroid belongs to none of them; its edges do: the left edge is that of
the leftmost member, and so on. Each member is updated by the edges it can claim and otherwise follows its own
motion, so that it still knows who it is when the blob splits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.compiled import kernel
from vidtrack.errors import ConfigError
from vidtrack.scan import Floats, Ints, Mask
from vidtrack.tracking.boxes import best_cover

ONE_SIDED = 4.0
"""Standard deviations an edge is off, while the opposite one is within one, when part of a vehicle is hidden."""
UNKNOWN = 1e8
"""Variance of a coordinate that no edge tells about."""


@dataclass(frozen=True, slots=True)
class Groups:
    """How tracks share blobs.

    cover  share of a track's predicted box that a blob must cover to carry it
    edge   standard deviation of a blob's edge, as a share of the member's box side
    gate   standard deviations within which an edge is accepted as the member's; half of it where the blob
           hides somebody whose edge it may be
    growth a blob whose area is more than this many times the predicted box, or less than the inverse,
           is not the vehicle alone or not all of it
    known_s, part_s   a member seen alone for less than known_s that stays in a group for part_s was never a vehicle
           but a part of one
    overlap least intersection over union of a track with a blob that it continues on, whatever its shape
    """

    cover: float = 0.5
    edge: float = 0.1
    gate: float = 2.0
    growth: float = 2.5
    known_s: float = 0.4
    part_s: float = 1.0
    overlap: float = 0.3

    def __post_init__(self) -> None:
        if not 0 < self.cover <= 1:
            raise ConfigError(f"group cover is {self.cover}; it must lie in 0..1")

    def share(
        self, predicted: Floats, taken: Ints, confirmed: Mask, whole: Mask, blobs: Floats, pixel: float = 1.0
    ) -> tuple[Ints, Mask]:
        """(T,) the blob whose edges update each track, -1: none; (M,) blobs that may hide a vehicle without a track.

        The edges count where a track shares its blob with others, lies on a blob that it was not assigned, or where
        its blob no longer fits the vehicle. predicted (T, 4) boxes, taken (T,) measurement of each track or -1,
        confirmed (T,), whole (T,) tracks whose box is reliable and inside the picture, blobs (M, 4) boxes, whose edges
        are uncertain by a pixel.
        """
        return _share(predicted, taken, confirmed, whole, blobs, self.cover, self.growth, self.edge, pixel)

    def measure(
        self,
        predicted: Floats,
        box: Floats,
        var: Floats,
        blob: Ints,
        blobs: Floats,
        cut: Mask,
        hides: Mask,
        pixel: float = 1.0,
    ) -> tuple[Floats, Floats, Ints]:
        """Position (G, 2), variances (G, 2) and count of own edges (G,) for tracks on blobs.

        predicted (G, 4) boxes, box (G, 4) relative to the position, var (G, 2) predicted position variances,
        blob (G,) index of each track's blob, blobs (M, 4), cut (M, 4) sides of blobs that are the picture's
        border and no edge of a vehicle, hides (M,) blobs that the tracks on them do not account for.
        """
        return _from_edges(predicted, box, var, blob, blobs, cut, hides, self.gate, self.edge, pixel)


@kernel(error_model="numpy")
def _share(
    predicted: Floats, taken: Ints, confirmed: Mask, whole: Mask, blobs: Floats,
    cover: float, growth: float, edge: float, pixel: float,
) -> tuple[Ints, Mask]:  # fmt: skip
    shared = _blob_of(predicted, taken, confirmed, blobs, cover)
    explained = np.zeros(len(blobs))
    for t in range(len(shared)):
        own = shared[t] < 0 and taken[t] >= 0
        if own and confirmed[t] and whole[t] and _changed(predicted[t], blobs[taken[t]], growth, edge, pixel):
            shared[t] = taken[t]
        if shared[t] >= 0:
            explained[shared[t]] += predicted[t, 2] * predicted[t, 3]
    return shared, ~(explained >= 0.5 * blobs[:, 2] * blobs[:, 3])


@kernel
def _blob_of(predicted: Floats, taken: Ints, confirmed: Mask, blobs: Floats, cover: float) -> Ints:
    """(T,) the blob each track shares with others, or lies on without being assigned it; -1 for all others."""
    shared, claims = np.full(len(predicted), -1), np.zeros(len(blobs), np.int64)
    orphans = np.flatnonzero(confirmed & (taken < 0))
    blob, share = best_cover(predicted[orphans], blobs)
    for k in range(len(orphans)):
        if share[k] >= cover:
            shared[orphans[k]] = blob[k]
            claims[blob[k]] += 1
    hosts = np.flatnonzero(confirmed & (taken >= 0))
    for t in hosts:
        claims[taken[t]] += 1
    for t in hosts:  # a nearest neighbour may be everybody's
        if claims[taken[t]] > 1:
            shared[t] = taken[t]
    return shared


@kernel(error_model="numpy")
def _changed(box: Floats, blob: Floats, growth: float, edge: float, pixel: float) -> bool:
    """Whether a blob (4,) has another size than the vehicle's box (4,), or one edge where it was and the other not."""
    ratio = blob[2] * blob[3] / (box[2] * box[3])
    changed = ratio > growth or ratio < 1 / growth
    for axis in range(2):
        sigma = np.hypot(edge * box[2 + axis], pixel)
        near = abs(blob[axis] - box[axis]) / sigma
        far = abs(blob[axis] + blob[2 + axis] - box[axis] - box[2 + axis]) / sigma
        changed |= min(near, far) < 1 and max(near, far) > ONE_SIDED
    return changed


@kernel(error_model="numpy")
def _from_edges(
    predicted: Floats, box: Floats, var: Floats, blob: Ints, blobs: Floats, cut: Mask, hides: Mask,
    gate: float, edge: float, pixel: float,
) -> tuple[Floats, Floats, Ints]:  # fmt: skip
    """Each member's position from the four edges of its blob.

    A member stands at a known offset from the group's extreme edge (zero for the extreme member itself); the
    farther inside, the less the edge says: sigma^2 = (edge * side)^2 + offset^2.
    """
    count = len(predicted)
    z, R = np.zeros((count, 2)), np.full((count, 2), UNKNOWN)
    own = np.zeros(count, np.int64)
    for i in range(count):
        for axis in range(2):
            weight, total = 0.0, 0.0
            noise = (edge * predicted[i, 2 + axis]) ** 2 + pixel**2
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
                z[i, axis] = predicted[i, axis] - box[i, axis]
    return z, R, own
