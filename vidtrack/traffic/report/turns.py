"""Left, through, right: how a movement turns, from the gates where vehicles enter and leave."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.measures.gates import Gates, gates_of
from vidtrack.traffic.site import Site

LEFT, THROUGH, RIGHT, U_TURN = TURNS = ("left", "through", "right", "U-turn")
THROUGH_RAD = np.pi / 4
"""Largest change of direction that is still through"""


@dataclass(frozen=True, slots=True)
class Drawn:
    """The gates where vehicles are: on the road in metres, or in the picture with y upwards.

    middle   (G, 2)
    inwards  (G, 2) unit vectors square to the gates, towards the middle of the site; 0 for a gate in that middle
    """

    gates: Gates
    middle: Floats
    inwards: Floats


def drawn(site: Site) -> Drawn:
    """Raises ConfigError for a site with neither gates nor zones."""
    ground = None if site.calibration is None else calibrated(site)
    gates = gates_of(site, ground)
    first, last = gates.segment[gates.first[:-1], :2], gates.segment[gates.first[1:] - 1, 2:]
    if ground is None:
        first, last = first * (1, -1), last * (1, -1)
    middle = (first + last) / 2
    counted = gates.role("entry", "exit", "both")
    centre = middle[counted if counted.any() else slice(None)].mean(axis=0) if len(gates) else np.zeros(2)
    along = last - first
    normal = np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1, keepdims=True)
    return Drawn(gates, middle, normal * np.sign(np.sum(normal * (centre - middle), axis=1, keepdims=True)))


def turns(where: Drawn) -> dict[tuple[str, str], str]:
    """The turn from each leg to each leg; pairs whose directions of travel are not known are left out.

    Vehicles enter square to the entry gates of a leg, towards the middle of all gates, and leave square to its exit
    gates, away from it. A change of direction of at most 45 degrees is through; more is left or right. Back to the
    leg that one came from is a U-turn, whatever the angle.
    """
    into, out = headings(where, "entry", 1.0), headings(where, "exit", -1.0)
    found = {}
    for start, a in into.items():
        for end, b in out.items():
            angle = np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b)
            side = THROUGH if abs(angle) <= THROUGH_RAD else LEFT if angle > 0 else RIGHT
            found[start, end] = U_TURN if start == end else side
    return found


def headings(where: Drawn, role: str, sign: float) -> dict[str, Floats]:
    """Direction of travel over the gates of this role, by leg, as a vector; sign: 1 inwards, -1 outwards."""
    total: dict[str, Floats] = {}
    for gate in np.flatnonzero(where.gates.role(role, "both")).tolist():
        leg = where.gates.legs[gate]
        total[leg] = total.get(leg, np.zeros(2)) + sign * where.inwards[gate]
    return {leg: heading for leg, heading in total.items() if np.hypot(*heading) > 1e-9}
