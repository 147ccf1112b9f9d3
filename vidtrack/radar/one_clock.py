"""One clock for a table whose rows are in order of arrival: days that end, clocks that are set, rows by target."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import PlotFormatError
from vidtrack.radar.checks import KNOWN, MEASURED, TIME, possible_times
from vidtrack.radar.rhythm import (
    DAY_S,
    FEW,
    LATE_S,
    begins_again,
    day_before,
    ends_day,
    midnights,
    of_day,
    one_target_each,
    set_back,
    whole_days,
)
from vidtrack.radar.table import Table, names_sensors

_log = logging.getLogger(__name__)

_WAS_SET = "if the clock was set or began anew, give times that go on"
_BY_TIME = "if the rows are only out of order, as of one target after the other, sort them by time_s"
_SEVERAL = "if these are several radars, give a table each, with --radars"


def on_one_clock(table: Table) -> Table:
    """The table with times that go on where a day ended or its clock was set back; other rows are to be sorted by time.

    Raises PlotFormatError where rows are of one radar after the other, or where times begin anew and nothing tells
    whether the clock did, or another radar's rows.
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
        if len(far) > FEW or begins_again(time_s, both) or _changing(table, rows[both], dated) is not None:
            back = both
    steps = back if len(back) else ended
    if not len(steps):
        return table
    where = _where(table, rows, int(steps[0]), len(back) or int(np.ptp(day)))
    _refuse_sensors(table, where, rows[np.union1d(ended, back)])
    column = _changing(table, rows[steps], dated)
    if len(back):
        if column is not None:  # each of its values is a piece, also where time goes on
            back = np.unique(np.searchsorted(rows[:-1], np.flatnonzero(table.changes(column))))
        clock_s = _gone_on(where, column, time_s, clock_s, back, dated is not None)
    elif dated is not None:
        _log.warning("%s: days are those of column %r", where, dated)
    elif column is not None and whole_days(time_s):
        raise PlotFormatError(
            f"{where}, where column {column!r} changes: if a day ended there, give times that go on, or name the "
            f"column 'date'; {_SEVERAL}"
        )
    else:
        _log.warning("%s, as if a day ended: time goes on there; %s; %s", where, _BY_TIME, _SEVERAL)
    times = table.columns[name].copy()
    times[rows] = clock_s
    return replace(table, columns=table.columns | {name: times})


def _gone_on(where: str, column: str | None, time_s: Floats, clock_s: Floats, back: Ints, with_days: bool) -> Floats:
    """The times (N,) of a clock that was set back at the rows (K,), or of rows to be sorted by time. Raises, see above.

    column     another one that changes at the rows (K,)
    time_s     (N,) as in the table
    clock_s    (N,) with the days that ended
    with_days  a column tells the days
    """
    over = ends_day(time_s, back) & (not with_days)
    if column is not None and one_target_each(clock_s, back):
        told = f"where column {column!r} changes: rows are sorted by time_s, as if they were in order of {column!r}"
        _log.warning("%s, %s; %s; %s", where, told, _WAS_SET, _SEVERAL)
        return clock_s if with_days else _by_target(time_s, clock_s, back)
    if column is not None:
        raise PlotFormatError(f"{where}, where column {column!r} changes: {_WAS_SET}; {_SEVERAL}")
    if begins_again(time_s, back):
        raise PlotFormatError(f"{where}, where it began before: {_WAS_SET}; {_SEVERAL}; {_BY_TIME}")
    if (~over).sum() > FEW:
        told = "rows are sorted by time_s, as if they were of one target after the other"
        _log.warning("%s: %s; %s; %s", where, told, _WAS_SET, _SEVERAL)
        return clock_s if with_days else _by_target(time_s, clock_s, back)
    told = "a day ended" if over[0] else "the clock was set"
    _log.warning("%s, as if %s: time goes on there; %s; %s", where, told, _BY_TIME, _SEVERAL)
    step_s = np.diff(clock_s)
    return _shifted(clock_s, back, np.where(over, DAY_S, np.median(step_s[step_s > 0]) - step_s[back - 1]))


def _by_target(time_s: Floats, clock_s: Floats, back: Ints) -> Floats:
    """The times (N,) of targets of which another begins at each of the rows (K,).

    If days ended, each begins within half a day of the begin of the one before.
    """
    if (time_s == clock_s).all():
        return clock_s
    begin = np.concatenate([[0], back])
    begin_s = np.unwrap(time_s[begin], period=DAY_S)
    begin_s -= DAY_S * np.floor(begin_s.min() / DAY_S)
    return _shifted(clock_s, begin, np.diff(begin_s - clock_s[begin], prepend=0.0))


def _shifted(time_s: Floats, back: Ints, shift_s: Floats) -> Floats:
    """The times (N,), from each of the rows (K,) on later by its shift (K,)."""
    passed = np.searchsorted(back, np.arange(len(time_s)), side="right")
    return time_s + np.concatenate([[0.0], np.cumsum(shift_s)])[passed]


def _where(table: Table, rows: Ints, first: int, count: int) -> str:
    """The begin of a message about steps in time, the first of them to the row `first` of these rows."""
    before_s, then_s = table.columns[TIME[1]][rows[[first - 1, first]]]
    more = f", the first of {count} such steps" if count > 1 else ""
    return (
        f"{table.path}: time_s goes {'back' if then_s < before_s else 'on'} from {before_s:.10g} to {then_s:.10g} s at "
        f"{table.unit} {table.line[rows[first]]}{more}"
    )


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
    for name in table.names if of_day(time_s).mean() > 0.5 else ():
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
