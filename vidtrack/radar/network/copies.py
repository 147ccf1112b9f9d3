"""Whether two feeds are of one radar: its plots come twice, perhaps rounded to other digits or stamped later."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from vidtrack.arrays.types import Floats

NEAR = 0.1
"""Standard deviations; range and azimuth of a copy differ by less. Those of two radars at one place do in one of 300
plots: their difference has sqrt(2) standard deviations, and is so small with probability 0.06 in each."""
LATEST_S = 30.0
"""s; longest delay of a copy that is looked for."""
MOSTLY = 0.5
"""Share of the plots of the smaller of two feeds; with more of them in the other feed the two are of one radar."""


class Measured(NamedTuple):
    """The plots of a feed as the radar measured them.

    time_s, range_m, azimuth   (N,) s, m, rad; azimuths are not turned to north
    sigma   (2,) usual standard deviations of range [m] and azimuth [rad]
    scan_s  time of a scan
    """

    time_s: Floats
    range_m: Floats
    azimuth: Floats
    sigma: Floats
    scan_s: float


class Copies(NamedTuple):
    """Plots that two feeds share: `same` of the `fewer` plots of the smaller one, in the second `later_s` later."""

    same: int
    fewer: int
    later_s: float

    @property
    def of_one_radar(self) -> bool:
        """Whether they are most of them."""
        return self.same > MOSTLY * self.fewer


def copies(first: Measured, second: Measured) -> Copies:
    """The plots of two feeds that are the same but for NEAR of their errors, at one delay of all.

    Each plot of the smaller feed has the nearest of the other as its partner. The delay is the median of the partners';
    those that are off by half a scan are chance, as of an object that stands still.
    """
    sigma = np.minimum(first.sigma, second.sigma)
    few, many = sorted((_scaled(first, sigma), _scaled(second, sigma)), key=len)
    distance, partner = KDTree(many).query(few, p=np.inf, distance_upper_bound=1.0)
    found = np.isfinite(distance)
    if not found.any():
        return Copies(0, len(few), 0.0)
    later_s = LATEST_S * (many[partner[found], 0] - few[found, 0])
    delay_s = float(np.median(later_s))
    same = np.abs(later_s - delay_s) <= min(first.scan_s, second.scan_s) / 2
    return Copies(int(same.sum()), len(few), delay_s if len(first.time_s) <= len(second.time_s) else -delay_s)


def _scaled(feed: Measured, sigma: Floats) -> Floats:
    """(N, 4) time, range and direction of each different plot, so that those of copies differ by less than one."""
    direction = np.column_stack([np.cos(feed.azimuth), np.sin(feed.azimuth)]) / sigma[1]
    plots = np.column_stack([feed.time_s / LATEST_S, np.column_stack([feed.range_m / sigma[0], direction]) / NEAR])
    return np.unique(plots, axis=0)
