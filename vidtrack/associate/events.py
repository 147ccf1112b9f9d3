"""Joint events of tracks and measurements, summed without enumeration.

A joint event gives each track one of its measurements or none, and no measurement to two tracks. Its weight is the
product of one factor for each pair, for each unassigned track and for each unassigned measurement. The sum is dynamic
programming over the members of one side (tracks or measurements). Its state is a bit mask, the frontier: of the other
side's members with edges both to processed and to remaining members, which are taken. The work is the number of steps
times 2^bits. It is small for long chains, and for clusters with few members on one side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import kernel

WIDEST = 30
"""Largest number of bits of a frontier."""


class Side(NamedTuple):
    """One side of a bipartite graph and its edges to the other side: tracks and measurements, or the reverse.

    start (n + 1,)  member i has the edges start[i]..start[i + 1]
    other (N,)      member at the other end of each edge
    pair (N,)       index of each edge's pair
    alone (n,)      factor of each member if it is unassigned
    """

    start: Ints
    other: Ints
    pair: Ints
    alone: Floats


class Frontier(NamedTuple):
    """Frontier bits of the members of the side that is not processed in order, all (n,).

    left  remaining edges
    bit   bit that stores whether the member is taken; -1 before its first edge
    last  step of its last edge; -1 before its first edge
    """

    left: Ints
    bit: Ints
    last: Ints


@kernel
def frontier(start: Ints) -> Frontier:
    """The frontier before the first step, for members with the edges start[i]..start[i + 1]."""
    left = np.empty(len(start) - 1, np.int64)
    for i in range(len(left)):
        left[i] = start[i + 1] - start[i]
    return Frontier(left, np.full(len(left), -1), np.full(len(left), -1))


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
    """An order of the members that keeps the frontier small, and the number of bits that it needs.

    The next member is the one that adds the fewest bits, or the first that adds none. `other` is filled in. The number
    of bits is -1 if steps times states would exceed `largest`.
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
    """Write probabilities of the pairs to `share`, and of being unassigned to `side_share` and `other_share`.

    order, width and other come from `plan`. forward[k, s] sums the events of the first k members in which the set s is
    taken. In the backward pass `beyond` sums the events of the remaining members for each set. All terms are positive,
    so nothing cancels.
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
            if last[o] == k:  # its last edge: the bit is free again
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
