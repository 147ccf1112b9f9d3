"""The table `intervals`: flow, speeds, occupancy and density of each gate and direction, with what was watched."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, tzinfo
from typing import Any

import numpy as np
from scipy.special import pdtrik

from vidtrack.arrays.types import Floats, Ints
from vidtrack.traffic.measures.passing import Passed

_SIGMAS, _ONE_SIDED = 1.96, 0.975
"""of the bounds: 95 %"""
_MISSED = 0.025
"""Passings that are not told, for each that is: 27 of 1,044 on roads seen from 8 m"""
V85_LEAST = 23
"""Vehicles; of fewer not even the fastest is an upper bound of the 85th percentile: 1 - 0.85^22 is below 0.975."""


def edges_of(spans: Floats, interval_s: float, utc: datetime | None, zone: tzinfo | None) -> Floats:
    """(I + 1,) s; ends of the intervals that hold all spans (S, 2): at whole multiples of interval_s after midnight.

    utc   of the site's time 0; None: multiples of interval_s after time 0
    zone  whose midnight that is; None: UTC's
    """
    phase = 0.0
    if utc is not None:
        local = utc.astimezone(zone or UTC)
        phase = (local - local.replace(hour=0, minute=0, second=0, microsecond=0)) / timedelta(seconds=1)
    first = np.floor((spans[:, 0].min() + phase) / interval_s + 1e-9)
    last = np.ceil((spans[:, 1].max() + phase) / interval_s - 1e-9)
    return np.asarray(np.arange(first, max(last, first + 1) + 1) * interval_s - phase)


def coverage(spans: Floats, edges: Floats) -> Floats:
    """(I,) share of each interval that was watched."""
    low, high = np.maximum(spans[:, :1], edges[:-1]), np.minimum(spans[:, 1:], edges[1:])
    return np.asarray(np.maximum(high - low, 0).sum(axis=0) / np.diff(edges))


@dataclass(frozen=True, slots=True, eq=False)
class Figures:
    """Figures of W ways (gate and direction: 2 gate + side) in I intervals, (W, I); NaN: not known.

    count, low, high    vehicles that passed while somebody watched; bounds of all in the interval, 95 %
    flow                vehicles/h
    time_mean, space_mean   m/s
    v85                 m/s; from V85_LEAST speeds on
    own, shared         m/s; standard deviations of time_mean: by the vehicles' own errors, by the calibration
    occupancy           share of the watched time in which a vehicle stands on the gate
    density             vehicles/km
    """

    count: Floats
    low: Floats
    high: Floats
    flow: Floats
    time_mean: Floats
    space_mean: Floats
    v85: Floats
    own: Floats
    shared: Floats
    occupancy: Floats
    density: Floats


def figure_columns(found: Figures) -> dict[str, tuple[str, Any]]:
    """The figures as columns name -> (unit, values) of a table, way by way."""
    return {
        "count": ("n", found.count.ravel()),
        "count_low": ("n", found.low.ravel()),
        "count_high": ("n", found.high.ravel()),
        "flow_per_h": ("1/h", found.flow.ravel()),
        "time_mean_speed_kmh": ("km/h", 3.6 * found.time_mean.ravel()),
        "speed_sigma_kmh": ("km/h", 3.6 * found.own.ravel()),
        "speed_shared_sigma_kmh": ("km/h", 3.6 * found.shared.ravel()),
        "space_mean_speed_kmh": ("km/h", 3.6 * found.space_mean.ravel()),
        "v85_kmh": ("km/h", 3.6 * found.v85.ravel()),
        "occupancy": ("1", found.occupancy.ravel()),
        "density_per_km": ("1/km", found.density.ravel()),
    }


def figures(passed: Passed, confidence: Floats, length: Floats, edges: Floats, watched: Floats, ways: int) -> Figures:
    """Sum up passings. Where nobody watched all is NaN, else zeros are written.

    In the bounds, how many passings were none and how many were missed are Poisson numbers, and as many passed while
    nobody watched as the rest has it.

    watched  (I,) or (W, I) the coverage
    """
    bins = len(edges) - 1
    interval = np.clip(np.searchsorted(edges, passed.t, side="right") - 1, 0, bins - 1)
    cell = (2 * passed.gate + passed.side) * bins + interval
    cells = ways * bins
    seen = np.broadcast_to(np.where(watched > 0, watched, np.nan), (ways, bins)).ravel()
    seconds = np.tile(np.diff(edges), ways) * seen

    count = _sum(cell, None, cells) + 0 * seen
    expected = _sum(cell, confidence, cells)
    unwatched = (1 / seen - 1) * np.maximum(count, 1)  # expected while nobody watched; after none, no more than one
    unwatched[seen > 1 - 1e-9] = 0
    low = np.maximum(count - _most(count - expected), 0)
    high = count + _most(_MISSED * expected) + np.ceil(unwatched + _SIGMAS * np.sqrt(unwatched / seen) - 1e-9)
    flow = 3600 * count / seconds

    known = np.isfinite(passed.speed) & (passed.speed > 0)
    at, v = cell[known], passed.speed[known]
    with np.errstate(divide="ignore", invalid="ignore"):
        n = _sum(at, None, cells)
        time_mean = _sum(at, v, cells) / n
        space_mean = n / _sum(at, 1 / v, cells)
        own = np.sqrt(_sum(at, passed.speed_sigma[known] ** 2, cells)) / n
        shared = _sum(at, passed.speed_shared[known], cells) / n  # the same error in all
        occupied = _occupied(cell, passed.t, length / passed.speed, cells) / seconds
        density = flow / (3.6 * space_mean)
    density[count == 0] = 0
    v85 = np.where(n >= V85_LEAST, _quantile(at, v, cells, 0.85), np.nan)
    table = count, np.maximum(low, 0), high, flow, time_mean, space_mean, v85, own, shared, occupied, density
    return Figures(*(np.where(np.isnan(seen), np.nan, values).reshape(ways, bins) for values in table))


def _most(mean: Floats) -> Floats:
    """Upper bounds of Poisson numbers of these means, one-sided 97.5 %: the first that so many are not above."""
    return np.asarray(np.ceil(pdtrik(_ONE_SIDED, np.maximum(mean, 1e-9))))


def _sum(cell: Ints, weights: Floats | None, cells: int) -> Floats:
    return np.bincount(cell, weights, cells).astype(float)


def _quantile(cell: Ints, values: Floats, cells: int, q: float) -> Floats:
    """(cells,) quantile of the values in each cell, linear between two; NaN in empty cells."""
    order = np.lexsort((values, cell))
    ordered = np.append(values[order], np.nan)
    n = np.bincount(cell, minlength=cells)
    place = q * np.maximum(n - 1, 0)
    below = np.cumsum(n) - n + place.astype(int)
    above = np.minimum(below + 1, np.cumsum(n) - 1)
    share = place - np.floor(place)
    mixed = (1 - share) * ordered[below] + share * ordered[np.maximum(above, 0)]
    return np.where(n > 0, mixed, np.nan)


def _occupied(cell: Ints, t: Floats, duration: Floats, cells: int) -> Floats:
    """(cells,) s in which at least one of the vehicles, each `duration` long about t, stands on its gate.

    NaN where the duration of one of them is not known.
    """
    order = np.lexsort((t - duration / 2, cell))
    cell, begin, end = cell[order], (t - duration / 2)[order], (t + duration / 2)[order]
    known = np.isfinite(duration[order])
    total = np.where(_sum(cell[~known], None, cells) > 0, np.nan, 0.0)
    cell, begin, end = cell[known], begin[known], end[known]
    if len(cell) == 0:
        return total
    apart = cell * (end.max() - begin.min() + 1.0)  # one axis for all cells, so that the latest end is of the cell
    latest = np.maximum.accumulate(end + apart) - apart
    before = np.where(np.diff(cell, prepend=-1) == 0, np.concatenate([[-np.inf], latest[:-1]]), -np.inf)
    return total + _sum(cell, np.maximum(end - np.maximum(begin, before), 0), cells)
