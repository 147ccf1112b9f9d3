"""A station: a sensor at its place, with how well it detects, how much clutter it has, and what it covers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.tracking.rates import Rates


class Coverage(Protocol):
    """Where a station can detect a target."""

    def share(self, xy: Floats) -> Floats:
        """(T,) share of the detection probability at positions (T, d): 0 where nothing can be seen, 1 where all."""


@dataclass(frozen=True, slots=True)
class Everywhere:
    """No limit."""

    def share(self, xy: Floats) -> Floats:
        """Ones."""
        return np.ones(len(xy))


@dataclass(frozen=True, slots=True)
class Station:
    """One of the sensors of a tracker. A scan names its station; the measurement model is the scan's own.

    rates     detection probability and clutter density, given or estimated
    coverage  a target outside is neither seen nor missed
    """

    rates: Rates = field(default_factory=Rates)
    coverage: Coverage = field(default_factory=Everywhere)
