"""On their way from which leg vehicles stand: by the gate that they enter by, until they leave.

Who is not seen to enter, since the watching ends before or its track does, or since it passes far beside the gate, is
on the approach of an entry if of all entries and exits this is the nearest, if it stands outside, has not driven away
from it, and does not stand for so long that it is parked.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Ints
from vidtrack.traffic.measures.gates import Gates
from vidtrack.traffic.measures.passing import Passed
from vidtrack.traffic.measures.staying import Stays
from vidtrack.traffic.measures.stretches import Lives
from vidtrack.traffic.measures.trips import Trips

_REACH_M = 60.0
"""m; farthest that an entry may be from who was not seen to enter: a row of eight cars"""
_AWAY_M = 5.0
"""m; by which who drives away from it is farther than at first: a car's length"""
_PARKED_S = 180.0
"""s; who stands for longer is parked: no red light lasts so long"""


def approaches(standing: Stays, gates: Gates, passed: Passed, trips: Trips, lives: Lives) -> Ints:
    """(E,) the entry gate by which each vehicle that stands comes, or will come; -1: by none, or it has left."""
    if not len(gates):
        return np.full(len(standing.vehicle), -1)
    who, entered = standing.vehicle, trips.entry >= 0
    gate, left_s = np.full(len(lives.track), -1), np.full(len(lives.track), np.inf)
    gate[trips.vehicle[entered]] = passed.gate[trips.entry[entered]]
    left_s[trips.vehicle] = trips.to_s
    nearest, _, far = gates.nearest(standing.first_xy, among=gates.role("entry", "exit", "both"))
    away = far - gates.far(nearest, lives.head.xy[who]) > _AWAY_M
    parked = standing.end - standing.begin > _PARKED_S
    outside = gates.role("entry", "both")[nearest] & gates.outside(nearest, standing.first_xy)
    waits = outside & (far < _REACH_M) & ~away & ~parked
    known = np.where(gate[who] >= 0, gate[who], np.where(waits, nearest, -1))
    return np.where(standing.begin < left_s[who], known, -1)
