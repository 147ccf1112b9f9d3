"""How fast vehicles were from their entry to their exit: the way that they drove over the time that it took."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.traffic.measures.gates import Gates
from vidtrack.traffic.measures.passing import Passed
from vidtrack.traffic.measures.stretches import Lives
from vidtrack.traffic.measures.trips import Trips


@dataclass(frozen=True, slots=True, eq=False)
class TripSpeeds:
    """(V,) m/s; NaN for trips that are not complete. Standard deviations by the places of entry and exit, and by the
    calibration."""

    speed: Floats
    own: Floats
    shared: Floats


def trip_speeds(trips: Trips, passed: Passed, gates: Gates, lives: Lives, vehicle: Ints, ways: Floats) -> TripSpeeds:
    """Mean speeds of trips.

    vehicle  (T,) number of the first stretch of the vehicle that each stretch is of
    ways     (T,) m; that stretches drove in all
    """
    since = _driven(passed, gates, lives, ways) + _begins(lives, vehicle, ways)[passed.track]
    whole = np.flatnonzero(trips.complete)
    entry, exit_ = trips.entry[whole], trips.exit[whole]
    seconds = passed.t[exit_] - passed.t[entry]
    speed, own, shared = np.full((3, len(trips.vehicle)), np.nan)
    speed[whole] = (since[exit_] - since[entry]) / seconds
    own[whole] = np.hypot(passed.sigma[entry], passed.sigma[exit_]) / seconds
    share = np.stack([passed.speed_shared[at] / passed.speed[at] for at in (entry, exit_)])
    known = np.isfinite(share)
    with np.errstate(invalid="ignore"):
        shared[whole] = speed[whole] * np.where(known, share, 0).sum(axis=0) / known.sum(axis=0)
    return TripSpeeds(speed, own, shared)


def _driven(passed: Passed, gates: Gates, lives: Lives, ways: Floats) -> Floats:
    """(P,) m that a stretch had driven when it passed; straight on before it began and after it ended."""
    place, who = gates.place(passed.gate, passed.along), passed.track
    early, late = passed.t < lives.head.t[who], passed.t > lives.tail.t[who]
    before = np.linalg.norm(place - lives.head.xy[who], axis=1)
    after = np.linalg.norm(place - lives.tail.xy[who], axis=1)
    return np.where(early, -before, np.where(late & np.isnan(passed.way), ways[who] + after, passed.way))


def _begins(lives: Lives, vehicle: Ints, ways: Floats) -> Floats:
    """(T,) m that the vehicle of each stretch had driven when it began: those before it, and the gaps, straight on."""
    order = np.lexsort((lives.head.t, vehicle))
    gap = np.linalg.norm(lives.head.xy[order[1:]] - lives.tail.xy[order[:-1]], axis=1)
    total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(ways[order[:-1]] + gap))])[: len(order)]
    first = np.searchsorted(vehicle[order], vehicle[order])
    begins = np.empty(len(order))
    begins[order] = total - total[first]
    return begins
