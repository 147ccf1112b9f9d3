"""The turning-movement sheet, and the peak hour with its factor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from vidtrack.arrays.types import Floats, Mask
from vidtrack.traffic.proportion import clopper_pearson
from vidtrack.traffic.report.findings import Findings
from vidtrack.traffic.report.turns import TURNS

WATCHED = 0.99
"""Share of an interval from which on it counts as watched for the peak hour: 9 s of 15 minutes may be missing."""
_TAIL = 0.025
"""of bounds of 95 %"""


@dataclass(frozen=True, slots=True)
class Movement:
    """From a leg to a leg. `turn`: one of TURNS, "" where the gates do not tell."""

    start: str
    end: str
    turn: str

    @property
    def name(self) -> str:
        return f"{self.start} {self.turn} to {self.end}".replace("  ", " ")


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """Whole trips by the interval in which they entered; `count` (I, M) with NaN where nobody watched."""

    edges: Floats
    coverage: Floats
    movements: tuple[Movement, ...]
    count: Floats

    @property
    def total(self) -> Floats:
        """(I,) of all movements."""
        return np.asarray(self.count.sum(axis=1))

    @property
    def sums(self) -> Floats:
        """(M,) over all watched intervals."""
        return np.asarray(np.nansum(self.count, axis=0))

    def of_leg(self, leg: str) -> Floats:
        """(I,) of the movements that begin on a leg."""
        return np.asarray(self.count[:, [movement.start == leg for movement in self.movements]].sum(axis=1))


@dataclass(frozen=True, slots=True)
class PeakHour:
    """The hour of whole intervals with most vehicles.

    first, last  intervals, the last one exclusive
    volume       vehicles in it
    factor, low, high   of the peak hour, and its bounds, 95 %
    """

    first: int
    last: int
    volume: float
    factor: float
    low: float
    high: float


def sheet_of(found: Findings, turns: Mapping[tuple[str, str], str]) -> Sheet:
    """Movements that the site allows, and those that were seen besides, in order of legs and turns.

    A site that does not say what it allows has a movement from each leg with an entry to each other one with an exit.
    """
    start, end = found.words("trips", "from_leg"), found.words("trips", "to_leg")
    complete = found.numbers("trips", "complete") > 0
    pairs = [(str(a), str(b)) for a, b, whole in zip(start, end, complete.tolist(), strict=True) if whole]
    legs = list(dict.fromkeys([*found.site.legs, *(leg for pair in pairs for leg in pair)]))
    order = [*TURNS, ""]
    ways = product(found.site.legs_with("entry"), found.site.legs_with("exit"))
    possible = found.site.movements.allowed or tuple((a, b) for a, b in ways if a != b)
    shown = sorted(
        {*possible, *pairs},
        key=lambda pair: (legs.index(pair[0]), order.index(turns.get(pair, "")), legs.index(pair[1])),
    )
    number = {pair: column for column, pair in enumerate(shown)}
    count = np.zeros((len(found.coverage), len(shown)))
    at = found.interval(found.numbers("trips", "begin_s")[complete])
    np.add.at(count, (at, np.array([number[pair] for pair in pairs], int)), 1.0)
    count[found.coverage <= 0] = np.nan
    movements = tuple(Movement(*pair, turns.get(pair, "")) for pair in shown)
    return Sheet(found.edges, found.coverage, movements, count)


def intervals_of_an_hour(edges: Floats) -> int | None:
    """How many intervals are an hour; None: no whole number."""
    count = 3600 / (edges[1] - edges[0])
    return round(count) if count >= 1 and abs(count - round(count)) < 1e-6 else None


def peak_hour(total: Floats, watched: Mask, edges: Floats) -> PeakHour | None:
    """The peak hour of counts (I,) in intervals; None where no hour was watched, or no hour is whole intervals."""
    whole = intervals_of_an_hour(edges)
    if whole is None or len(total) < whole:
        return None
    hours = np.lib.stride_tricks.sliding_window_view(np.where(watched, total, np.nan), whole).sum(axis=1)
    if not np.isfinite(hours).any() or np.nanmax(hours) == 0:
        return None
    first = int(np.nanargmax(hours))
    counts = total[first : first + whole]
    return PeakHour(first, first + whole, float(counts.sum()), *peak_hour_factor(counts))


def peak_hour_factor(counts: Floats) -> tuple[float, float, float]:
    """V / (n max V_i) of the counts V_i (n,) of an hour in n intervals, and its bounds, 95 %; NaN without vehicles.

    Of V vehicles that come independently, each is of interval i with probability p_i, and the factor that they are a
    sample of is 1 / (n max p_i). The largest p_i is at most the largest of their upper Clopper-Pearson bounds at
    2.5 %, and at least the largest of the lower bounds at 2.5 % / n. So at least 95 % of such bounds hold.
    """
    volume, n = counts.sum(), len(counts)
    if volume == 0:
        return np.nan, np.nan, np.nan
    low, high = clopper_pearson(counts, volume, _TAIL / n, _TAIL)
    share = n * np.array([counts.max() / volume, high.max(), max(low.max(), 1 / n)])
    factor, least, most = (1 / share).tolist()
    return factor, least, most
