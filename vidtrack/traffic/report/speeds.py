"""Speeds at the gates: the 85th percentile with its error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import bdtr, ndtri

from vidtrack.arrays.types import Floats
from vidtrack.traffic.measures.intervals import V85_LEAST
from vidtrack.traffic.report.findings import Findings

SHARE = 0.85
_SIGMAS, _TAIL = 1.96, 0.025
"""of bounds of 95 %"""


@dataclass(frozen=True, slots=True, eq=False)
class Speeds:
    """Speeds at a gate in a direction, km/h.

    speed      (N,) of the vehicles
    v85, low, high   85th percentile and its bounds, 95 %; NaN for fewer than V85_LEAST vehicles
    own, shared      root mean square of the vehicles' own errors; error of all of them together, by the calibration
    """

    gate: str
    direction: str
    speed: Floats
    v85: float
    low: float
    high: float
    own: float
    shared: float


def speeds_of(found: Findings) -> list[Speeds]:
    """Of every gate and direction with speeds, those with most vehicles first."""
    speed = found.numbers("crossings", "speed_kmh")
    own, shared = (found.numbers("crossings", name) for name in ("speed_sigma_kmh", "speed_shared_sigma_kmh"))
    names = zip(found.words("crossings", "gate"), found.words("crossings", "direction"), strict=True)
    ways: dict[tuple[str, str], list[int]] = {}
    for k, (gate, direction) in enumerate(names):
        if np.isfinite(speed[k]):
            ways.setdefault((str(gate), str(direction)), []).append(k)
    result = []
    for (gate, direction), rows in ways.items():
        of_all = float(np.nan_to_num(shared[rows]).mean())
        rough = float(np.sqrt(np.mean(np.nan_to_num(own[rows]) ** 2)))
        bounds = v85_of(speed[rows], rough, of_all)
        result.append(Speeds(gate, direction, speed[rows], *bounds, rough, of_all))
    return sorted(result, key=lambda one: -len(one.speed))


def v85_of(speed: Floats, own: float, shared: float) -> tuple[float, float, float]:
    """The 85th percentile of speeds (N,), and its bounds, 95 %; NaN for fewer than V85_LEAST.

    own     standard deviation of each speed's own error
    shared  standard deviation of the error of all together

    Two of the ordered speeds bound the percentile of all vehicles, by the binomial distribution (David and Nagaraja
    2003, 7.1); the shared error adds to both distances in quadrature. Own errors widen the
    distribution of the speeds: the lower bound is lowered by what they add to the percentile of a normal one.
    """
    ordered, n = np.sort(speed), len(speed)
    if n < V85_LEAST:
        return np.nan, np.nan, np.nan
    v85 = float(np.quantile(ordered, SHARE))
    below = bdtr(np.arange(n, dtype=float), n, SHARE)  # that at most k speeds are below the percentile
    low = ordered[max(int(np.searchsorted(below, _TAIL, side="right")) - 1, 0)]
    high = ordered[int(np.searchsorted(below, 1 - _TAIL))]
    sampled = np.array([v85 - low, high - v85])
    down, up = np.hypot(sampled, _SIGMAS * shared)
    spread = float(np.std(speed))
    added = ndtri(SHARE) * (spread - np.sqrt(max(spread**2 - own**2, 0.0)))
    return v85, float(v85 - down - added), float(v85 + up)
