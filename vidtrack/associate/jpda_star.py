"""JPDA*: of joint events that differ only by a permutation, the likeliest counts (Blom and Bloem 2000)."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.events import Side
from vidtrack.compiled import kernel


@kernel
def likeliest_events(
    tracks: Ints, measurements: Ints, rows: Side, columns: Side, place: Ints,
    factor: Floats, share: Floats, row_share: Floats, largest: int,
) -> bool:  # fmt: skip
    """Write probabilities of a cluster's pairs to `share` and of its misses to `row_share`; False if it is too large.

    best[d, m] is the weight of the likeliest assignment of all measurements of the set m to all tracks of the set d;
    `place` (M,) holds the bit of each measurement. Recursion: the track of the highest bit of d takes one measurement
    of m. A backward pass then adds the weights of all (d, m) to the pairs that they contain.
    """
    if len(tracks) + len(measurements) > 30 or 1 << len(tracks) + len(measurements) > largest:
        return False
    for b in range(len(measurements)):
        place[measurements[b]] = b
    sets, all_tracks = 1 << len(measurements), 1 << len(tracks)
    missed, unused = _alone(rows.alone[tracks]), _alone(columns.alone[measurements])
    by_size, first = _by_size(sets)
    best = np.zeros((all_tracks, sets))
    chosen = np.full((all_tracks, sets), -1)
    best[0, 0] = 1.0
    for d in range(1, all_tracks):
        t, top, size = _highest(d, tracks)
        for e in range(rows.start[t], rows.start[t + 1]):
            mask = 1 << place[rows.other[e]]
            for m in by_size[first[size] : first[size + 1]]:
                if m & mask and best[d ^ top, m ^ mask] * factor[e] > best[d, m]:
                    best[d, m] = best[d ^ top, m ^ mask] * factor[e]
                    chosen[d, m] = e
    weight = np.zeros((all_tracks, sets))
    total = 0.0
    for d in range(all_tracks):
        _, _, size = _highest(d, tracks)
        mass = 0.0
        for m in by_size[first[size] : first[size + 1]]:
            weight[d, m] = missed[d] * unused[m]
            mass += weight[d, m] * best[d, m]
        total += mass
        for i in range(len(tracks)):
            if not d >> i & 1:
                row_share[tracks[i]] += mass
    for t in tracks:
        row_share[t] /= total
    for d in range(all_tracks - 1, 0, -1):
        _, top, size = _highest(d, tracks)
        for m in by_size[first[size] : first[size + 1]]:
            e = chosen[d, m]
            if e >= 0:
                share[e] += weight[d, m] * best[d, m] / total
                weight[d ^ top, m ^ 1 << place[rows.other[e]]] += weight[d, m] * factor[e]
    return True


@kernel
def _alone(alone: Floats) -> Floats:
    """(2^n,) product of the factors of the members outside each set."""
    product = np.ones(1 << len(alone))
    for s in range(len(product)):
        for i in range(len(alone)):
            if not s >> i & 1:
                product[s] *= alone[i]
    return product


@kernel
def _by_size(sets: int) -> tuple[Ints, Ints]:
    """All sets in order of size, and the index at which each size begins."""
    size = np.empty(sets, np.int64)
    for s in range(sets):
        size[s] = size[s >> 1] + (s & 1) if s else 0
    first = np.zeros(64, np.int64)
    for s in range(sets):
        first[size[s] + 1] += 1
    for of in range(1, len(first)):
        first[of] += first[of - 1]
    order, free = np.empty(sets, np.int64), first.copy()
    for s in range(sets):
        order[free[size[s]]] = s
        free[size[s]] += 1
    return order, first


@kernel
def _highest(d: int, tracks: Ints) -> tuple[int, int, int]:
    """The track of the highest bit of a set, that bit, and the size of the set."""
    i, size = 0, 0
    for b in range(len(tracks)):
        if d >> b & 1:
            i, size = b, size + 1
    return tracks[i], 1 << i, size
