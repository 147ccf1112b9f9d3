"""On which leg's approach vehicles stand: before the gate that they enter by, or no farther than their length behind it.

Who is not seen to enter or to leave, since the watching ends before or its track does, is on the approach of an entry
if this is the gate that is nearest, and it stands outside.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.traffic.measures.gates import Gates
from vidtrack.traffic.measures.passing import Passed
from vidtrack.traffic.measures.staying import Stays
from vidtrack.traffic.measures.stretches import Lives
from vidtrack.traffic.measures.trips import Trips

_REACH_M = 60.0
"""m; farthest that an entry may be from who was not seen to enter: a row of eight cars"""
_USUAL_M = 4.5
"""m; length of vehicles whose length is not known"""


def approaches(standing: Stays, gates: Gates, passed: Passed, trips: Trips, lives: Lives, length: Floats) -> Ints:
    """(E,) the entry gate on whose approach each vehicle stands; -1: on none.

    length  (T,) m; of each stretch of `lives`
    """
    who, entered = standing.vehicle, trips.entry >= 0
    gate, entered_s = np.full(len(length), -1), np.full(len(length), -np.inf)
    gate[trips.vehicle[entered]] = passed.gate[trips.entry[entered]]
    entered_s[trips.vehicle[entered]] = passed.t[trips.entry[entered]]
    xy = np.where(np.isfinite(standing.xy), standing.xy, lives.head.xy[who])
    behind = gates.far(gate[who], xy) < np.nan_to_num(length[who], nan=_USUAL_M)
    nearest, _, far = gates.nearest(xy)
    waits = gates.role("entry", "both")[nearest] & (far < _REACH_M) & ~gates.within(nearest, xy)
    return np.where(
        np.isin(who, trips.vehicle),
        np.where((standing.begin < entered_s[who]) | behind, gate[who], -1),
        np.where(waits, nearest, -1),
    )
