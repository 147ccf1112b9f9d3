"""Local days and their intervals. A day has 23 or 25 hours where the clock is changed."""

from __future__ import annotations

from datetime import date, datetime, time, tzinfo
from zoneinfo import ZoneInfo

import numpy as np

from vidtrack.arrays.types import Floats

DAY_S = 86400
EVERY = {"1min": 60, "5min": 300, "15min": 900, "1h": 3600, "1d": DAY_S}
"""Names and lengths [s] of the intervals."""


def zone_of(name: str | None) -> tzinfo | None:
    """The time zone of this name; None: that of this machine."""
    return None if name is None else ZoneInfo(name)


def date_of(unix_s: float, zone: tzinfo | None) -> date:
    """The local date."""
    return datetime.fromtimestamp(unix_s, zone).date()


def span_of(day: date, zone: tzinfo | None) -> tuple[float, float]:
    """Unix times [s] of the day's begin and end."""
    following = date.fromordinal(day.toordinal() + 1)
    begin, end = (datetime.combine(each, time(), zone).timestamp() for each in (day, following))
    return begin, end


def edges_of_day(day: date, every_s: float, zone: tzinfo | None) -> Floats:
    """(I + 1,) Unix times [s] of the ends of the day's intervals; the last one may be shorter."""
    begin, end = span_of(day, zone)
    starts = np.array([begin]) if every_s >= DAY_S else np.arange(begin, end, every_s)
    return np.append(starts, end)


def by_day(begin: float, end: float, zone: tzinfo | None) -> list[tuple[date, float, float]]:
    """A span of time in pieces of one local day each."""
    pieces = []
    while begin < end:
        day = date_of(begin, zone)
        stop = min(end, span_of(day, zone)[1])
        pieces.append((day, begin, stop))
        begin = stop
    return pieces
