"""Scans of a table that has no column of them: by its times, on one clock, and by the azimuths of an antenna."""

from __future__ import annotations

import difflib
import logging
from dataclasses import replace

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import PlotFormatError
from vidtrack.radar.checks import CARTESIAN, KNOWN, MEASURED, POLAR, TIME, names_sensors, possible_times
from vidtrack.radar.feeds.messages import Kind, Message, Messages
from vidtrack.radar.feeds.pace import ONE_BY_ONE, USUAL_S, Turns, are_apart, pace_of, turn_within
from vidtrack.radar.rhythm import (
    DAY_S,
    FEW,
    LATE_S,
    begins_again,
    closed_up,
    day_before,
    ends_day,
    longest_step,
    midnights,
    of_day,
    one_target_each,
    passes,
    scan_times,
    set_back,
    whole_days,
)
from vidtrack.radar.table import Table, bare

_log = logging.getLogger(__name__)

_WAS_SET = "if the clock was set or began anew, give times that go on"
_BY_TIME = "if the rows are only out of order, as of one target after the other, sort them by time_s"
_SEVERAL = "if these are several radars, give a table each, with --radars"
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
    table = _on_one_clock(table)
    time_s = possible_times(table.columns[time])
    times, member = np.unique(time_s, return_inverse=True)
    steps = np.diff(times[np.isfinite(times)])
    usual = float(np.median(steps)) if len(steps) else 1.0
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
        times, member = np.unique(swept_s, return_inverse=True)
        steps = np.diff(times[np.isfinite(times)])
        usual = float(np.median(steps))
    passed = np.where(steps > longest_step(steps), 1, np.maximum(1, np.round(steps / usual)))
    number = np.concatenate([[0], np.cumsum(passed)])
    number = np.concatenate([number, np.full(len(times) - len(number), np.nan)])
    _log.warning(
        "%s has no column 'scan': %s; %d scans, %.6g s apart", table.path, told, len(steps) + 1, usual
    )  # fmt: skip
    return replace(table, columns=table.columns | {scan: np.where(np.isfinite(number), number, 0.0)[member]})


def _on_one_clock(table: Table) -> Table:
    """The table with times that go on where a day ended or its clock was set back; other rows are to be sorted by time.

    Raises PlotFormatError where times begin anew and nothing tells whether the clock did, or another sensor's rows.
    """
    name = TIME[1]
    rows = np.flatnonzero(np.isfinite(possible_times(table.columns[name])))
    time_s = table.columns[name][rows]
    if not (np.abs(np.diff(time_s)) > LATE_S).any() or (np.diff(time_s) >= 0).all():
        return table
    dated, day = _days(table, rows)
    if dated is None:
        day = midnights(time_s)
    clock_s = time_s + DAY_S * day
    ended, back = np.flatnonzero(np.diff(day)) + 1, set_back(clock_s)
    if dated is None and len(far := day_before(time_s, day)):
        both = np.union1d(back, far)
        if begins_again(time_s, both) or _changing(table, rows[both], dated) is not None:
            back = both
    changed = back if len(back) else ended
    if not len(changed):
        return table
    first = int(changed[0])
    count = len(back) or int(np.ptp(day))
    where = (
        f"{table.path}: time_s goes {'back' if time_s[first] < time_s[first - 1] else 'on'} from "
        f"{time_s[first - 1]:.10g} to {time_s[first]:.10g} s at {table.unit} {table.line[rows[first]]}"
        f"{f', the first of {count} such steps' if count > 1 else ''}"
    )
    _refuse_sensors(table, where, rows[np.union1d(ended, back)])
    column = _changing(table, rows[changed], dated)
    if not len(back):
        if dated is None and column is not None and whole_days(time_s):
            raise PlotFormatError(
                f"{where}, where column {column!r} changes: if a day ended there, give times that go on, or name the "
                f"column 'date'; {_SEVERAL}"
            )
        if dated is not None:
            _log.warning("%s: days are those of column %r", where, dated)
        else:
            _log.warning("%s, as if a day ended: time goes on there; %s; %s", where, _BY_TIME, _SEVERAL)
    elif column is not None and one_target_each(clock_s, back):
        for k in back.tolist() if dated is None else ():  # each target's days begin anew
            clock_s[k:] += time_s[k] - clock_s[k]
        _log.warning(
            "%s, where column %r changes: rows are sorted by time_s, as if they were in order of %r; %s; %s",
            where, column, column, _WAS_SET, _SEVERAL,
        )  # fmt: skip
    elif column is not None:
        raise PlotFormatError(f"{where}, where column {column!r} changes: {_WAS_SET}; {_SEVERAL}")
    elif begins_again(time_s, back):
        raise PlotFormatError(f"{where}, where it began before: {_WAS_SET}; {_SEVERAL}; {_BY_TIME}")
    elif len(back) > FEW:
        _log.warning(
            "%s: rows are sorted by time_s, as if they were of one target after the other; %s; %s",
            where, _WAS_SET, _SEVERAL,
        )  # fmt: skip
    else:
        over = ends_day(time_s, back) & (dated is None)
        step_s = np.diff(clock_s)
        shift_s = np.where(over, DAY_S, np.median(step_s[step_s > 0]) - step_s[back - 1])
        clock_s += np.concatenate([[0.0], np.cumsum(shift_s)])[np.searchsorted(back, np.arange(len(rows)), "right")]
        told = "a day ended" if over[0] else "the clock was set"
        _log.warning("%s, as if %s: time goes on there; %s; %s", where, told, _BY_TIME, _SEVERAL)
    times = table.columns[name].copy()
    times[rows] = clock_s
    return replace(table, columns=table.columns | {name: times})


def _refuse_sensors(table: Table, where: str, steps: Ints) -> None:
    """Raise PlotFormatError if a column that names radars changes at some of these rows (K,) and hardly elsewhere."""
    for name in table.names:
        if names_sensors(name):
            new = table.changes(name)
            if new[steps].any() and new.sum() <= 2 * len(steps):
                raise PlotFormatError(
                    f"{where}, and rows are in order of column {name!r}: {_SEVERAL}, else leave that column out"
                )


def _days(table: Table, rows: Ints) -> tuple[str | None, Ints]:
    """The column that tells the day of each row, and the days (N,) since the first one; None and zeros without one.

    Times are times of day only if they go back where the day goes on.
    """
    time_s = table.columns[TIME[1]][rows]
    for name in table.names if of_day(time_s).all() else ():
        number = None if name in KNOWN else table.days(name)
        if number is not None:
            day = number[rows] - number[rows].min()
            moved = np.diff(day) != 0
            if moved.any() and (np.diff(day) * np.diff(time_s) < 0)[moved].mean() > 0.5:
                return name, day
    return None, np.zeros(len(rows), np.int64)


def _changing(table: Table, back: Ints, dated: str | None) -> str | None:
    """The name of another column, as of a target, that changes where time goes back and hardly elsewhere."""
    told = {TIME[1], *MEASURED, dated}
    for name in table.names:
        new = None if name in told else table.changes(name)
        if new is not None and new[back].all() and new.sum() <= 2 * len(back):
            return name
    return None


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
