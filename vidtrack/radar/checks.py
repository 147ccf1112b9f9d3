"""Checks of a table of plots: the range of each value, and the order of scans and times."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from vidtrack.arrays.types import Floats, Mask
from vidtrack.radar.rhythm import scan_times
from vidtrack.radar.table import Table

TIME = ("scan", "time_s")
POLAR = ("range_m", "azimuth_deg", "elevation_deg")
CARTESIAN = ("x_m", "y_m", "z_m")
DOPPLER = "doppler_m_s"
AMPLITUDE = "amplitude"
MEASURED = (*POLAR, *CARTESIAN, DOPPLER)
KNOWN = (*TIME, *MEASURED, *(f"sigma_{name}" for name in MEASURED), AMPLITUDE)

FARTHEST_M = 1e6
FASTEST_M_S = 1e5
WIDEST_DEG = 45.0
LATEST_S = 1e11
"""s; three thousand years: times since 1970 in milliseconds are beyond."""
LONGEST_GAP = 100_000


def check_numbers(table: Table, measured: list[str]) -> None:
    """Add a fault for each row with a value out of range."""
    columns = table.columns
    sigmas = [f"sigma_{name}" for name in measured if f"sigma_{name}" in columns]
    for name in (*TIME, *measured, *sigmas, *([AMPLITUDE] if AMPLITUDE in columns else [])):
        table.refuse(~np.isfinite(columns[name]), name, "a finite number is needed")
    table.refuse(_beyond(columns["time_s"]), "time_s", f"over {LATEST_S:,.0f} s: wrong units suspected")
    scan = columns["scan"]
    with np.errstate(invalid="ignore"):
        table.refuse((scan != np.floor(scan)) | (scan < 0) | (scan > 2**53), "scan", "scans are numbered 0, 1, 2, ...")
        for name in measured:
            _check_measured(table, name)
        for name in sigmas:
            table.refuse(columns[name] <= 0, name, "a standard deviation is above zero")
            if name.endswith("_deg"):
                table.refuse(columns[name] > WIDEST_DEG, name, f"at most {WIDEST_DEG:g} degrees make sense")
        if AMPLITUDE in columns:
            table.refuse(columns[AMPLITUDE] < 0, AMPLITUDE, "an amplitude is linear and not below zero")


def possible_times(time_s: Floats) -> Floats:
    """The times (N,), NaN in place of those that are refused."""
    return np.where(_beyond(time_s), np.nan, time_s)


def _beyond(time_s: Floats) -> Mask:
    return np.asarray(np.abs(time_s) > LATEST_S)


def _check_measured(table: Table, name: str) -> None:
    value = table.columns[name]
    if name in ("range_m", *CARTESIAN):
        table.refuse(np.abs(value) > FARTHEST_M, name, f"over {FARTHEST_M:,.0f} m: wrong units suspected")
    if name == "range_m":
        table.refuse(value < 0, name, "a range is not below zero")
    elif name == "azimuth_deg":
        table.refuse(np.abs(value) > 360, name, "an azimuth lies in -360..360 degrees")
    elif name == "elevation_deg":
        table.refuse(np.abs(value) > 90, name, "an elevation lies in -90..90 degrees")
    elif name == DOPPLER:
        table.refuse(np.abs(value) > FASTEST_M_S, name, f"over {FASTEST_M_S:,.0f} m/s: wrong units suspected")


def check_order(table: Table, measured: list[str]) -> None:
    """Add a fault for each repeated plot, and for scans with a wrong time or number."""
    scan, time_s = (table.columns[name] for name in TIME)
    rows = np.flatnonzero(table.good)
    columns = [table.columns[name][rows] for name in (*reversed(measured), "scan")]
    order = np.lexsort(columns)
    again = np.zeros(len(rows), bool)
    again[1:] = np.all([np.diff(column[order]) == 0 for column in columns], axis=0)
    for k in np.flatnonzero(again):
        table.note(rows[order[k]], f"the plot of {table.unit} {table.line[rows[order[k - 1]]]} again")

    rows = np.sort(rows[order[~again]])
    number, member, times = scan_times(scan[rows], time_s[rows])
    for k in np.flatnonzero(~_in_order(times)[member]):
        fault = (
            f"time_s is {time_s[rows[k]]:.10g}, but scan {scan[rows[k]]:.0f} does not fit between its neighbours' times"
        )
        table.note(rows[k], fault)
    jumped = np.cumsum(np.diff(number, prepend=number[:1]) > LONGEST_GAP) > 0
    for k in np.flatnonzero(jumped[member]):
        table.note(rows[k], f"scan is {scan[rows[k]]:.0f}; a gap of more than {LONGEST_GAP:,} scans before it")


def _in_order(values: Floats) -> Mask:
    """(N,) mask of a longest non-decreasing subsequence; the other values are out of order."""
    if (np.diff(values) >= 0).all():
        return np.ones(len(values), bool)
    ends: list[float] = []  # smallest last value of the subsequences of each length
    length = np.empty(len(values), np.int64)
    for k, value in enumerate(values.tolist()):
        length[k] = n = bisect_right(ends, value)
        ends[n : n + 1] = [value]
    chosen = np.zeros(len(values), bool)
    wanted = len(ends) - 1
    last = np.inf
    for k in range(len(values) - 1, -1, -1):
        if length[k] == wanted and values[k] <= last:
            chosen[k], last, wanted = True, values[k], wanted - 1
    return chosen
