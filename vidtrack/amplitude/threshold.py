"""The optimal detection threshold of a PDAF: the P_F that maximises the information reduction factor q2.

Noise and clutter are Rayleigh and the target Swerling I, so P_D = P_F^(1 / (1 + SNR)); n is the number of
resolution cells in the gate, and rho V = n P_F. SNR is linear.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.amplitude.reduction import KE_DIM, KE_GATE, gate_volume, q2
from vidtrack.arrays.types import Floats, Mask
from vidtrack.errors import ConfigError

LEAST_LOG_P_FA = -40.0
"""The search for the optimum ends at P_F = exp(-40)."""

KE_LEAST_SNR = 1.57
"""Up to this linear SNR (1.96 dB) the fit's q2 has no maximum below P_F = 1; exact q2 can have one."""


def closed_form(snr: ArrayLike, cells: ArrayLike, p_fa_max: float = 1.0) -> tuple[Floats, Mask]:
    """P_F* = [0.37 n (SNR - 1.57)]^(-(1 + SNR) / (SNR - 0.57)), and whether it is clamped (paper 000, eq. 25).

    snr, cells (n) broadcast. If SNR <= 1.57, or the formula gives p_fa_max or more, the fit's q2 grows with P_F up to
    p_fa_max, which is returned as clamped.
    """
    snr, cells = np.broadcast_arrays(np.asarray(snr, float), np.asarray(cells, float))
    valid = snr > KE_LEAST_SNR
    s = np.where(valid, snr, np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        exponent = np.where(valid, (1 + snr) / (s - 0.57), 0.0)
        log_p = -exponent * np.log(0.37 * cells * np.where(valid, s - KE_LEAST_SNR, 1.0))
    clamped = ~valid | (log_p >= np.log(p_fa_max))
    return np.where(clamped, p_fa_max, np.exp(np.minimum(log_p, 0.0))), clamped


def optimum(snr: float, cells: ArrayLike, p_fa_max: float = 1.0, dim: int = 2, gate: float = 4.0) -> Floats:
    """P_F in (0, p_fa_max] that maximises the exact q2 for each number of cells.

    A grid over ln P_F is searched, then refined around the best point, because a second maximum can lie at the edge.
    """
    cells = np.asarray(cells, float)
    low, high = np.full(cells.shape, LEAST_LOG_P_FA), np.full(cells.shape, np.log(p_fa_max))
    for points in (161, *[17] * 7):
        grid = np.linspace(low, high, points, axis=-1)
        value = q2(np.exp(grid / (1 + snr)), cells[..., None] * np.exp(grid), dim, gate)
        best = value.argmax(axis=-1)[..., None]
        low = np.take_along_axis(grid, np.maximum(best - 1, 0), axis=-1)[..., 0]
        high = np.take_along_axis(grid, np.minimum(best + 1, points - 1), axis=-1)[..., 0]
    return np.minimum(np.exp(np.take_along_axis(grid, best, axis=-1)[..., 0]), p_fa_max)


@dataclass(frozen=True, slots=True)
class ThresholdController:
    """Sets a tracker's detection threshold in each scan from its innovation covariances (paper 000).

    snr          linear SNR of the target
    cell_volume  V_c of a resolution cell, in the units of the measurement; with an origin, product of its
                 sides in m and rad
    gate         g [standard deviations]
    p_fa_max     largest P_F; at 1 every cell is a detection
    method       "exact": optimum of the exact q2; "closed-form": the paper's, for 2 dimensions and gate 4 only
    origin       (m,) place of a radar whose measurements are positions: cells widen with the distance; None: they are
                 alike everywhere, as in range and azimuth
    """

    snr: float
    cell_volume: float
    gate: float = 4.0
    p_fa_max: float = 1.0
    method: Literal["exact", "closed-form"] = "exact"
    origin: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        for name in ("snr", "cell_volume", "gate"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ConfigError(f"threshold controller: {name} is {value}; it must be above zero")
        if not 0 < self.p_fa_max <= 1:
            raise ConfigError(f"threshold controller: p_fa_max is {self.p_fa_max}; it must lie above 0 and up to 1")
        if self.method == "closed-form" and self.gate != KE_GATE:
            raise ConfigError(f"the closed form is fitted to a gate of 4 and not {self.gate}; use method exact")

    def volumes(self, zhat: Floats) -> Floats:
        """(T,) volumes of the resolution cells at predicted measurements (T, m)."""
        if self.origin is None:
            return np.full(len(zhat), self.cell_volume)
        away = zhat - np.array(self.origin)
        widths = [np.linalg.norm(away[:, :axes], axis=1) for axes in range(2, zhat.shape[1] + 1)]
        return np.asarray(self.cell_volume * np.prod(widths, axis=0))

    def p_fa(self, S: Floats, cell_volume: float | Floats | None = None) -> Floats:
        """P_F (T,) for innovation covariances S (T, m, m) and cells of volumes (T,); None: `cell_volume`.

        The exact optimum is interpolated in a table, computed once for each SNR, gate and dimension.
        """
        dim = S.shape[-1]
        cells = gate_volume(S, self.gate) / (self.cell_volume if cell_volume is None else cell_volume)
        if self.method == "exact":
            return np.exp(_interpolated(np.log(cells), _optimum_table(self.snr, self.p_fa_max, dim, self.gate)))
        if dim != KE_DIM:
            raise ConfigError(f"the closed form is fitted to 2 dimensions and not {dim}; use method exact")
        return closed_form(self.snr, cells, self.p_fa_max)[0]


LOG_CELLS = np.linspace(np.log(1e-2), np.log(1e8), 461)
"""ln n of the table's knots; beyond them the end values hold."""

JUMP = 0.3
"""A larger change of ln P_F between knots is a jump from one maximum of q2 to another."""


@lru_cache
def _optimum_table(snr: float, p_fa_max: float, dim: int, gate: float) -> Floats:
    """ln of the best P_F at each knot."""
    return np.log(optimum(snr, np.exp(LOG_CELLS), p_fa_max, dim, gate))


def _interpolated(log_cells: Floats, table: Floats) -> Floats:
    """Linear interpolation; across a jump the value of the nearer knot."""
    at = np.clip((log_cells - LOG_CELLS[0]) / (LOG_CELLS[1] - LOG_CELLS[0]), 0, len(LOG_CELLS) - 1)
    knot = np.minimum(at.astype(int), len(LOG_CELLS) - 2)
    step = table[knot + 1] - table[knot]
    share = np.where(np.abs(step) > JUMP, np.round(at - knot), at - knot)
    return np.asarray(table[knot] + share * step)
