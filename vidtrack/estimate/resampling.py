"""Resampling schemes of particle filters.

All four schemes choose particle i w_i N times on average. They differ in the variance of that number (Douc, Cappe and
Moulines 2005): smallest in `systematic`, largest in `multinomial`.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import kernel
from vidtrack.estimate.stream import exponential, uniform


class Resampling(IntEnum):
    """The schemes; with NONE particles are only weighted (sequential importance sampling)."""

    NONE = 0
    MULTINOMIAL = 1
    RESIDUAL = 2
    STRATIFIED = 3
    SYSTEMATIC = 4


MULTINOMIAL, RESIDUAL, STRATIFIED = (
    int(kind) for kind in (Resampling.MULTINOMIAL, Resampling.RESIDUAL, Resampling.STRATIFIED)
)


@kernel
def choose(kind: int, weight: Floats, chosen: Ints, count: np.uint64) -> np.uint64:
    """Fill chosen (N,) with indices of particles of weight (N,) by a scheme; returns the stream's next count."""
    number = len(chosen)
    u = np.empty(number)
    if kind == MULTINOMIAL:
        count = _sorted_uniforms(u, count)
        _walk(weight, u, chosen)
    elif kind == RESIDUAL:
        count = _residual(weight, u, chosen, count)
    else:
        for k in range(number):
            if kind == STRATIFIED or k == 0:
                u[k], count = uniform(count)
            else:
                u[k] = u[0]
        _one_in_each(weight, u, chosen)
    return count


@kernel
def _one_in_each(weight: Floats, u: Floats, chosen: Ints) -> None:
    """The particle at (k + u_k) / N for each k, on [0, 1) divided into intervals as long as the weights.

    Point k belongs to particle i if the intervals of i particles end before it: ends are counted, then accumulated.
    Without branches this is three times as fast as `_walk`.
    """
    number = len(chosen)
    stretch = number / weight.sum()
    ends, reached = np.zeros(number + 1, np.int64), 0.0
    for i in range(number - 1):
        reached += weight[i] * stretch
        k = min(int(reached), number - 1)
        ends[k + (u[k] < reached - k)] += 1
    before = 0
    for k in range(number):
        before += ends[k]
        chosen[k] = before


@kernel
def _walk(weight: Floats, point: Floats, chosen: Ints) -> None:
    """The particle at each of any ascending points of [0, 1)."""
    i, reached, total = 0, weight[0], weight.sum()
    for k in range(len(point)):
        while reached <= point[k] * total and i < len(weight) - 1:
            i += 1
            reached += weight[i]
        chosen[k] = i


@kernel
def _sorted_uniforms(point: Floats, count: np.uint64) -> np.uint64:
    """Fill point with ascending uniform numbers: partial sums of exponential numbers over their total."""
    total = 0.0
    for i in range(len(point)):
        gap, count = exponential(count)
        total += gap
        point[i] = total
    gap, count = exponential(count)
    total += gap
    for i in range(len(point)):
        point[i] /= total
    return count


@kernel
def _residual(weight: Floats, u: Floats, chosen: Ints, count: np.uint64) -> np.uint64:
    """floor(w N) copies of each particle, and the rest multinomially from the remaining weights."""
    left = weight * (len(chosen) / weight.sum())
    filled = 0
    for i in range(len(weight)):
        whole = int(left[i])
        left[i] -= whole
        chosen[filled : filled + whole] = i
        filled += whole
    if filled < len(chosen):
        count = _sorted_uniforms(u[filled:], count)
        _walk(left, u[filled:], chosen[filled:])
    return count
