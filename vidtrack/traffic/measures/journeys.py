"""Who drove where: the gates that vehicles passed, also where their tracks are broken, and their trips."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.traffic.measures.crossings import confidence, reasons
from vidtrack.traffic.measures.gates import Gates
from vidtrack.traffic.measures.joins import Joins, gap_rows, joined
from vidtrack.traffic.measures.lives import End
from vidtrack.traffic.measures.passing import REACH_M, Passed, Passing
from vidtrack.traffic.measures.trips import Trips, at_edge, trips_of


@dataclass(frozen=True, slots=True, eq=False)
class Journeys:
    """All passings, in order of time.

    passed        P passings, those within gaps too
    probability   (P,) that the vehicle passed; reason (P,) what this rests on
    joins         which tracks go on as others
    vehicle       (T,) number of the first track of the vehicle that each track is of
    trips         of the vehicles
    """

    passed: Passed
    probability: Floats
    reason: list[str]
    joins: Joins
    vehicle: Ints
    trips: Trips


def journeys(
    gates: Gates, passed: Passed, head: End, tail: End, length: Floats, spans: Floats, metres: bool
) -> Journeys:
    """The journeys of T tracks.

    passed       passings of tracks
    head, tail   where tracks began and ended
    length       (T,) m
    spans        (S, 2) s; what was watched
    metres       positions are on the road; else broken tracks are not joined
    """
    joins = _joins(gates, passed, head, tail, length, spans) if metres else _NONE
    vehicle = joins.vehicles(len(head.t))
    across = _across(gates, head, tail, joins)
    probability = np.concatenate([confidence(passed), joins.probability[across.track]])
    reason = [*reasons(passed), *(["joined"] * len(across))]
    passed = passed.and_also(across.of(joins.before[across.track]))
    order = np.argsort(passed.t, kind="stable")
    passed, probability, reason = passed.only(order), probability[order], [reason[k] for k in order.tolist()]
    begin = np.full(len(vehicle), np.inf)
    end = -begin
    np.fmin.at(begin, vehicle, head.t)
    np.fmax.at(end, vehicle, tail.t)
    trips = trips_of(passed, gates, vehicle[passed.track], begin, end, spans)
    return Journeys(passed, probability, reason, joins, vehicle, trips)


_NONE = Joins(np.empty(0, int), np.empty(0, int), np.empty(0))


def _joins(gates: Gates, passed: Passed, head: End, tail: End, length: Floats, spans: Floats) -> Joins:
    """Joins of tracks that end before an exit, and of those that begin after an entry."""
    left, entered = np.zeros((2, len(head.t)), bool)
    left[passed.track[gates.role("exit", "both")[passed.gate]]] = True
    entered[passed.track[gates.role("entry", "both")[passed.gate]]] = True
    ends = ~left & np.isfinite(tail.t) & ~at_edge(tail.t, spans[:, 1])
    begins = ~entered & np.isfinite(head.t) & ~at_edge(head.t, spans[:, 0])
    return joined(tail, head, length, ends, begins, float(np.diff(spans).sum()))


def _across(gates: Gates, head: End, tail: End, joins: Joins) -> Passed:
    """Gates that vehicles passed while their track was broken; `track` is the number of the join."""
    passing = Passing(gates, REACH_M)
    passing.add(gap_rows(tail, head, joins))
    return passing.passed()
