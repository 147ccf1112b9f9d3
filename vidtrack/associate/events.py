"""Joint events of tracks and measurements, summed without listing them.

A joint event gives each track one of its measurements or none, and no measurement to two tracks. Its weight is the
product of a factor for each pair in it, for each track without a measurement and for each measurement without a
track. One side's members, tracks or measurements, are taken one after another; of the other side only those that
are already met and still contested are remembered, as bits of a number (a frontier). The work is the number of
steps times 2 to the most bits in use: small for long chains, and for short ends of lopsided clusters.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import kernel

WIDEST = 30
"""Most bits of a frontier."""


class Side(NamedTuple):
    """One side of a bipartite graph, and what it meets on the other: tracks and measurements, or the reverse.

    start (n + 1,)  member i has the edges start[i]..start[i + 1]
    other (N,)      who is at the other end of each edge
    pair (N,)       number of each edge's pair
    alone (n,)      factor of each member without a partner
    """

    start: Ints
    other: Ints
    pair: Ints
    alone: Floats


class Frontier(NamedTuple):
    """What is remembered of the members of the side that is not taken in turn, all (n,).

    left  edges still to come; bit: the bit that says whether the member is taken, last: the step after which that no
    longer matters; both -1 before the member is met
    """

    left: Ints
    bit: Ints
    last: Ints


@kernel
def frontier(start: Ints) -> Frontier:
    """The frontier before the first step, for members with the edges start[i]..start[i + 1]."""
    return Frontier(np.diff(start), np.full(len(start) - 1, -1), np.full(len(start) - 1, -1))


@kernel
def reverse(start: Ints, other: Ints, count: int) -> tuple[Ints, Ints, Ints]:
    """start, other and pair of the `count` members of the other side."""
    first = np.zeros(count + 1, np.int64)
    for k in range(len(other)):
        first[other[k] + 1] += 1
    first = np.cumsum(first)
    fill = first.copy()
    back, pair = np.empty_like(other), np.empty_like(other)
    for i in range(len(start) - 1):
        for k in range(start[i], start[i + 1]):
            at = fill[other[k]]
            back[at], pair[at] = i, k
            fill[other[k]] += 1
    return first, back, pair


@kernel
def plan(members: Ints, side: Side, other: Frontier, largest: int) -> tuple[Ints, int]:
    """An order of the members that keeps few of the other side contested at a time, and the bits that takes.

    The next member is the one that leaves the fewest more contested, or the first that leaves no more. The other
    side is met on the way. The number of bits is -1 if steps times states would exceed `largest`.
    """
    left, bit, last = other
    order, free, width = members.copy(), (1 << WIDEST) - 1, 0
    for step in range(len(order)):
        best, fewest = step, np.iinfo(np.int64).max
        for s in range(step, len(order)):
            opened = 0
            for e in range(side.start[order[s]], side.start[order[s] + 1]):
                o = side.other[e]
                opened += (bit[o] < 0) - (left[o] == 1)
            if opened < fewest:
                best, fewest = s, opened
                if opened <= 0:
                    break
        order[step], order[best] = order[best], order[step]
        for e in range(side.start[order[step]], side.start[order[step] + 1]):
            o = side.other[e]
            if bit[o] < 0:
                bit[o] = 0
                while bit[o] < WIDEST and not free >> bit[o] & 1:
                    bit[o] += 1
                width = max(width, bit[o] + 1)
                if width > WIDEST or len(order) << width > largest:
                    return order, -1
                free &= ~(1 << bit[o])
            left[o] -= 1
        for e in range(side.start[order[step]], side.start[order[step] + 1]):
            o = side.other[e]
            if left[o] == 0:
                last[o] = step
                free |= 1 << bit[o]
    return order, width


@kernel
def exact(
    order: Ints, width: int, side: Side, other: Frontier, other_alone: Floats,
    factor: Floats, share: Floats, side_share: Floats, other_share: Floats,
) -> None:  # fmt: skip
    """Probabilities of the pairs, into `share`, and of being alone, into those of the two sides.

    order, width and other are those of the plan. forward[k, s] sums the events of the first k members that leave the
    set s taken; going back, `beyond` sums what the rest can add to each set. All terms are positive: nothing cancels.
    """
    _, bit, last = other
    steps, size = len(order), 1 << width
    forward = np.zeros((steps + 1, size))
    forward[0, 0] = 1.0
    for k in range(steps):
        i, now, then = order[k], forward[k], forward[k + 1]
        for taken in range(size):
            if now[taken] == 0.0:
                continue
            then[taken] += now[taken] * side.alone[i]
            for e in range(side.start[i], side.start[i + 1]):
                mask = 1 << bit[side.other[e]]
                if not taken & mask:
                    then[taken | mask] += now[taken] * factor[side.pair[e]]
        for e in range(side.start[i], side.start[i + 1]):
            o = side.other[e]
            if last[o] == k:  # settled: whether it was taken need not be remembered
                mask = 1 << bit[o]
                for taken in range(size):
                    if taken & mask:
                        then[taken ^ mask] = then[taken ^ mask] * other_alone[o] + then[taken]
                        then[taken] = 0.0
    total = forward[steps, 0]
    beyond, before, mass = np.zeros(size), np.empty(size), np.empty(size)
    beyond[0] = 1.0 / total
    for k in range(steps - 1, -1, -1):
        i, now = order[k], forward[k]
        for e in range(side.start[i], side.start[i + 1]):
            o = side.other[e]
            if last[o] == k:
                mask = 1 << bit[o]
                for taken in range(size):
                    if taken & mask:
                        beyond[taken] = beyond[taken ^ mask]
                        beyond[taken ^ mask] *= other_alone[o]
        before[:] = 0.0
        mass[:] = 0.0
        for taken in range(size):
            if now[taken] == 0.0:
                continue
            ahead = side.alone[i] * beyond[taken]
            before[taken] += ahead
            mass[taken] += now[taken] * ahead
            side_share[i] += now[taken] * ahead
            for e in range(side.start[i], side.start[i + 1]):
                mask = 1 << bit[side.other[e]]
                if not taken & mask:
                    ahead = factor[side.pair[e]] * beyond[taken | mask]
                    before[taken] += ahead
                    mass[taken | mask] += now[taken] * ahead
                    share[side.pair[e]] += now[taken] * ahead
        for e in range(side.start[i], side.start[i + 1]):
            o = side.other[e]
            if last[o] == k:
                mask = 1 << bit[o]
                for taken in range(size):
                    if not taken & mask:
                        other_share[o] += mass[taken]
        beyond, before = before, beyond
