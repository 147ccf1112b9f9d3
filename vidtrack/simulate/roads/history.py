"""Where every vehicle is at any time: constant acceleration between the steps of the simulation, in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.simulate.roads.network import Network

CHANGE_S = 4.0  # for a change of lanes


@dataclass(frozen=True, slots=True, eq=False)
class States:
    """The vehicles (N,) on the road at one time.

    vehicle  index in the fleet
    route    index in the network
    s        m; of the footprint's centre along the route
    xy       (N, 2) m; centre of the footprint
    speed    m/s; of that centre
    heading  rad; of the body, from east to north
    """

    vehicle: Ints
    route: Ints
    s: Floats
    xy: Floats
    speed: Floats
    heading: Floats


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """A simulated traffic, one row a step and vehicle, in order of steps.

    step_s, begin_s  times of the steps are begin_s + k step_s
    first    (K + 1,) row at which each step begins
    vehicle, route, s, v, a  (rows,) index in the fleet and in the network; m, m/s, m/s^2 along the route
    changed_s, aside  (rows,) time of the last change of lanes, and how far to the left the old lane was, m
    """

    network: Network
    step_s: float
    begin_s: float
    first: Ints
    vehicle: Ints
    route: Ints
    s: Floats
    v: Floats
    a: Floats
    changed_s: Floats
    aside: Floats

    def at(self, time: float) -> States:
        """The vehicles at a time [s] from begin_s to the last step's end."""
        k = min(int((time - self.begin_s) / self.step_s + 1e-9), len(self.first) - 2)
        rows = slice(self.first[k], self.first[k + 1])
        since = time - self.begin_s - k * self.step_s
        s, v = moved(self.s[rows], self.v[rows], self.a[rows], since)
        xy, heading = self.network.pose(self.route[rows], s)
        offset, drift = swerve(self.aside[rows], time - self.changed_s[rows])
        xy = xy + offset[:, None] * np.column_stack([-np.sin(heading), np.cos(heading)])
        turned = np.where(drift == 0, 0, np.arctan2(drift, v))
        return States(self.vehicle[rows], self.route[rows], s, xy, np.hypot(v, drift), heading + turned)


def moved(s: Floats, v: Floats, a: Floats, since: float) -> tuple[Floats, Floats]:
    """Place and speed after `since` seconds of constant acceleration."""
    return s + v * since + a * since**2 / 2, v + a * since


def swerve(aside: Floats, since: Floats) -> tuple[Floats, Floats]:
    """Offset from the new lane [m] and its rate [m/s], `since` s after a change began: the path of least jerk."""
    share = np.clip(since / CHANGE_S, 0, 1)
    done = share**3 * (10 - 15 * share + 6 * share**2)
    rate = 30 * share**2 * (1 - share) ** 2 / CHANGE_S
    return aside * (1 - done), -aside * rate
