"""Scans of a table that has no column of them: by its times, on one clock, and by the azimuths of an antenna."""

from __future__ import annotations

import difflib
import logging
from dataclasses import replace

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.radar.checks import CARTESIAN, KNOWN, POLAR, TIME, possible_times
from vidtrack.radar.feeds.messages import Kind, Message, Messages
from vidtrack.radar.feeds.pace import ONE_BY_ONE, USUAL_S, Turns, are_apart, pace_of, turn_within
from vidtrack.radar.one_clock import on_one_clock
from vidtrack.radar.rhythm import closed_up, longest_step, passes, scan_times
from vidtrack.radar.table import Table, bare

_log = logging.getLogger(__name__)

EVENLY = 0.1
"""Usual steps; how far a step may be from a multiple of the usual one to count as such."""


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
    one_by_one = _one_by_one(steps, len(member))
    coarse_s = float(np.quantile(steps, 0.1)) if len(steps) else np.inf  # times that several plots share
    polar = _polar(table, time_s, place)
    turned = _turned(table, *polar, 0.0 if one_by_one else coarse_s) if polar else None
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
    if len(steps) < 2 or len(steps) < ONE_BY_ONE * plots:
        return False
    passed = steps / np.median(steps)
    return bool((np.abs(passed - np.maximum(1, np.round(passed))) > EVENLY).mean() > 0.5)


def _turned(table: Table, rows: Ints, plots: Messages, coarse_s: float) -> Floats | None:
    """The turn of a rotating antenna that each row of the table is of, by plots of times in steps of coarse_s.

    rows  (N,) of the plots
    None: they follow no antenna.
    """
    pace = pace_of(plots, None, coarse_s)
    if not isinstance(pace, Turns):
        short_s = turn_within(plots, coarse_s) if 0 < coarse_s < np.inf else None
        if short_s is not None:
            _log.warning(
                "%s: azimuths follow an antenna with turns of %.3g s, but times are in steps of %.3g s, too coarse to "
                "tell its turns: give a column 'scan', or finer times", table.path, short_s, coarse_s,
            )  # fmt: skip
        return None
    turn = closed_up(np.floor(pace.progress(plots)).astype(np.int64), plots.time_s)
    unsure = coarse_s > 0 or pace.period_s > USUAL_S
    if unsure and (np.diff(scan_times(turn, plots.time_s)[2]) < 0).any():
        return None  # the check of order would refuse the table
    scan = np.zeros(len(table.line))
    scan[rows] = turn - turn.min()
    _log.warning(
        "%s has no column 'scan': azimuths and times follow an antenna, its turns are scans; %d scans, %.6g s apart",
        table.path, scan.max() + 1, pace.period_s,
    )  # fmt: skip
    return scan


def _swept(table: Table, rows: Ints, plots: Messages, coarse_s: float) -> Floats | None:
    """The mean time [s] of the pass of an antenna over a sector that each row of the table is of.

    rows  (N,) of the plots
    None: there are no passes, or each may be a target that passes before a radar that stares.
    """
    number = passes(plots.time_s, plots.v, coarse_s) if are_apart(plots) else None
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
