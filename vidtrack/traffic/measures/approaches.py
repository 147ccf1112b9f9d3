"""On their way from which leg vehicles stand: by the gate that they enter by, until they leave.

Who is not seen to enter or to leave, since the watching ends before or its track does, is on the approach of an entry
if it has come nearer to it, of all entries and exits this is the nearest, and it stands outside. Who stood there from
the beginning may be parked.
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
_NEARER_M = 5.0
"""m; by which it has come nearer: a car's length"""


def approaches(standing: Stays, gates: Gates, passed: Passed, trips: Trips, lives: Lives) -> Ints:
    """(E,) the entry gate by which each vehicle that stands comes, or will come; -1: by none, or it has left."""
    who, entered = standing.vehicle, trips.entry >= 0
    gate, left_s = np.full(len(lives.track), -1), np.full(len(lives.track), -np.inf)
    gate[trips.vehicle[entered]] = passed.gate[trips.entry[entered]]
    left_s[trips.vehicle] = trips.to_s
    xy = np.where(np.isfinite(standing.xy), standing.xy, lives.head.xy[who])
    nearest, _, far = gates.nearest(xy, among=gates.role("entry", "exit", "both"))
    came = gates.far(nearest, lives.head.xy[who]) - far > _NEARER_M
    waits = gates.role("entry", "both")[nearest] & came & (far < _REACH_M) & gates.outside(nearest, xy)
    return np.where(
        np.isin(who, trips.vehicle),
        np.where(standing.begin < left_s[who], gate[who], -1),
        np.where(waits, nearest, -1),
    )
