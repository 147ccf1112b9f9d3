"""The table `trips`: where each vehicle entered the site and where it left, or why that is not known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.traffic.measures.gates import Gates
from vidtrack.traffic.measures.passing import Passed

_EDGE_S = 1.0
"""s; a track that began so soon after the watching did was there before"""


@dataclass(frozen=True, slots=True, eq=False)
class Trips:
    """V vehicles that passed an entry or an exit, in order of time.

    vehicle       (V,) number of its first track
    entry, exit   (V,) passings, -1: none
    from_s, to_s  (V,) s; when it was in the site: from the entry, else from its first row, to the exit or its last row
    appeared      (V,) it began between the gates, though somebody watched before
    vanished      (V,) it ended between the gates, though somebody watched afterwards
    """

    vehicle: Ints
    entry: Ints
    exit: Ints
    from_s: Floats
    to_s: Floats
    appeared: Mask
    vanished: Mask

    @property
    def complete(self) -> Mask:
        """(V,) whether entry and exit are known."""
        return (self.entry >= 0) & (self.exit >= 0)

    def reasons(self) -> list[str]:
        """(V,) why entry or exit are missing; "" for a complete trip."""
        began = np.where(self.appeared, "began between the gates", "was there when watching began")
        ended = np.where(self.vanished, "ended between the gates", "was there when watching ended")
        began[self.entry >= 0] = ended[self.exit >= 0] = ""
        return ["; ".join(filter(None, pair)) for pair in zip(began.tolist(), ended.tolist(), strict=True)]


def trips_of(passed: Passed, gates: Gates, vehicle: Ints, begin: Floats, end: Floats, spans: Floats) -> Trips:
    """The trip of each vehicle: from its first entry to the last exit after it, or as `against` has it.

    vehicle      (P,) of each passing
    begin, end   (T,) s; first and last row of vehicles by number
    spans        (S, 2) s; what was watched
    """
    enters, leaves = (gates.role(role, "both")[passed.gate] for role in ("entry", "exit"))
    entry = first_of(vehicle, np.flatnonzero(enters), len(begin))
    t = np.append(passed.t, np.nan)
    exit_ = first_of(vehicle, np.flatnonzero(leaves & ~(passed.t <= t[entry][vehicle]))[::-1], len(begin))
    entry, exit_ = against(passed, gates, vehicle, entry, exit_)
    entered = t[entry]  # NaN without an entry
    who = np.flatnonzero((entry >= 0) | (exit_ >= 0))
    from_s = np.where(entry[who] >= 0, entered[who], begin[who])
    to_s = np.where(exit_[who] >= 0, t[exit_[who]], end[who])
    order = np.argsort(from_s, kind="stable")
    who, from_s, to_s = who[order], from_s[order], to_s[order]
    appeared = (entry[who] < 0) & ~at_edge(begin[who], spans[:, 0])
    vanished = (exit_[who] < 0) & ~at_edge(end[who], spans[:, 1])
    return Trips(who, entry[who], exit_[who], from_s, to_s, appeared, vanished)


def against(passed: Passed, gates: Gates, vehicle: Ints, entry: Ints, exit_: Ints) -> tuple[Ints, Ints]:
    """Entry and exit (T,) of vehicles, over gates the wrong way where there is none the right way.

    Who is not known to enter, or to leave, by a gate for this may pass one of another leg the wrong way: in over an
    exit, or out over an entry, as a place that is a lane off has it.
    """
    leg, t = np.append(gates.leg[passed.gate], -1), np.append(passed.t, np.nan)
    inwards = gates.inward[passed.gate] == passed.side
    wrong_in = first_of(vehicle, np.flatnonzero(gates.role("exit")[passed.gate] & inwards), len(entry))
    left = (entry < 0) & (exit_ >= 0) & (t[wrong_in] < t[exit_]) & (leg[wrong_in] != leg[exit_])
    entry = np.where(left, wrong_in, entry)
    wrong_out = gates.role("entry")[passed.gate] & ~inwards & (passed.t > t[entry][vehicle])
    wrong_out &= leg[:-1] != leg[entry][vehicle]
    return entry, np.where(exit_ < 0, first_of(vehicle, np.flatnonzero(wrong_out)[::-1], len(entry)), exit_)


def at_edge(t: Floats, edges: Floats) -> Mask:
    """(N,) whether a time is within a second of one of the times when watching began or ended."""
    return np.asarray((np.abs(t[:, None] - edges) < _EDGE_S).any(axis=1))


def first_of(vehicle: Ints, passings: Ints, vehicles: int) -> Ints:
    """(V,) the first of these passings (indices, in order) of each vehicle, -1: none."""
    found = np.full(vehicles, -1)
    found[vehicle[passings[::-1]]] = passings[::-1]
    return found
