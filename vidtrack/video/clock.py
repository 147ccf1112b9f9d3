"""Frame times from timestamps: strictly increasing, with a frame rate checked against the header."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

T = TypeVar("T")

FALLBACK_FPS = 25.0
LOWEST_FPS, HIGHEST_FPS = 0.001, 480.0  # headers with 600, 1000 or 90000 state a time base, not a camera
AGREEMENT = 0.1  # relative; a header's rate is kept within this of the measured one, because it is exact (30000/1001)
LONGEST_WAIT = 8  # items held back for the next sane stamp: bounds memory where there are no stamps at all


def stamp_rate(stamps: ArrayLike) -> float | None:
    """Items per unit of time from their timestamps in any order; None if the stamps are all the same.

    The mean of the intervals near the median: gaps do not count, and rounding to milliseconds (33, 33, 34) averages
    out. Items that share a stamp count separately.
    """
    stamps = np.asarray(stamps, dtype=float)
    distinct = np.unique(stamps)
    intervals = np.diff(distinct)
    if intervals.size == 0:
        return None
    median = np.median(intervals)
    typical = intervals[np.abs(intervals - median) <= median / 2].mean()
    return float(stamps.size / distinct.size / typical)


def is_plausible(fps: float) -> bool:
    """Whether a camera can have this rate [1/s]."""
    return LOWEST_FPS <= fps <= HIGHEST_FPS


def nominal_rate(header: float, measured: float | None) -> float | None:
    """The frame rate [1/s]: the measured one, or the header's exact value if they agree; None if both are implausible.

    header     rate that the file states, 0 for none
    measured   rate of the timestamps, None if unknown
    """
    if measured is None or abs(header / measured - 1) <= AGREEMENT:
        return header if is_plausible(header) else None
    return measured if is_plausible(measured) else None


def increasing_times(stamped: Iterable[tuple[float | None, T]], period: float) -> Iterator[tuple[float, T]]:
    """Strictly increasing times of all items, from 0, in the unit of the stamps.

    stamped   (timestamp or None, item) in the order of presentation
    period    nominal time between two items

    A stamp is valid if it is above all stamps before it. If the next stamp is below it, the first of the two is
    invalid, so that a single jump ahead does not invalidate the rest. Valid stamps are kept, and with them gaps and
    variable rates. Items between two valid stamps follow the earlier one at the nominal period, or evenly if short.
    After LONGEST_WAIT items without a valid stamp, time goes on at the nominal rate.
    """
    origin: float | None = None  # the stamp of time 0
    last = -period
    waiting: list[T] = []
    for stamp, following, item in _with_following(stamped):
        floor = -math.inf if origin is None else origin + last
        if stamp is not None and _is_sane(stamp, following, floor):
            if origin is None:
                origin = stamp - (last + period * (len(waiting) + 1))
            now = stamp - origin
            yield from _spaced(waiting, last, min(period, (now - last) / (len(waiting) + 1)))
            yield now, item
            last, waiting = now, []
        else:
            waiting.append(item)
            if len(waiting) == LONGEST_WAIT:
                yield from _spaced(waiting, last, period)
                last, waiting = last + period * len(waiting), []
    yield from _spaced(waiting, last, period)


def _is_sane(stamp: float, following: float | None, floor: float) -> bool:
    return stamp > floor and not (following is not None and floor < following < stamp)


def _spaced(items: list[T], last: float, step: float) -> Iterator[tuple[float, T]]:
    return ((last + step * count, item) for count, item in enumerate(items, 1))


def _with_following(stamped: Iterable[tuple[float | None, T]]) -> Iterator[tuple[float | None, float | None, T]]:
    """(stamp, the next item's stamp, item)."""
    held: tuple[float | None, T] | None = None
    for current in stamped:
        if held is not None:
            yield held[0], current[0], held[1]
        held = current
    if held is not None:
        yield held[0], None, held[1]
