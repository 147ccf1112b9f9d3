"""How regularly scans follow each other: their time, pauses that no track outlives, and clocks that are set back."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints, Mask

T = TypeVar("T", np.float64, np.int64)
USUAL = 4
"""Medians of the steps; longer ones tell nothing of the time of a scan."""
PAUSE_S, PAUSE_SCANS = 3600.0, 100
"""A step from one scan to the next that is longer than both, the second in usual steps, is a pause."""

LATE_S = 5.0
"""s; a row of a table that is later in it by more than this is out of order, or its clock was set back."""
FEW = 3
"""Steps back in a table in order of arrival; with more of them, but for midnights, its rows are in another order."""
DAY_S, MIDNIGHT_S, MIDNIGHT_STEPS = 86_400.0, 60.0, 3
"""s; a step by a day, less up to the second, or so many usual steps, is over midnight in times of day."""
AGREED, KEPT = 3, 10
"""Rows before a clock was set back, and rows after it, that agree about it."""
ANEW = 0.02
"""Share of the time up to a step back; a step to so near the begin, or to LATE_S, begins there once more."""
NEXT, PASSES, SWEEPS = 1.5, 10, 0.9
"""Steps of coarse times up to which two follow each other; least number of times that do, of passes of an antenna over
a sector, and the share of them after which it has turned to the right, and of gaps after which it is back."""


class Rhythm(NamedTuple):
    """The times of scans.

    scan_s   s; usual time of a scan: the mean of steps that are at most four medians long, so that a jump or a silence
             does not change it, or, if times are so coarse that the median is 0, of all outside of pauses; 0 for a
             single scan
    limit_s  s; a longer step is a pause; infinite for a single scan
    begin_s, end_s   (K,) s; the last scan before each pause, and the first after it
    """

    scan_s: float
    limit_s: float
    begin_s: Floats
    end_s: Floats


def rhythm(scan: Ints, time_s: Floats) -> Rhythm:
    """The rhythm of scans with these plots (N,): their scans' numbers in order, and times; empty scans count, too."""
    number, first, size = np.unique(scan, return_index=True, return_counts=True)
    mean_s = np.add.reduceat(time_s, first) / size
    scans, step_s = np.diff(number), np.diff(mean_s)
    limit_s = longest_step(step_s / scans)
    paused: Mask = step_s > limit_s * scans
    median_s = np.median(step_s / scans) if len(scans) else 0.0
    usual = step_s <= USUAL * median_s * scans if median_s > 0 else ~paused
    scan_s = step_s[usual].sum() / max(1, int(scans[usual].sum()))
    return Rhythm(float(scan_s), limit_s, mean_s[:-1][paused], mean_s[1:][paused])


def scan_times(scan: NDArray[T], time_s: Floats) -> tuple[NDArray[T], Ints, Floats]:
    """Numbers (K,) of the scans of plots (N,) in any order, the scan of each among them (N,), and mean times (K,)."""
    number, member, size = np.unique(scan, return_inverse=True, return_counts=True)
    return number, member, np.bincount(member, time_s) / size


def closed_up(scan: Ints, time_s: Floats) -> Ints:
    """Numbers of scans (N,) that times (N,) told, in any order, without the empty ones that a pause would hold."""
    number, member, mean_s = scan_times(scan, time_s)
    scans, step_s = np.diff(number), np.diff(mean_s)
    idle = np.where(step_s > longest_step(step_s / scans), scans - 1, 0)
    return np.asarray(scan - np.concatenate([[0], np.cumsum(idle)])[member])


def set_back(time_s: Floats) -> Ints:
    """The rows (K,) at which times (N,) go back by over LATE_S and stay behind, in the order of rows.

    None if as many of the pieces between all such steps fall as rise, or if more than FEW pieces have fewer than KEPT
    rows on average: then the rows are in another order. A row that comes late, or has a wrong time, is none, nor are
    rows whose times catch up at once.
    """
    back = (np.flatnonzero(np.diff(time_s) < -LATE_S) + 1).tolist()
    if not back or not _in_order(len(back), len(time_s)):
        return np.zeros(0, np.int64)
    if sum(np.sign(piece[-1] - piece[0]) for piece in np.split(time_s, back)) <= 0:
        return np.zeros(0, np.int64)
    return np.array([k for k, end in pairwise([*back, len(time_s)]) if _stays_back(time_s, k, end)], np.int64)


def _in_order(back: int, rows: int) -> bool:
    """Whether so many steps back in so many rows leave them in order of arrival, by pieces."""
    return back <= FEW or rows >= KEPT * back


def _stays_back(time_s: Floats, row: int, end: int) -> bool:
    """Whether the clock is behind that of the rows before from a row on, up to `end`."""
    before_s = time_s[max(0, row - AGREED) : row].min()
    ahead = time_s[row:end] >= before_s
    kept = time_s[row : row + int(ahead.argmax()) if ahead.any() else end]
    return len(kept) >= KEPT and len(np.unique(kept)) >= AGREED


def begins_again(time_s: Floats, back: Ints) -> bool:
    """Whether at half or more of the rows (K,) times (N,) go back to about where they began."""
    near_s = np.maximum(LATE_S, ANEW * (time_s[back - 1] - time_s[0]))
    return bool((np.abs(time_s[back] - time_s[0]) <= near_s).mean() >= 0.5)


def one_target_each(time_s: Floats, back: Ints) -> bool:
    """Whether times (N,) in pieces that begin at the rows (K,) may be of one target each: then none is there twice."""
    piece = np.searchsorted(back, np.arange(len(time_s)), side="right")
    return len(np.unique(piece + 1j * time_s)) == len(time_s)


def of_day(time_s: Floats) -> Mask:
    """Which times (N,) may be times of day."""
    return np.asarray((time_s >= 0) & (time_s <= DAY_S))


def midnights(time_s: Floats) -> Ints:
    """The day, from 0, of times of day (N,): steps from one end of the day to the other, and back, are counted.

    Not those to a lone time at the other end, and back from it: that time is wrong. All are of one day if its rows are
    in another order than that of arrival.
    """
    step_s = np.diff(time_s)
    over: Mask = (DAY_S - np.abs(step_s) <= _near_midnight(time_s)) & of_day(time_s[1:]) & of_day(time_s[:-1])
    far = np.pad(np.abs(step_s) > _near_midnight(time_s), 1)  # the steps, between two that are not
    back = np.abs(step_s[:-1] + step_s[1:]) < DAY_S / 2
    lone = np.flatnonzero(~far[:-3] & far[1:-2] & far[2:-1] & ~far[3:] & back & (over[:-1] != over[1:]))
    over[lone], over[lone + 1] = False, False
    day = np.concatenate([[0], np.cumsum(np.where(over, -np.sign(step_s), 0))]).astype(np.int64)
    disorder = int((np.diff(time_s + DAY_S * day) < -LATE_S).sum())
    return np.asarray(day - day.min()) if _in_order(disorder, len(day)) else np.zeros_like(day)


def day_before(time_s: Floats, day: Ints) -> Ints:
    """The rows (K,) from which times of day (N,) of these days may be of the day before: they go on by over half a day.

    So they do where rows of another target, or of another radar, begin before midnight once more.
    """
    far = np.flatnonzero((np.diff(time_s) > DAY_S / 2) & (np.diff(day) == 0) & (day[1:] > 0)) + 1
    return far[of_day(time_s[far])]


def ends_day(time_s: Floats, back: Ints) -> Mask:
    """At which of the rows (K,) times of day (N,) go back by over half a day: then one ended, with a gap."""
    return np.asarray((time_s[back] - time_s[back - 1] < -DAY_S / 2) & of_day(time_s[back]) & of_day(time_s[back - 1]))


def whole_days(time_s: Floats) -> bool:
    """Whether times (N,) from midnight to midnight are from the first one on, and up to the last one."""
    near_s = _near_midnight(time_s)
    return bool(0 <= time_s[0] <= near_s and time_s[-1] >= DAY_S - near_s)


def _near_midnight(time_s: Floats) -> float:
    """How near to midnight [s] the last of times of day (N,) before it, and the first one after it, are together."""
    step_s = np.abs(np.diff(time_s))
    return min(max(MIDNIGHT_S, MIDNIGHT_STEPS * float(np.median(step_s[step_s > 0]))), DAY_S / 2)


def passes(time_s: Floats, azimuth: Floats, coarse_s: float) -> Ints | None:
    """The pass of an antenna over a sector, from 0, that each of the plots (N,) is of, by times in steps of coarse_s.

    Times that follow each other are of one pass, in which azimuths [rad] go to the right; after a gap they are back.
    None if they do not do so, or too seldom.
    """
    times, member = np.unique(time_s, return_inverse=True)
    gap = np.diff(times) > NEXT * coarse_s
    toward = np.bincount(member, np.cos(azimuth)) + 1j * np.bincount(member, np.sin(azimuth))
    right = np.angle(toward[1:] * toward[:-1].conj()) > 0
    between = np.zeros(len(gap), bool)
    between[1:-1] = gap[1:-1] & ~gap[:-2] & ~gap[2:]
    if min((~gap).sum(), between.sum()) < PASSES or min(right[~gap].mean(), 1 - right[between].mean()) < SWEEPS:
        return None
    return np.concatenate([[0], np.cumsum(gap)])[member]


def longest_step(step_s: Floats) -> float:
    """Longest step that is no pause [s], after steps (N,) from scan to scan; infinite without any."""
    return max(PAUSE_S, PAUSE_SCANS * float(np.median(step_s))) if len(step_s) else np.inf
