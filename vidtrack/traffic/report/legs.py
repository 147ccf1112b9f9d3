"""Flow and queue of each leg over the day."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.traffic.report.findings import Findings


@dataclass(frozen=True, slots=True, eq=False)
class LegDay:
    """What came in from a leg in each interval, (I,); NaN where nobody watched.

    flow            vehicles/h over its entry gates
    queue, queue_m  most vehicles that stood in one queue, and the length of the longest one [m], NaN if none is known
    """

    leg: str
    flow: Floats
    queue: Floats
    queue_m: Floats


def legs_of(found: Findings) -> list[LegDay]:
    """All legs with an entry gate, and those that vehicles entered from besides, in the order of the site."""
    bins = len(found.coverage)
    watched = found.coverage > 0
    hours = np.where(watched, found.coverage * np.diff(found.edges) / 3600, np.nan)
    start = np.array(found.words("trips", "from_leg"), object)
    at = found.interval(found.numbers("trips", "begin_s"))
    queue_leg = np.array(found.words("queues", "leg"), object)
    begin, end, vehicles, length = (
        found.numbers("queues", name) for name in ("begin_s", "end_s", "vehicles", "length_m")
    )
    first, last = found.interval(begin), found.interval(end)
    result = []
    shown = {*found.site.legs_with("entry"), *start} - {None}
    for leg in dict.fromkeys([*found.site.legs, *start]):
        if leg not in shown:
            continue
        flow = np.bincount(at[start == leg], minlength=bins) / hours
        queue, queue_m = np.where(watched, 0.0, np.nan), np.full(bins, np.nan)
        for k in np.flatnonzero(queue_leg == leg).tolist():
            over = slice(int(first[k]), int(last[k]) + 1)
            queue[over] = np.maximum(queue[over], vehicles[k])
            queue_m[over] = np.fmax(queue_m[over], length[k])
        result.append(LegDay(str(leg), flow, queue, np.where(queue > 0, queue_m, queue)))
    return result
