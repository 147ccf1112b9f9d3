"""How well crossings were counted, by a count by hand: event by event, with 95 % intervals.

Hits, misses and false counts are of matched events: in totals misses and double counts cancel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.special import gammaincinv

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.errors import ConfigError
from vidtrack.traffic.proportion import clopper_pearson
from vidtrack.traffic.validation.event_matching import match
from vidtrack.traffic.validation.event_tables import Events, written

_TAIL = 0.025
WANTED_BIAS = 0.05
"""Half the width of the bias's interval that a count by hand shall reach."""
_ZONES_S = 900 * np.arange(-56, 57)
"""s; by which clocks of two zones differ: quarters of an hour, up to 14 hours"""
_FEWEST = 10
"""Crossings that must be found in another zone before it is named"""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A figure with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Figures:
    """What became of the crossings of a gate, or of all.

    noted       by hand, for certain
    uncertain   by hand, not for certain: neither found nor missed
    hit, missed, false   noted and counted; noted only; counted only
    recall, precision    hit / noted, hit / (hit + false); None where nothing was noted, or counted
    bias        (false - missed) / noted
    per_hour    noted
    geh         of the hourly flows, counted against noted
    minutes     that must be counted by hand until the bias is known to +-5 %, with such errors and such a flow
    """

    noted: int
    uncertain: int
    hit: int
    missed: int
    false: int
    recall: Estimate | None
    precision: Estimate | None
    bias: Estimate | None
    per_hour: float
    geh: Estimate | None
    minutes: float | None


@dataclass(frozen=True, slots=True)
class Validation:
    """The comparison in the time from begin to end [s, by the clock of the events].

    gates    figures of each gate that was counted by hand
    pooled   of all of them
    unnoted  gates without a count by hand, which are left out
    """

    clock: str
    tolerance_s: float
    begin: float
    end: float
    gates: dict[str, Figures]
    pooled: Figures
    unnoted: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def validate(
    counted: Events, noted: Events, tolerance_s: float, begin: float | None = None, end: float | None = None
) -> Validation:
    """Compare what was counted with what was noted by hand.

    tolerance_s  largest difference in time of a hit
    begin, end   of the count by hand; None: the first and the last noted crossing, and the tolerance around them

    What was noted outside this time counts as uncertain. Raises ConfigError for a tolerance that is not above 0, and
    where the two do not overlap in time, or are of two zones.
    """
    if not 0 < tolerance_s < np.inf:
        raise ConfigError(f"a tolerance of {tolerance_s} s; give a number of seconds above 0")
    begin = float(noted.time.min()) - tolerance_s if begin is None else begin
    end = float(noted.time.max()) + tolerance_s if end is None else end
    _check_overlap(counted, noted, begin, end, tolerance_s)
    noted = noted.select((noted.time >= begin - tolerance_s) & (noted.time <= end + tolerance_s))
    sure = noted.certain & (noted.time >= begin) & (noted.time <= end)
    of_interest = (counted.time >= begin) & (counted.time <= end)
    gates, tallies = list(dict.fromkeys(sorted(noted.gate.tolist()))), []
    for gate in gates:
        directions = {*noted.direction[noted.gate == gate], *counted.direction[counted.gate == gate]}
        tallies.append(
            sum(
                (
                    _tally(
                        counted.time[here := (counted.gate == gate) & (counted.direction == direction)],
                        of_interest[here],
                        noted.time[there := (noted.gate == gate) & (noted.direction == direction)],
                        sure[there],
                        tolerance_s,
                    )
                    for direction in sorted(directions)
                ),
                start=np.zeros(4, int),
            )
        )
    hours = (end - begin) / 3600
    figures = {gate: figures_of(tally, hours) for gate, tally in zip(gates, tallies, strict=True)}
    pooled = figures_of(np.sum(tallies, axis=0), hours)
    if noted.clock == "utc" and 2 * pooled.hit < pooled.noted:
        _check_zone(counted, noted.select(sure), pooled.hit, tolerance_s)
    unnoted = tuple(sorted({*counted.gate.tolist()} - {*gates}))
    return Validation(noted.clock, tolerance_s, begin, end, figures, pooled, unnoted)


def _tally(counted: np.ndarray, of_interest: Mask, noted: np.ndarray, sure: Mask, tolerance_s: float) -> np.ndarray:
    """(4,) hits, misses, false counts and uncertain ones of one gate and direction."""
    found = match(counted, noted, sure, tolerance_s)
    alone = of_interest.copy()
    alone[found[found >= 0]] = False
    hits = int((sure & (found >= 0)).sum())
    return np.array([hits, int(sure.sum()) - hits, int(alone.sum()), int((~sure).sum())])


def figures_of(tally: Ints, hours: float) -> Figures:
    """The figures of so many hits, misses, false counts and uncertain ones (4,) in so many hours."""
    hit, missed, false, uncertain = tally.tolist()
    noted = hit + missed
    bias = net_bias(noted, missed, false) if noted else None
    flow = noted / hours
    wanted = noted_for(missed / noted, false / noted) if noted else None
    return Figures(
        *(noted, uncertain, hit, missed, false),
        recall=proportion(hit, noted) if noted else None,
        precision=proportion(hit, hit + false) if hit + false else None,
        bias=bias,
        per_hour=flow,
        geh=None if bias is None else geh(flow, bias),
        minutes=None if wanted is None else 60 * wanted / flow,
    )


def proportion(part: float, whole: float) -> Estimate:
    """A share with an interval that holds the truth in at least 95 %."""
    low, high = clopper_pearson(part, whole, _TAIL, _TAIL)
    return Estimate(part / whole, float(low), float(high))


def net_bias(noted: float, missed: float, false: float) -> Estimate:
    """(false - missed) / noted, with an interval.

    Misses are a binomial share of the noted, false counts are a Poisson number beside them (Garwood 1936). The interval
    of their difference is put together from their own ones by Zou and Donner's method of variance estimates recovery
    (Statistics in Medicine 27, 2008).
    """
    m = proportion(missed, noted)
    f = Estimate(
        false / noted,
        float(gammaincinv(false, _TAIL)) / noted if false > 0 else 0.0,
        float(gammaincinv(false + 1, 1 - _TAIL)) / noted,
    )
    value = f.value - m.value
    low = value - np.hypot(f.value - f.low, m.high - m.value)
    high = value + np.hypot(f.high - f.value, m.value - m.low)
    return Estimate(value, float(low), float(high))


def geh(per_hour: float, bias: Estimate) -> Estimate:
    """sqrt(2 (c - n)^2 / (c + n)) of the hourly flows n, noted, and c = n (1 + bias), counted."""

    def at(share: float) -> float:
        return float(abs(share) * np.sqrt(2 * per_hour / (2 + share)))

    ends = at(max(bias.low, -1.0)), at(bias.high)
    return Estimate(at(bias.value), 0.0 if bias.low <= 0 <= bias.high else min(ends), max(ends))


def noted_for(missed: float, false: float) -> int:
    """How many crossings must be noted until the bias is known to WANTED_BIAS, with such shares of errors."""

    def too_wide(noted: int) -> bool:
        bias = net_bias(noted, missed * noted, false * noted)
        return max(bias.high - bias.value, bias.value - bias.low) > WANTED_BIAS

    enough = 1
    while too_wide(enough):
        enough *= 2
    short = enough // 2
    while enough - short > 1:
        middle = (enough + short) // 2
        short, enough = (middle, enough) if too_wide(middle) else (short, middle)
    return enough


def _check_overlap(counted: Events, noted: Events, begin: float, end: float, tolerance_s: float) -> None:
    if begin >= end:
        raise ConfigError(f"the count by hand ends at {written(end, noted.clock)}, before it begins; check both")
    for what, times in (("counted", counted.time), ("noted by hand", noted.time)):
        if not ((times >= begin - tolerance_s) & (times <= end + tolerance_s)).any():
            raise ConfigError(
                f"no overlap in time: what was {what} lies between {_span(times, noted.clock)}, the count by hand "
                f"between {_span((begin, end), noted.clock)}; check the clock and the zone"
            )


def _check_zone(counted: Events, noted: Events, hit: int, tolerance_s: float) -> None:
    """Raise ConfigError where most of what was noted is found in one other zone, and twice as much as in any, or as
    `hit`: at a busy gate much is found in every zone, by chance.
    """
    found = np.zeros(len(_ZONES_S), int)
    for gate, direction in dict.fromkeys(zip(noted.gate.tolist(), noted.direction.tolist(), strict=True)):
        there, here = ((one.gate == gate) & (one.direction == direction) for one in (noted, counted))
        certain = np.ones(int(there.sum()), bool)
        for k, shift in enumerate(_ZONES_S):
            found[k] += (match(counted.time[here], noted.time[there] + shift, certain, tolerance_s) >= 0).sum()
    best = int(found.argmax())
    by_chance = max(hit, int(np.delete(found, best).max()))
    if found[best] >= _FEWEST and found[best] > max(2 * by_chance, len(noted) / 2):
        raise ConfigError(
            f"the count by hand is {abs(_ZONES_S[best]) / 3600:g} h {'early' if _ZONES_S[best] > 0 else 'late'}: "
            f"{found[best]} of its {len(noted)} crossings are found then, and {hit} as it is; check its zone"
        )


def _span(times: Sequence[float] | Floats, clock: str) -> str:
    return f"{written(min(times), clock)} and {written(max(times), clock)}"
