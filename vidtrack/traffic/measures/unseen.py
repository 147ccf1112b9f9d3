"""Passings that nobody saw: vehicles that appear or vanish between the gates have come in, or gone out, somewhere.

That holds for sites that vehicles enter and leave by gates only: where the movements are listed, or every leg with an
entry has an exit and the other way round. Of the gates by which a vehicle may have come or gone each is as likely.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Mask
from vidtrack.traffic.measures.gates import Gates
from vidtrack.traffic.measures.intervals import NOBODY, Unseen
from vidtrack.traffic.measures.passing import Passed
from vidtrack.traffic.measures.trips import Trips


def unseen(trips: Trips, passed: Passed, probability: Floats, gates: Gates, may: Mask, listed: bool) -> Unseen:
    """The entries of vehicles that appeared, and the exits of those that vanished.

    probability  (P,) of the passings
    may          (L + 1, L + 1) whether a trip may go from a leg to another
    listed       the site lists its movements
    """
    entries, exits = (np.flatnonzero(gates.role(role, "both")) for role in ("entry", "exit"))
    if not (listed or set(gates.leg[entries]) == set(gates.leg[exits])):
        return NOBODY
    parts = []
    for lacks, known, t, ways, to_known in (
        (trips.appeared, trips.exit, trips.from_s, 2 * entries + gates.inward[entries], may[gates.leg[entries]].T),
        (trips.vanished, trips.entry, trips.to_s, 2 * exits + 1 - gates.inward[exits], may[:, gates.leg[exits]]),
    ):
        who = np.flatnonzero(lacks)
        passing = known[who]
        possible = to_known[gates.leg[passed.gate[passing]]]
        vehicle, way = np.nonzero(possible)
        share = probability[passing] / np.maximum(possible.sum(axis=1), 1)
        parts.append((t[who][vehicle], ways[way], share[vehicle]))
    return Unseen(*(np.concatenate(column) for column in zip(*parts, strict=True)))
