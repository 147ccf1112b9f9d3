"""Gates that vehicles must have passed just before their track began, or just after it ended.

A track begins when its vehicle has been seen for a while, and where another one hides it only afterwards. One that
begins a little beyond a gate and drives away from it has come through. Such passings are inferred, and say so.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.traffic.measures.crossings import confidence
from vidtrack.traffic.measures.gates import Gates
from vidtrack.traffic.measures.joins import Joins, step_rows
from vidtrack.traffic.measures.passing import REACH_M, Passed, Passing
from vidtrack.traffic.measures.stretches import End, Lives
from vidtrack.traffic.measures.trips import at_edge, first_of

REACH_S = 1.5
"""s; longest time between the passing and the track"""
_LEAST_M_S, _SURE = 1.5, 3.0
"""m/s; of the vehicle, and standard deviations of its velocity in it"""
_LIKELY = 0.5
_ELSEWHERE_S = 4.0
"""s; the mean time in which a vehicle has come from elsewhere, such as out of another one's blob"""
_AT_M = 3.0
"""m; from a gate, where a vehicle that began or ended there has passed it"""
INFERRED_SURE = 0.8
"""That a vehicle passed a gate beside its path, or at the end of it, if it must have come or gone somewhere"""
_ALONE_S, _ALONE_M = 1.0, 1.75
"""s, m along the gate; another passing so near is that of the same vehicle."""


def at_gates(
    gates: Gates, passed: Passed, lives: Lives, joins: Joins, spans: Floats, may: Mask
) -> tuple[Passed, Floats]:
    """The entries of vehicles that began at one and left elsewhere, the exits where others ended; how likely (P,).

    passed  all that is known
    may     (L + 1, L + 1) whether a trip may go from a leg to another
    """
    vehicle = joins.vehicles(len(lives.track))
    enters, leaves = gates.ways(passed.gate, passed.side)
    order, who, tracks = np.argsort(passed.t, kind="stable"), vehicle[passed.track], len(vehicle)
    entry = first_of(who, order[enters[order]], tracks)
    exit_ = first_of(who, order[leaves[order]][::-1], tracks)
    leg = np.append(gates.leg[passed.gate], -1)
    begins, ends = np.ones((2, tracks), bool)
    begins[joins.after] = ends[joins.before] = False
    parts = []
    for end, edges, lacks, other, inwards in (
        (lives.head, spans[:, 0], begins & (entry[vehicle] < 0) & (exit_[vehicle] >= 0), leg[exit_[vehicle]], True),
        (lives.tail, spans[:, 1], ends & (exit_[vehicle] < 0) & (entry[vehicle] >= 0), leg[entry[vehicle]], False),
    ):
        track = np.flatnonzero(lacks & np.isfinite(end.t) & ~at_edge(end.t, edges))
        meant = gates.role("entry" if inwards else "exit", "both")
        gate, along, far = gates.nearest(end.xy[track], meant)
        legs = gates.leg[gate], other[track]
        near = (far < _AT_M) & may[legs if inwards else legs[::-1]]
        parts.append(_stood(gates, end, track[near], gate[near], along[near], far[near], inwards))
    found = parts[0].and_also(parts[1])
    found = found.only(_alone(found, passed))
    return found, np.full(len(found), INFERRED_SURE)


def _stood(gates: Gates, end: End, track: Ints, gate: Ints, along: Floats, far: Floats, inwards: bool) -> Passed:
    """Passings of gates by stretches where they began or ended, so far away."""
    inward = gates.inward[gate]
    no, unknown = np.zeros(len(track), bool), np.full(len(track), np.nan)
    sigma = np.sqrt(end.spread[track, 0])
    side = inward if inwards else 1 - inward
    speed = unknown, unknown, unknown
    return Passed(end.t[track], gate, track, side, along, sigma, far, far, no, no, *speed, unknown, no)


def beyond(gates: Gates, passed: Passed, lives: Lives, joins: Joins, spans: Floats) -> tuple[Passed, Floats]:
    """What stretches passed before they began and after they ended, and how likely (P,).

    passed  what they passed, also in gaps
    """
    before, after = np.ones((2, len(lives.track)), bool)
    before[joins.after] = after[joins.before] = False
    parts = [_extended(gates, end, free, spans, way) for end, free, way in
             ((lives.head, before, -1), (lives.tail, after, 1))]  # fmt: skip
    found = parts[0].and_also(parts[1])
    ends = np.where(found.t < lives.head.t[found.track], lives.head.t[found.track], lives.tail.t[found.track])
    sure = confidence(found) * np.exp(-np.abs(found.t - ends) / _ELSEWHERE_S)
    likely = (sure > _LIKELY) & _as_meant(gates, found)
    found, sure = found.only(likely), sure[likely]
    alone = _alone(found, passed)
    return found.only(alone), sure[alone]


def _extended(gates: Gates, end: End, free: Mask, spans: Floats, way: int) -> Passed:
    """The gates on the way of stretches for REACH_S before (way -1) or after (1) an end of theirs."""
    speed = np.linalg.norm(end.v, axis=1)
    with np.errstate(invalid="ignore"):
        moves = (speed > _LEAST_M_S) & (speed > _SURE * np.sqrt(end.spread[:, 2]))
    who = np.flatnonzero(free & moves)
    span = np.clip(np.searchsorted(spans[:, 0], end.t[who], side="right") - 1, 0, None)
    room = np.abs(spans[span, 0 if way < 0 else 1] - end.t[who])
    known = end.only(who)
    far = known.after(way * np.minimum(REACH_S, room))
    passing = Passing(gates, REACH_M)
    passing.add(step_rows(far, known) if way < 0 else step_rows(known, far))
    found = passing.passed()
    return found.of(who[found.track]).nowhere()


def _as_meant(gates: Gates, found: Passed) -> Mask:
    """(F,) whether passings are in over an entry or out over an exit: nobody is taken to drive against them unseen."""
    inwards = gates.inward[found.gate] == found.side
    entry, exit_, both = (gates.role(role)[found.gate] for role in ("entry", "exit", "both"))
    return np.asarray(both | (entry & inwards) | (exit_ & ~inwards))


def _alone(found: Passed, passed: Passed) -> Mask:
    """(F,) whether nobody else passed the same gate the same way just then; of two such only the first one."""
    both = passed.and_also(found)
    order = np.lexsort((both.t, both.side, both.gate))
    way = (2 * both.gate + both.side)[order]
    t, along, new = both.t[order], both.along[order], order >= len(passed)
    alone = np.ones(len(order), bool)
    for back in range(1, min(8, len(order))):
        near = (way[back:] == way[:-back]) & (t[back:] - t[:-back] < _ALONE_S)
        near &= np.abs(along[back:] - along[:-back]) < _ALONE_M
        alone[back:][near & new[back:]] = False
        alone[:-back][near & new[:-back] & ~new[back:]] = False
    result = np.empty(len(order), bool)
    result[order] = alone
    return result[len(passed) :]
