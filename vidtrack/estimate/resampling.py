"""Resampling: which particles go on, and how often each.

All four schemes choose particle i w_i N times on average and differ in how far the number strays from that (Douc,
Cappe and Moulines 2005): least in `systematic`, most in `multinomial`.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numba import njit

from vidtrack.compiled import CACHE
from vidtrack.estimate.stream import exponential, uniform
from vidtrack.scan import Floats, Ints


class Resampling(IntEnum):
    """The schemes; with NONE particles are never chosen anew, only weighted (sequential importance sampling)."""

    NONE = 0
    MULTINOMIAL = 1
    RESIDUAL = 2
    STRATIFIED = 3
    SYSTEMATIC = 4


MULTINOMIAL, RESIDUAL, STRATIFIED = (
    int(kind) for kind in (Resampling.MULTINOMIAL, Resampling.RESIDUAL, Resampling.STRATIFIED)
)


@njit(cache=CACHE, nogil=True)
def choose(kind: int, weight: Floats, chosen: Ints, count: np.uint64) -> np.uint64:
    """Fill chosen (N,) with indices of particles of weight (N,) by one of the four schemes; the stream's next count."""
    number = len(chosen)
    point = np.empty(number)
    if kind == MULTINOMIAL:
        count = _sorted_uniforms(point, count)
        _walk(weight, point, chosen)
    elif kind == RESIDUAL:
        count = _residual(weight, point, chosen, count)
    else:
        u, count = uniform(count)
        for i in range(number):
            if kind == STRATIFIED and i > 0:
                u, count = uniform(count)
            point[i] = (i + u) / number
        _walk(weight, point, chosen)
    return count


@njit(cache=CACHE, nogil=True)
def _walk(weight: Floats, point: Floats, chosen: Ints) -> None:
    """The particle at each ascending point of [0, 1) when all lie one after the other, as long as their weights."""
    total = 0.0
    for w in weight:
        total += w
    i, reached = 0, weight[0]
    for k in range(len(point)):
        while reached <= point[k] * total and i < len(weight) - 1:
            i += 1
            reached += weight[i]
        chosen[k] = i


@njit(cache=CACHE, nogil=True)
def _sorted_uniforms(point: Floats, count: np.uint64) -> np.uint64:
    """Fill point with ascending uniform numbers: partial sums of exponential ones over their total."""
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


@njit(cache=CACHE, nogil=True)
def _residual(weight: Floats, point: Floats, chosen: Ints, count: np.uint64) -> np.uint64:
    """floor(w N) of each particle, and the rest multinomially from what that leaves."""
    left = weight * (len(chosen) / weight.sum())
    filled = 0
    for i in range(len(weight)):
        whole = int(left[i])
        left[i] -= whole
        chosen[filled : filled + whole] = i
        filled += whole
    if filled < len(chosen):
        count = _sorted_uniforms(point[filled:], count)
        _walk(left, point[filled:], chosen[filled:])
    return count
