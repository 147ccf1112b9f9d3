"""What the sizes of the traffic say about a calibration's scale: vehicles are no larger at one place than at another.

If all lengths of a calibration are too large by a factor, then so are all vehicles. The likelihood of the factor is the
product over the vehicles of what their boxes say under all classes, each of whose mean sizes is larger by this factor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.traffic.vehicles.classes import KINDS, evidence

LEAST_VEHICLES, _MOST_VEHICLES = 12, 300
"""More than that say nothing new: how fleets differ remains."""
_RANGE, _STEPS = 5.0, 161
"""Factors from 1/5 to 5 are looked at."""
_FLEET = 0.05
"""Standard deviation of the mean size of vehicles from one place to another, as a share"""
_SIGMAS = 3.0


@dataclass(frozen=True, slots=True)
class Scale:
    """By what factor vehicles come out too large, its standard deviation as a share, and from how many of them."""

    factor: float
    sigma: float
    vehicles: int

    @property
    def off(self) -> bool:
        """Whether it is off by more than the sizes can explain."""
        return bool(abs(np.log(self.factor)) > _SIGMAS * self.sigma)

    def told(self) -> dict[str, float | int | bool]:
        """In plain data."""
        numbers = {"factor": round(self.factor, 3), "sigma": round(self.sigma, 3)}
        return {**numbers, "vehicles": self.vehicles, "off": self.off}


def scale_of(information: Floats, vector: Floats, speed: Floats) -> Scale | None:
    """The scale by T vehicles as in `classes.classified`; None for too few."""
    if len(information) < LEAST_VEHICLES:
        return None
    every = slice(None, None, -(-len(information) // _MOST_VEHICLES))
    information, vector, speed = information[every], vector[every], speed[every]
    logs = np.linspace(-np.log(_RANGE), np.log(_RANGE), _STEPS)
    likelihood = np.array([_log_likelihood(information, vector, speed, np.exp(log)) for log in logs])
    weight = np.exp(likelihood - likelihood.max())
    weight /= weight.sum()
    mean = float(weight @ logs)
    return Scale(float(np.exp(mean)), float(np.hypot(np.sqrt(weight @ (logs - mean) ** 2), _FLEET)), len(information))


def _log_likelihood(information: Floats, vector: Floats, speed: Floats, factor: float) -> float:
    """The sum over all vehicles if all sizes are too large by a factor: the boxes say the same of size / factor."""
    told = [evidence(kind, information * factor**2, vector * factor, speed / factor)[0] for kind in KINDS]
    return float(np.logaddexp.reduce(told).sum())
