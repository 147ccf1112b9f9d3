"""Random numbers inside compiled kernels: streams that start from a key and do not depend on threads.

SplitMix64 (Steele, Lea and Flood 2014) hashes a counter; normal numbers by the ziggurat of Marsaglia and Tsang (2000)
with 256 layers, about five nanoseconds each. Every function takes a stream's count and returns the number drawn and
the next count.
"""

from __future__ import annotations

import numpy as np
from scipy.special import erfc

from vidtrack.arrays.types import Floats
from vidtrack.compiled import kernel

STEP, MIX1, MIX2 = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
SHIFT1, SHIFT2, SHIFT3, LAYER = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(255)

LAYERS = 256
TAIL = 3.6541528853610088
"""Start of the tail in the lowest of 256 layers of equal area under exp(-x^2 / 2) (Marsaglia and Tsang 2000)."""


def _edges() -> Floats:
    """(257,) half widths of the layers from the lowest, which includes the tail, to the peak."""
    area = TAIL * np.exp(-(TAIL**2) / 2) + np.sqrt(np.pi / 2) * erfc(TAIL / np.sqrt(2))
    edge = np.zeros(LAYERS + 1)
    edge[:2] = area / np.exp(-(TAIL**2) / 2), TAIL
    for i in range(1, LAYERS - 1):
        edge[i + 1] = np.sqrt(-2 * np.log(area / edge[i] + np.exp(-(edge[i] ** 2) / 2)))
    return edge


EDGE = _edges()
HEIGHT = np.exp(-(EDGE**2) / 2)


@kernel
def bits(count: np.uint64) -> tuple[np.uint64, np.uint64]:
    """64 random bits, and the next count."""
    count += STEP
    mixed = (count ^ (count >> SHIFT1)) * MIX1
    mixed = (mixed ^ (mixed >> SHIFT2)) * MIX2
    return mixed ^ (mixed >> SHIFT3), count


@kernel
def uniform(count: np.uint64) -> tuple[float, np.uint64]:
    """Uniform in [0, 1)."""
    drawn, count = bits(count)
    return np.float64(drawn >> np.uint64(11)) * 2.0**-53, count


@kernel
def exponential(count: np.uint64) -> tuple[float, np.uint64]:
    """Exponential with mean one."""
    u, count = uniform(count)
    return -np.log1p(-u), count


@kernel
def normal(count: np.uint64) -> tuple[float, np.uint64]:
    """Standard normal."""
    while True:
        drawn, count = bits(count)
        layer = np.int64(drawn & LAYER)
        x = np.float64(np.int64(drawn) >> 11) * 2.0**-52 * EDGE[layer]  # the first 53 bits; the layer took the last 8
        if abs(x) < EDGE[layer + 1]:
            return x, count
        if layer == 0:
            return _tail(x, count)
        u, count = uniform(count)
        if HEIGHT[layer] + u * (HEIGHT[layer + 1] - HEIGHT[layer]) < np.exp(-x * x / 2):
            return x, count


@kernel
def _tail(side: float, count: np.uint64) -> tuple[float, np.uint64]:
    """Normal number beyond TAIL, with the sign of `side`."""
    while True:
        a, count = exponential(count)
        b, count = exponential(count)
        if 2 * b >= (a / TAIL) ** 2:
            return np.copysign(TAIL + a / TAIL, side), count
