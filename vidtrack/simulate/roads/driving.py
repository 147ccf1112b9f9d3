"""How a driver accelerates and when he changes lanes.

Treiber, Hennecke, Helbing: Congested traffic states in empirical observations and microscopic simulations, Physical
Review E 62 (2000). Kesting, Treiber, Helbing: General lane-changing model MOBIL for car-following models,
Transportation Research Record 1999 (2007).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats

STRONGEST_BRAKING = 8.0  # m/s^2; of tyres on a dry road
POLITENESS = 0.2
CHANGE_GAIN = 0.15  # m/s^2; a change must be worth more than this
KEEP_RIGHT = 0.25  # m/s^2; what the right lane is worth by itself
SAFE_BRAKING = 2.0  # m/s^2; nobody may be made to brake more by a change


@dataclass(frozen=True, slots=True, eq=False)
class Drivers:
    """Parameters of the intelligent driver model, arrays (N,) or numbers.

    a   m/s^2; acceleration on a free road
    b   m/s^2; comfortable braking
    T   s; time gap
    s0  m; gap when standing
    """

    a: Floats
    b: Floats
    T: Floats
    s0: Floats


def idm(v: Floats, v0: Floats, gap: Floats, closing: Floats, driver: Drivers) -> Floats:
    """Acceleration [m/s^2] at speed v, wish v0, with a gap [m] to a leader approached at `closing` [m/s].

    An infinite gap is a free road. Above the wished speed a driver brakes comfortably at most.
    """
    free = np.maximum(1 - (v / np.maximum(v0, 0.1)) ** 4, -driver.b / driver.a)
    wished_gap = driver.s0 + np.maximum(v * driver.T + v * closing / (2 * np.sqrt(driver.a * driver.b)), 0)
    return np.maximum(driver.a * (free - (wished_gap / np.maximum(gap, 0.05)) ** 2), -STRONGEST_BRAKING)


def equilibrium_gap(v: Floats, v0: Floats, driver: Drivers) -> Floats:
    """The gap [m] that a driver keeps behind a leader of the same constant speed."""
    return np.asarray((driver.s0 + v * driver.T) / np.sqrt(1 - (v / v0) ** 4))


def worth_changing(
    own: tuple[float, float], new_follower: tuple[float, float], old_follower: tuple[float, float], to_right: bool
) -> bool:
    """MOBIL: whether a change is safe and pays; each pair is an acceleration [m/s^2] before and after the change."""
    if new_follower[1] < -SAFE_BRAKING or own[1] < -SAFE_BRAKING:
        return False
    others = (new_follower[1] - new_follower[0]) + (old_follower[1] - old_follower[0])
    gain = own[1] - own[0] + POLITENESS * others + (KEEP_RIGHT if to_right else -KEEP_RIGHT)
    return gain > CHANGE_GAIN
