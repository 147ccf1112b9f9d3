"""Constant false alarm rate (CFAR): thresholds from the cells around the cell under test.

Powers are the output of a square-law detector in exponential noise of unknown mean. Reference cells are the nearest
cells on both sides beyond the guard cells; at the ends of an array the missing cells come from the other side, so P_FA
is the same everywhere.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import gammaln

from vidtrack.arrays.median import ranked
from vidtrack.arrays.types import Floats
from vidtrack.compiled import kernel
from vidtrack.errors import ConfigError


def ca_factor(p_fa: ArrayLike, cells: ArrayLike) -> Floats:
    """alpha = N (P_FA^(-1/N) - 1): threshold over the mean of N reference cells (paper 001)."""
    cells = np.asarray(cells, float)
    return np.asarray(cells * np.expm1(-np.log(p_fa) / cells))


def ca_detection_probability(p_fa: ArrayLike, snr: ArrayLike, cells: ArrayLike) -> Floats:
    """P_D = (1 + alpha / (N (1 + SNR)))^-N of a Swerling I target; snr linear."""
    cells = np.asarray(cells, float)
    return np.asarray((1 + ca_factor(p_fa, cells) / (cells * (1 + np.asarray(snr)))) ** -cells)


def os_factor(p_fa: float, cells: int, rank: int) -> float:
    """T of P_FA = product over i < rank of (N - i) / (N - i + T): threshold over the rank-th smallest of N cells.

    Rohling, Radar CFAR thresholding in clutter and multiple target situations, 1983.
    """
    if not 1 <= rank <= cells:
        raise ConfigError(f"OS-CFAR: rank is {rank}; it must lie in 1..{cells}, the number of reference cells")
    wanted, high = np.log(p_fa), 1.0
    while _log_exceeds(high, cells, rank) > wanted:
        high *= 2
    return float(brentq(lambda factor: _log_exceeds(factor, cells, rank) - wanted, 0.0, high, xtol=1e-12, rtol=1e-14))


def os_detection_probability(p_fa: float, snr: ArrayLike, cells: int, rank: int) -> Floats:
    """P_D of a Swerling I target: P_FA of the factor T / (1 + SNR); snr linear."""
    return np.asarray(np.exp(_log_exceeds(os_factor(p_fa, cells, rank) / (1 + np.asarray(snr)), cells, rank)))


def ca_threshold(power: Floats, p_fa: float, cells: int = 16, guard: int = 2) -> Floats:
    """Thresholds (..., n) for powers (..., n) along the last axis: alpha times the mean of the reference cells.

    Raises ConfigError if the last axis is too short, or `cells` is not even.
    """
    return float(ca_factor(p_fa, cells)) * _levels(power, cells, guard, 0)


def os_threshold(power: Floats, p_fa: float, cells: int = 16, rank: int = 12, guard: int = 2) -> Floats:
    """As `ca_threshold`, from the rank-th smallest reference cell, which other targets do not raise."""
    return os_factor(p_fa, cells, rank) * _levels(power, cells, guard, rank)


def _log_exceeds(factor: float | Floats, cells: int, rank: int) -> Floats:
    """ln P(cell > factor times the rank-th smallest reference cell), for equal means."""
    full = gammaln(cells + 1) - gammaln(cells - rank + 1)
    return np.asarray(full + gammaln(cells - rank + 1 + factor) - gammaln(cells + 1 + factor))


def _levels(power: Floats, cells: int, guard: int, rank: int) -> Floats:
    power = np.asarray(power, float)
    if cells < 2 or cells % 2 or guard < 0:
        raise ConfigError(
            f"CFAR: {cells} reference and {guard} guard cells; take an even number above 0, and 0 or more"
        )
    if power.shape[-1] < cells + 2 * guard + 1:
        raise ConfigError(
            f"CFAR: {power.shape[-1]} cells are too few for {cells} reference and 2 x {guard} guard cells; take fewer"
        )
    rows = np.ascontiguousarray(power.reshape(-1, power.shape[-1]))
    return _reference_levels(rows, cells, guard, rank).reshape(power.shape)


@kernel
def _reference_levels(power: Floats, cells: int, guard: int, rank: int) -> Floats:
    """Mean (rank 0) or rank-th smallest of the reference cells of each cell; power (L, n)."""
    levels = np.empty_like(power)
    around = np.empty(cells)
    n = power.shape[1]
    for row in range(len(power)):
        for i in range(n):
            left = min(cells, max(0, i - guard))
            right = min(cells, max(0, n - 1 - i - guard))
            left = max(min(left, cells // 2), cells - right)
            right = cells - left
            for k in range(left):
                around[k] = power[row, i - guard - left + k]
            for k in range(right):
                around[left + k] = power[row, i + guard + 1 + k]
            levels[row, i] = ranked(around, rank - 1) if rank else around.mean()
    return levels
