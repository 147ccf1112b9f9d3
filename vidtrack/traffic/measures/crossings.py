"""The table `crossings`: who passed which gate, how fast, how far behind whom, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from vidtrack.arrays.types import Floats, Ints
from vidtrack.traffic.measures.gates import Gates
from vidtrack.traffic.measures.passing import Passed

REASONS = ("seen", "merged", "coasted", "joined", "inferred")
"""What the confidence of a passing rests on, by numbers"""
SEEN, MERGED, COASTED, JOINED, INFERRED = range(5)
LANE_M = 1.75
"""m along a gate; vehicles that pass it farther apart do not follow each other: half a lane"""
_LOOK_BACK = 12
"""Passings of a gate, the last ones, among which the vehicle ahead is looked for"""


@dataclass(frozen=True, slots=True, eq=False)
class Following:
    """Behind whom each of P passings comes; NaN where nobody was seen before it in the same lane.

    headway (P,) s, from middle to middle; gap (P,) s, from the rear of the one to the front of the other
    """

    headway: Floats
    gap: Floats


def following(passed: Passed, length: Floats, spans: Floats, metres: bool) -> Following:
    """Headways and gaps within each gate and direction.

    length  (P,) m; of the vehicles
    spans   (S, 2) s; headways over a pause of the watching are not known
    metres  places along a gate are in metres: only who passes within half a lane follows; else whoever is next
    """
    order = np.lexsort((passed.t, passed.side, passed.gate))
    t, along = passed.t[order], passed.along[order]
    way = (2 * passed.gate + passed.side)[order]
    span = np.searchsorted(spans[:, 0], t, side="right")
    ahead = np.full(len(t), -1)
    for back in range(1, min(_LOOK_BACK if metres else 1, len(t) - 1) + 1):
        fits = (way[back:] == way[:-back]) & (span[back:] == span[:-back]) & (ahead[back:] < 0)
        if metres:
            fits &= np.abs(along[back:] - along[:-back]) < LANE_M
        ahead[back:][fits] = np.flatnonzero(fits)
    headway = np.where(ahead < 0, np.nan, t - t[ahead])
    with np.errstate(divide="ignore", invalid="ignore"):
        half = (length / passed.speed)[order] / 2
    gap = headway - half - half[ahead]
    result = np.empty((2, len(t)))
    result[:, order] = headway, np.where(np.isfinite(gap), np.maximum(gap, 0), np.nan)
    return Following(*result)


def confidence(passed: Passed) -> Floats:
    """(P,) probability that the vehicle was on the one side before and on the other after, by its position's error."""
    sigma = np.maximum(passed.sigma, 1e-9)
    return np.asarray(ndtr(passed.before / sigma) * ndtr(passed.after / sigma))


def reasons(passed: Passed) -> Ints:
    """(P,) what each confidence rests on."""
    return np.where(~passed.shown, COASTED, np.where(passed.merged, MERGED, SEEN))


def way_names(gates: Gates, passed: Passed) -> tuple[list[str], list[str]]:
    """(P,) names of the gates and of the directions."""
    pairs = zip(passed.gate.tolist(), passed.side.tolist(), strict=True)
    ways = [(gates.names[gate], gates.directions[gate][side]) for gate, side in pairs]
    return [gate for gate, _ in ways], [direction for _, direction in ways]


def section_speeds(passed: Passed, sections: list[tuple[int, int, float]]) -> tuple[Floats, Floats, Floats]:
    """(P,) m/s where vehicles leave sections, without a calibration; standard deviations, own and shared (none).

    sections  (from gate, to gate, length m); of several that end at a gate, the first one that the vehicle drove
    """
    speed, own = np.full((2, len(passed)), np.nan)
    late = np.divide(passed.sigma, passed.speed, out=np.full(len(passed), np.nan), where=passed.speed > 0)
    for start, end, length in sections:
        begun, done = np.flatnonzero(passed.gate == start), np.flatnonzero(passed.gate == end)
        _, i, j = np.intersect1d(passed.track[begun], passed.track[done], return_indices=True)
        begun, done = begun[i], done[j]
        seconds = passed.t[done] - passed.t[begun]
        new = (seconds > 0) & np.isnan(speed[done])
        begun, done, seconds = begun[new], done[new], seconds[new]
        speed[done] = length / seconds
        own[done] = speed[done] * np.hypot(late[begun], late[done]) / seconds
    return speed, own, np.where(np.isnan(speed), np.nan, 0.0)
