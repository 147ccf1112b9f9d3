"""Whether two feeds are of one radar: its plots come twice, perhaps rounded to other digits or stamped later."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from vidtrack.arrays.types import Floats
from vidtrack.radar.plots import LATEST_COPY_S, MOSTLY

NEAR = 0.1
"""Standard deviations; range and azimuth of a copy differ by less. Those of two radars at one place do in one of 300
plots: their difference has sqrt(2) standard deviations, and is so small with probability 0.06 in each."""
UNLIKELY = 4.0
"""Standard deviations of the number of plots that two radars share by chance, beyond which they are one."""


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
    """Plots that two feeds share: `same` of the `fewer` plots of the smaller one, in the second `later_s` later.

    chance  (fewer,) probability of each that two radars would share it, as one of an object that stands still
    """

    same: int
    fewer: int
    later_s: float
    chance: Floats

    @property
    def of_one_radar(self) -> bool:
        """Whether they are most of those that chance would not share, and so many that chance could not make them."""
        beyond = self.same - self.chance.sum()
        likely = np.sqrt((self.chance * (1 - self.chance)).sum())
        return bool(beyond > max(MOSTLY * (1 - self.chance).sum(), UNLIKELY * likely))


def copies(first: Measured, second: Measured) -> Copies:
    """The plots of two feeds that are the same but for NEAR of their errors, at one delay of all.

    Each plot of the smaller feed has the nearest of the other as its partner. The delay is the median of the partners';
    those that are off by half a scan are chance.
    """
    sigma = np.minimum(first.sigma, second.sigma)
    (few, _), (many, scan_s) = sorted(
        ((_scaled(feed, sigma), feed.scan_s) for feed in (first, second)), key=lambda one: len(one[0])
    )
    distance, partner = KDTree(many).query(few, p=np.inf, distance_upper_bound=1.0)
    found = np.isfinite(distance)
    if not found.any():
        return Copies(0, len(few), 0.0, np.zeros(len(few)))
    later_s = LATEST_COPY_S * (many[partner[found], 0] - few[found, 0])
    delay_s = float(np.median(later_s))
    same = int((np.abs(later_s - delay_s) <= min(first.scan_s, second.scan_s) / 2).sum())
    chance = _chance(few, many, scan_s) if same > MOSTLY * len(few) else np.zeros(len(few))
    return Copies(same, len(few), delay_s if len(first.time_s) <= len(second.time_s) else -delay_s, chance)


def _chance(few: Floats, many: Floats, scan_s: float) -> Floats:
    """(N,) share of the other scans of a feed `many` (M, 4) with a plot where each of `few` (N, 4) is."""
    there = KDTree(many[:, 1:]).query_ball_point(few[:, 1:], 1.0, p=np.inf, return_length=True)
    scans = 1 + LATEST_COPY_S * np.ptp(many[:, 0]) / scan_s
    return np.asarray(np.clip((there - 1) / max(scans - 1, 1), 0, 1))


def _scaled(feed: Measured, sigma: Floats) -> Floats:
    """(N, 4) time, range and direction of each different plot, so that those of copies differ by less than one."""
    direction = np.column_stack([np.cos(feed.azimuth), np.sin(feed.azimuth)]) / sigma[1]
    plots = np.column_stack([feed.time_s / LATEST_COPY_S, np.column_stack([feed.range_m / sigma[0], direction]) / NEAR])
    return np.unique(plots, axis=0)
