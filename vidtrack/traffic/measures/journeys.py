"""Who drove where: the gates that vehicles passed, also where their tracks are broken, and their trips."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.traffic.measures.beyond import INFERRED_SURE, at_gates, beyond
from vidtrack.traffic.measures.crossings import COASTED, INFERRED, JOINED, MERGED, SEEN, confidence, reasons
from vidtrack.traffic.measures.gates import Gates
from vidtrack.traffic.measures.joins import OVERLAP_S, Joins, gap_rows, joined
from vidtrack.traffic.measures.passing import Passed, Passing, lasting, reaches
from vidtrack.traffic.measures.stretches import Lives
from vidtrack.traffic.measures.trips import Trips, at_edge, first_of, trips_of

_SEEN_SURE, _MERGED_SURE, _AGAINST_SURE = 0.99, 0.8, 0.04
"""Share of the passings that are some vehicle's own among those that a track is seen to make, those in a shared blob,
and those out over an entry or in over an exit (0 of 23 by Laplace's rule), as `tools/ablate_measures.py` has them.
Those that the picture does not show are taken for no surer than those in a blob."""


@dataclass(frozen=True, slots=True, eq=False)
class Passings:
    """P passings and how sure they are.

    passed        (P,) the passings
    probability   (P,) that the vehicle passed
    reason        (P,) what this rests on, of REASONS
    """

    passed: Passed
    probability: Floats
    reason: Ints

    def only(self, chosen: Mask | Ints) -> Passings:
        """The passings of a mask or of indices."""
        return Passings(self.passed.only(chosen), self.probability[chosen], self.reason[chosen])

    def and_also(self, other: Passings) -> Passings:
        """Both, these first."""
        return Passings(
            self.passed.and_also(other.passed),
            np.concatenate([self.probability, other.probability]),
            np.concatenate([self.reason, other.reason]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Journeys:
    """Who drove where.

    passings  all, in order of time, those within gaps too
    joins     which stretches go on as others
    vehicle   (T,) number of the first stretch of the vehicle that each stretch is of
    trips     of the vehicles
    """

    passings: Passings
    joins: Joins
    vehicle: Ints
    trips: Trips


def journeys(
    gates: Gates, passed: Passed, lives: Lives, spans: Floats, metres: bool, allowed: Sequence[tuple[str, str]]
) -> Journeys:
    """The journeys of T stretches of tracks.

    passed   passings of stretches
    spans    (S, 2) s; what was watched
    metres   positions are on the road; else broken tracks are not joined
    allowed  pairs of legs; none: all but turning back
    """
    if not len(gates):
        return _nowhere(passed, len(lives.track))
    passed = passed.only(passed.t <= lives.until[passed.track])
    may = _may(gates, allowed)
    needed = ~passed.beside | _needed(gates, passed, may)
    spare, passed = passed.only(~needed), passed.only(needed)
    passed = passed.only(~_of_another(gates, passed, lives, may))
    passed = passed.only(lasting(lives.track[passed.track], passed.gate, passed.side, passed.t))
    joins = _joins(gates, passed, lives, spans, may) if metres else _NONE
    vehicle = joins.vehicles(len(lives.track))
    passed = passed.only(_once(gates, passed, vehicle))
    together = joins.likely(vehicle)[vehicle]
    across = _across(gates, lives, joins, passed)
    across, joint = across.of(joins.before[across.track]).nowhere(), joins.probability[across.track]
    joint = np.where(across.beside, together[across.track], joint)
    known = Passings(passed, confidence(passed), reasons(passed))
    known = known.and_also(_because(JOINED, across, joint))
    known = known.and_also(Passings(spare, together[spare.track] * confidence(spare), reasons(spare)))
    free = np.concatenate([np.zeros(len(passed), bool), across.beside, spare.beside])
    owned = replace(known.passed, track=vehicle[known.passed.track], beside=free)
    known = _inferred_beside(known.only(_of_vehicles(gates, owned, may)))
    if metres:
        known = known.and_also(_because(INFERRED, *beyond(gates, known.passed, lives, joins, spans)))
        known = known.and_also(_because(INFERRED, *at_gates(gates, known.passed, lives, joins, spans, may)))
    known = known.only(np.argsort(known.passed.t, kind="stable"))
    begin = np.full(len(vehicle), np.inf)
    end = -begin
    np.fmin.at(begin, vehicle, lives.head.t)
    np.fmax.at(end, vehicle, lives.tail.t)
    trips = _trips(gates, known.passed, vehicle[known.passed.track], begin, end, spans)
    return Journeys(_as_sure(gates, known), joins, vehicle, trips)


def _nowhere(passed: Passed, tracks: int) -> Journeys:
    """Without gates nobody is seen to come or go, so no track is joined to another; `passed` has no passings."""
    number, time = np.empty(0, int), np.empty(0)
    trips = Trips(number, number, number, time, time, number > 0, number > 0)
    return Journeys(Passings(passed, time, number), _NONE, np.arange(tracks), trips)


def _because(reason: int, passed: Passed, probability: Floats) -> Passings:
    """Passings that all rest on the same."""
    return Passings(passed, probability, np.full(len(passed), reason))


def _inferred_beside(known: Passings) -> Passings:
    """The same passings, those beside gates as what they are."""
    beside = known.passed.beside
    sure = np.where(beside, INFERRED_SURE, 1.0) * known.probability
    return Passings(known.passed, sure, np.where(beside, INFERRED, known.reason))


def wrong_way(gates: Gates, passed: Passed) -> Mask:
    """(P,) whether passings are out over an entry or in over an exit.

    None is where a gate's inner side is not known, or where more do so than not, by two at least: it was drawn wrongly.
    """
    gate, inwards = passed.gate, gates.inward[passed.gate] == passed.side
    against = np.where(inwards, gates.role("exit")[gate], gates.role("entry")[gate])
    drawn = gates.crosses & gates.sided & (np.bincount(gate, np.where(against, 1, -1), len(gates)) < 2)
    return np.asarray(against & drawn[gate])


def _as_sure(gates: Gates, known: Passings) -> Passings:
    """The same passings, as sure as those of their kind are."""
    unseen = (known.reason == MERGED) | (known.reason == COASTED)
    sure = np.select([known.reason == SEEN, unseen], [_SEEN_SURE, _MERGED_SURE], 1.0)
    sure *= np.where(wrong_way(gates, known.passed), _AGAINST_SURE, 1.0)
    return Passings(known.passed, sure * known.probability, known.reason)


_NONE = Joins(np.empty(0, int), np.empty(0, int), np.empty(0))


def _may(gates: Gates, allowed: Sequence[tuple[str, str]]) -> Mask:
    """(L + 1, L + 1) whether a trip may go from a leg to another; the last ones are not known, which may be any."""
    legs = sorted(set(gates.legs))
    may = np.ones((len(legs) + 1, len(legs) + 1), bool)
    may[:-1, :-1] = [[(one, other) in allowed if allowed else one != other for other in legs] for one in legs]
    return may


def _of_vehicles(gates: Gates, passed: Passed, may: Mask) -> Ints:
    """Indices of the passings of whole vehicles: of those that no track alone needs, `beside`, the needed ones."""
    beside = np.flatnonzero(passed.beside)
    free = passed.only(beside)
    beside = beside[lasting(free.track, free.gate, free.side, free.t)]
    kept = np.sort(np.append(np.flatnonzero(~passed.beside), beside))
    return kept[~passed.beside[kept] | _needed(gates, passed.only(kept), may)]


def _needed(gates: Gates, passed: Passed, may: Mask) -> Mask:
    """(P,) passings beside a gate without which a trip that may be would have no entry, or no exit: the first one that
    enters, and the last one that leaves."""
    drawn, beside = ~passed.beside, passed.beside.copy()
    k = np.flatnonzero(beside)
    beside[k] = gates.leg[gates.nearest(gates.place(passed.gate[k], passed.along[k]))[0]] == gates.leg[passed.gate[k]]
    leg, inwards = gates.leg[passed.gate], gates.inward[passed.gate] == passed.side
    enters, leaves = gates.ways(passed.gate, passed.side)
    entry, exit_ = _ends(passed, enters & drawn, leaves & drawn)
    t, leg_of = np.append(passed.t, np.nan), np.append(leg, -1)
    enters &= beside & inwards & (entry < 0) & (t[exit_] > passed.t) & may[leg, leg_of[exit_]]
    leaves &= beside & ~inwards & (exit_ < 0) & (t[entry] < passed.t) & may[leg_of[entry], leg]
    entry, exit_ = _ends(passed, enters, leaves)
    number = np.arange(len(passed))
    return np.asarray((number == entry) | (number == exit_))


def _of_another(gates: Gates, passed: Passed, lives: Lives, may: Mask) -> Mask:
    """(P,) entries and exits of trips that may not be, while the track was not yet, or no more, seen alone.

    In a shared blob another vehicle has passed there; where the track coasts, perhaps nobody.
    """
    entry, exit_ = _ends(passed, *gates.ways(passed.gate, passed.side))
    number, leg, t = np.arange(len(passed)), np.append(gates.leg[passed.gate], -1), np.append(passed.t, np.nan)
    early = (number == entry) & (passed.t < lives.head.t[passed.track])
    late = (number == exit_) & (passed.t > lives.tail.t[passed.track])
    return np.asarray((early | late) & (t[exit_] > t[entry]) & ~may[leg[entry], leg[exit_]])


def _ends(passed: Passed, enters: Mask, leaves: Mask) -> tuple[Ints, Ints]:
    """(P,) the first passing that enters, and the last one that leaves, of the track of each passing; -1: none."""
    tracks = int(passed.track.max(initial=-1)) + 1
    order = np.argsort(passed.t, kind="stable")
    first_in = first_of(passed.track, order[enters[order]], tracks)
    last_out = first_of(passed.track, order[leaves[order]][::-1], tracks)
    return first_in[passed.track], last_out[passed.track]


def _joins(gates: Gates, passed: Passed, lives: Lives, spans: Floats, may: Mask) -> Joins:
    """Joins of stretches that end after an entry or before an exit, and of those that begin so."""
    enters, leaves = gates.ways(passed.gate, passed.side)
    event = np.flatnonzero(enters | leaves)
    event = event[np.argsort(passed.t[event], kind="stable")]
    first, last = np.full((2, len(lives.track)), -1)
    first[passed.track[event[::-1]]], last[passed.track[event]] = event[::-1], event
    ends = ~np.append(leaves, False)[last] & np.isfinite(lives.tail.t) & ~at_edge(lives.tail.t, spans[:, 1])
    begins = ~np.append(enters, False)[first] & np.isfinite(lives.head.t) & ~at_edge(lives.head.t, spans[:, 0])
    leg = np.append(gates.leg[passed.gate], -1)

    def possible(a: Ints, b: Ints) -> Mask:
        return np.asarray(may[leg[last[a]], leg[first[b]]])

    return joined(lives, ends, begins, last >= 0, float(np.diff(spans).sum()), possible)


def _once(gates: Gates, passed: Passed, vehicle: Ints) -> Mask:
    """(P,) whether a vehicle passes there and that way for the first time within OVERLAP_S: while two of its stretches
    overlap, each may show the same passing."""
    way = (vehicle[passed.track] * len(gates) + passed.gate) * 2 + passed.side
    order = np.lexsort((passed.t, way))
    once = np.ones(len(passed), bool)
    once[order[1:]] = (np.diff(way[order]) != 0) | (np.diff(passed.t[order]) > OVERLAP_S)
    return once


def _across(gates: Gates, lives: Lives, joins: Joins, passed: Passed) -> Passed:
    """Gates that vehicles passed only while their track was broken; `track` is the number of the join."""
    passing = Passing(gates, *reaches(metres=True))
    passing.add(gap_rows(lives, joins))
    found = passing.passed()
    found = found.only(lives.head.t[joins.after[found.track]] > lives.tail.t[joins.before[found.track]])  # a gap
    vehicle = joins.vehicles(len(lives.track))

    def ways(passed: Passed, stretch: Ints) -> Ints:
        return (vehicle[stretch] * len(gates) + passed.gate) * 2 + passed.side

    return found.only(~np.isin(ways(found, joins.before[found.track]), ways(passed, passed.track)))


def _trips(gates: Gates, passed: Passed, vehicle: Ints, begin: Floats, end: Floats, spans: Floats) -> Trips:
    """The trips of vehicles; those of one that comes in again where it has left are of another vehicle.

    A track that leaves the picture may go on as a vehicle that comes in there.
    """
    again = _comes_again(gates, passed, vehicle)
    order = np.lexsort((passed.t, vehicle))
    nth = np.cumsum(again[order])
    number = np.empty(len(vehicle), np.int64)
    number[order] = np.where(
        nth > nth[np.searchsorted(vehicle[order], vehicle[order])], len(begin) - 1 + nth, vehicle[order]
    )
    later = order[again[order]]
    before = order[np.flatnonzero(again[order]) - 1]
    owner = np.concatenate([np.arange(len(begin)), vehicle[later]])
    end = np.concatenate([end, end[vehicle[later]]])
    end[number[before]] = passed.t[before]
    trips = trips_of(passed, gates, number, np.concatenate([begin, passed.t[later]]), end, spans)
    return replace(trips, vehicle=owner[trips.vehicle])


def _comes_again(gates: Gates, passed: Passed, vehicle: Ints) -> Mask:
    """(P,) whether a vehicle passes an entry of the leg whose exit it passed last, another gate."""
    legs = gates.leg
    role = np.flatnonzero(gates.role("entry", "exit")[passed.gate])
    order = role[np.lexsort((passed.t[role], vehicle[role]))]
    gate, who = passed.gate[order], vehicle[order]
    again = np.zeros(len(vehicle), bool)
    if len(order) > 1:
        same = (who[1:] == who[:-1]) & (legs[gate[1:]] == legs[gate[:-1]]) & (gate[1:] != gate[:-1])
        again[order[1:]] = same & gates.role("exit")[gate[:-1]] & gates.role("entry")[gate[1:]]
    return again
