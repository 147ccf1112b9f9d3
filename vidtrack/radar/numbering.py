"""Scans of a table that has no column of them: by its times, on one clock, and by the azimuths of an antenna."""

from __future__ import annotations

import difflib
import logging
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.radar.both_ways import both_ways
from vidtrack.radar.checks import CARTESIAN, KNOWN, POLAR, TIME, possible_times
from vidtrack.radar.coordinates import sector
from vidtrack.radar.feeds.messages import Kind, Message, Messages
from vidtrack.radar.feeds.pace import ONE_BY_ONE, USUAL_S, Turns, are_apart, pace_of, turn_within
from vidtrack.radar.one_clock import on_one_clock
from vidtrack.radar.rhythm import closed_up, longest_step, passes, scan_times
from vidtrack.radar.table import Table, bare

_log = logging.getLogger(__name__)

EVENLY = 0.1
"""Usual steps; how far a step may be from a multiple of the usual one to count as such."""

NARROW = 1e-9
"""rad; least width of a sector."""
CELLS, DIRECTIONS = 32, 8
"""Parts of a sector, and the number in which plots must be: a few directions in turn fit many antennas."""


def numbered(table: Table, place: tuple[float, float]) -> Table:
    """The table with a column of scans: those of its times, if it has none and no other column may be meant.

    place  x and y of the radar [m]

    A gap of several usual steps between two times holds empty scans, and a pause none.
    Raises PlotFormatError where times begin anew and may be of several radars.
    """
    scan, time = TIME
    similar = difflib.get_close_matches(scan, [bare(name) for name in table.names if name not in KNOWN])
    if scan in table.names or time not in table.columns or similar:
        return table
    table = on_one_clock(table)
    time_s = possible_times(table.columns[time])
    times, member, steps = _distinct(time_s)
    coarse_s = float(np.quantile(steps, 0.1)) if len(steps) else np.inf  # times that several plots share
    one_by_one = _one_by_one(steps, len(member))
    polar = _polar(table, time_s, place)
    turned = _turned(table, *polar, steps, coarse_s, one_by_one) if polar else None
    if turned is not None:
        return replace(table, columns=table.columns | {scan: turned})
    told = "plots of the same time are one scan"
    if one_by_one:
        _log.warning(
            "%s has no column 'scan', and nearly every plot its own time: give the plots of one turn the same scan",
            table.path,
        )
    elif polar and (swept_s := _swept(table, *polar, coarse_s)) is not None:
        told = "an antenna passes over a sector, the plots of one pass are one scan"
        times, member, steps = _distinct(swept_s)
    usual = float(np.median(steps)) if len(steps) else 1.0
    passed = np.where(steps > longest_step(steps), 1, np.maximum(1, np.round(steps / usual)))
    number = np.concatenate([[0], np.cumsum(passed)])
    number = np.concatenate([number, np.full(len(times) - len(number), np.nan)])
    _log.warning(
        "%s has no column 'scan': %s; %d scans, %.6g s apart", table.path, told, len(steps) + 1, usual
    )  # fmt: skip
    return replace(table, columns=table.columns | {scan: np.where(np.isfinite(number), number, 0.0)[member]})


def _distinct(time_s: Floats) -> tuple[Floats, Ints, Floats]:
    """The different times (K,), the one of each row (N,) among them, and the steps between those that are known."""
    times, member = np.unique(time_s, return_inverse=True)
    return times, member, np.diff(times[np.isfinite(times)])


def _one_by_one(steps: Floats, plots: int) -> bool:
    """Whether nearly each of the plots has its own time, with steps (N,) that are not multiples of the usual one."""
    return len(steps) >= max(2, ONE_BY_ONE * plots) and not _are_multiples(steps, float(np.median(steps)))


def _are_multiples(steps: Floats, of_s: float) -> bool:
    """Whether half or more of the steps (N,) are nearly multiples of a time [s]."""
    passed = steps / of_s
    return bool((np.abs(passed - np.maximum(1, np.round(passed))) <= EVENLY).mean() >= 0.5)


class _Antenna(NamedTuple):
    """Plots (N,) in the scans of an antenna.

    number  (N,) of the scan of each
    scan_s  s; duration of a scan
    told    what is a scan
    unsure  whether chance may make scans whose times are in another order
    """

    number: Ints
    scan_s: float
    told: str
    unsure: bool

    @classmethod
    def turning(cls, plots: Messages, turns: Turns, coarse_s: float) -> _Antenna:
        """One that turns, by plots of times in steps of coarse_s."""
        number = np.floor(turns.progress(plots)).astype(np.int64)
        return cls(number, turns.period_s, "turns", coarse_s > 0 or turns.period_s > USUAL_S)


class _TooCoarse(NamedTuple):
    """An antenna whose turns take turn_s [s], which steps of times are too coarse to tell."""

    turn_s: float


def _turned(
    table: Table, rows: Ints, plots: Messages, steps: Floats, coarse_s: float, one_by_one: bool
) -> Floats | None:
    """The turn of a rotating antenna, or its pass back or forth, that each row of the table is of.

    rows        (N,) of the plots
    steps       (K,) of their times, of which several are coarse_s long
    one_by_one  whether nearly each has its own time; these are exact where no antenna shows more targets than one
    None: they follow no antenna.
    """
    rounded = not one_by_one or (_are_multiples(steps, coarse_s) and are_apart(plots))
    antenna = _antenna(plots, coarse_s, rounded)
    if isinstance(antenna, _TooCoarse):
        _log.warning(
            "%s: azimuths follow an antenna with turns of %.3g s, but times are in steps of %.3g s, too coarse to "
            "tell its turns: give a column 'scan', or finer times", table.path, antenna.turn_s, coarse_s,
        )  # fmt: skip
    if not isinstance(antenna, _Antenna):
        return None
    number = closed_up(antenna.number, plots.time_s)
    if antenna.unsure and (np.diff(scan_times(number, plots.time_s)[2]) < 0).any():
        return None  # the check of order would refuse the table
    scan = np.zeros(len(table.line))
    scan[rows] = number - number.min()
    _log.warning(
        "%s has no column 'scan': azimuths and times follow an antenna, its %s are scans; %d scans, %.6g s apart",
        table.path, antenna.told, scan.max() + 1, antenna.scan_s,
    )  # fmt: skip
    return scan


def _antenna(plots: Messages, coarse_s: float, rounded: bool) -> _Antenna | _TooCoarse | None:
    """The scans of an antenna that turns to the right, sweeps back and forth, or turns to the left, as in a mirror.

    coarse_s  step of the times, which may be rounded to it
    None: plots follow no antenna.
    """
    step_s = coarse_s if rounded else 0.0
    if isinstance(turns := pace_of(plots, None, step_s), Turns):
        return _Antenna.turning(plots, turns, step_s)
    if not are_apart(plots):
        return None
    if (swept := both_ways(plots.time_s, plots.u, plots.v, coarse_s)) is not None:
        return _Antenna(*swept, "passes back and forth", unsure=False)
    if rounded and (short_s := turn_within(plots, coarse_s)):
        return _TooCoarse(short_s)
    begin, width = sector(plots.v % (2 * np.pi))
    part = (plots.v - begin) % (2 * np.pi) / max(width, NARROW)
    if len(np.unique(np.floor(CELLS * part))) < DIRECTIONS:
        return None
    mirrored = replace(plots, v=-plots.v)
    if isinstance(turns := pace_of(mirrored, None, coarse_s), Turns):
        return _Antenna.turning(mirrored, turns, coarse_s)
    return _TooCoarse(short_s) if rounded and (short_s := turn_within(mirrored, coarse_s)) else None


def _swept(table: Table, rows: Ints, plots: Messages, coarse_s: float) -> Floats | None:
    """The mean time [s] of the pass of an antenna over a sector that each row of the table is of.

    rows  (N,) of the plots
    None: there are no passes, or each may be a target that passes before a radar that stares.
    """
    senses = (passes(plots.time_s, side * plots.v, coarse_s) for side in (1, -1)) if are_apart(plots) else ()
    number = next((one for one in senses if one is not None), None)
    if number is None:
        return None
    mean_s = np.full(len(table.line), np.nan)
    mean_s[rows] = scan_times(number, plots.time_s)[2][number]
    return mean_s


def _polar(table: Table, time_s: Floats, place: tuple[float, float]) -> tuple[Ints, Messages] | None:
    """Rows (N,) of plots of a radar at (x, y) [m] in order of time_s, and the plots; None for fewer than two."""
    if set(POLAR[:2]) <= table.columns.keys():
        range_m, azimuth = table.columns[POLAR[0]], np.radians(table.columns[POLAR[1]])
    elif set(CARTESIAN[:2]) <= table.columns.keys():
        east, north = (table.columns[name] - from_m for name, from_m in zip(CARTESIAN[:2], place, strict=True))
        range_m, azimuth = np.hypot(east, north), np.arctan2(east, north)
    else:
        return None
    rows = np.flatnonzero(np.isfinite(time_s) & np.isfinite(range_m) & np.isfinite(azimuth))
    if len(rows) < 2:
        return None
    rows = rows[np.argsort(time_s[rows], kind="stable")]
    plots = (Message(Kind.POLAR, 0, 0, *one) for one in zip(time_s[rows], range_m[rows], azimuth[rows], strict=True))
    return rows, Messages.of(list(plots))
