"""The table `checks`: what cannot be true, whatever the truth is."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.traffic.measures.gates import Gates
from vidtrack.traffic.measures.passing import Passed
from vidtrack.traffic.measures.trips import Trips


@dataclass(frozen=True, slots=True, eq=False)
class Balance:
    """Vehicles in I intervals, (I,): those that entered, left, appeared between the gates and vanished there."""

    inflow: Floats
    outflow: Floats
    appeared: Floats
    vanished: Floats

    @property
    def stored(self) -> Floats:
        """(I,) by how many more vehicles were seen in the site at the end than at the beginning."""
        return self.inflow - self.outflow - self.left_over

    @property
    def left_over(self) -> Floats:
        """(I,) inflow - outflow - stored; 0 where no vehicle was lost or made."""
        return self.vanished - self.appeared


def balance(trips: Trips, edges: Floats, watched: Floats) -> Balance:
    """The balance of each interval; NaN where nobody watched (`watched`, (I,), is the coverage)."""
    times = (
        trips.from_s[trips.entry >= 0],
        trips.to_s[trips.exit >= 0],
        trips.from_s[trips.appeared],
        trips.to_s[trips.vanished],
    )
    counts = (np.histogram(t, edges)[0].astype(float) for t in times)
    return Balance(*(np.where(watched > 0, count, np.nan) for count in counts))


def movements(trips: Trips, passed: Passed, gates: Gates) -> Counter[tuple[str, str]]:
    """Complete trips by the legs from which and to which they went."""
    whole = np.flatnonzero(trips.complete)
    pairs = zip(passed.gate[trips.entry[whole]].tolist(), passed.gate[trips.exit[whole]].tolist(), strict=True)
    return Counter((gates.legs[one], gates.legs[other]) for one, other in pairs)
