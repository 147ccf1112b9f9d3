"""On which leg's approach vehicles stand: before the gate that they enter by, or no farther than their length behind it.

Who stands when the watching ends has perhaps not entered yet. It is on the approach of the entry that lies straight
ahead of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.traffic.measures.gates import Gates
from vidtrack.traffic.measures.joins import step_rows
from vidtrack.traffic.measures.passing import BESIDE_M, REACH_M, Passed, Passing
from vidtrack.traffic.measures.staying import Stays
from vidtrack.traffic.measures.stretches import Lives
from vidtrack.traffic.measures.trips import Trips, at_edge

_AHEAD_M = 60.0
"""m; farthest that an entry is looked for: a row of eight cars"""
_DRIVEN_M = 2.0
"""m; least way from which it is known where a vehicle was heading"""
_USUAL_M = 4.5
"""m; length of vehicles whose length is not known"""


def approaches(
    standing: Stays, gates: Gates, passed: Passed, trips: Trips, lives: Lives, vehicle: Ints, length: Floats,
    spans: Floats,
) -> Ints:  # fmt: skip
    """(E,) the entry gate on whose approach each vehicle stands; -1: on none.

    vehicle, length   (T,) of each stretch of `lives`: the first stretch of its vehicle, and m
    spans             (S, 2) s; what was watched
    """
    entered = trips.entry >= 0
    gate, entered_s = np.full(len(vehicle), -1), np.full(len(vehicle), -np.inf)
    gate[trips.vehicle] = np.where(entered, passed.gate[trips.entry], -1)
    entered_s[trips.vehicle] = np.where(entered, passed.t[trips.entry], -np.inf)
    who = standing.vehicle
    far = gates.far(gate[who], standing.xy)
    before = (standing.begin < entered_s[who]) | (far < np.nan_to_num(length[who], nan=_USUAL_M))
    waits = ~np.isin(who, trips.vehicle)
    return np.where(waits, _ahead(gates, lives, vehicle)[who], np.where(before, gate[who], -1))


def _ahead(gates: Gates, lives: Lives, vehicle: Ints) -> Ints:
    """(T,) the first entry straight ahead of where a vehicle was seen last; -1: there is none."""
    seen = np.flatnonzero(np.isfinite(lives.tail.t))
    last = np.arange(len(vehicle))
    last[vehicle[seen[np.argsort(lives.tail.t[seen])]]] = seen[np.argsort(lives.tail.t[seen])]
    tail = lives.tail.only(last[vehicle])
    way = tail.xy - lives.head.xy[vehicle]
    driven = np.linalg.norm(way, axis=1)
    with np.errstate(invalid="ignore"):
        who = np.flatnonzero(driven > _DRIVEN_M)
    tail = tail.only(who)
    far = replace(tail, t=tail.t + 1, xy=tail.xy + _AHEAD_M * way[who] / driven[who, None])
    passing = Passing(gates, REACH_M, BESIDE_M)
    passing.add(step_rows(tail, far))
    found = passing.passed()
    enters = gates.role("entry", "both")[found.gate] & (gates.inward[found.gate] == found.side)
    gate = np.full(len(vehicle), -1)
    gate[who[found.track[enters][::-1]]] = found.gate[enters][::-1]
    return gate
