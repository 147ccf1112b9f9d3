"""Which vehicles there are: sizes, colours and drivers of each class."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from vidtrack.arrays.types import Floats, Ints
from vidtrack.simulate.looks import CAR_COLOURS

LONG_M = 7.0  # what is longer does not take narrow turns


@dataclass(frozen=True, slots=True)
class Kind:
    """A class of vehicles: ranges of sizes in metres, and its drivers as in `Drivers`.

    share   of the traffic
    faster  wished speed over the limit, mean and standard deviation
    top     m/s; never faster
    """

    name: str
    share: float
    length: tuple[float, float]
    width: tuple[float, float]
    height: tuple[float, float]
    a: float
    b: float
    T: float
    faster: tuple[float, float]
    top: float


KINDS = (
    Kind("motorcycle", 0.05, (2.0, 2.4), (0.75, 0.9), (1.4, 1.6), 2.0, 2.2, 1.2, (1.02, 0.08), 40.0),
    Kind("car", 0.74, (3.7, 4.8), (1.68, 1.88), (1.4, 1.6), 1.5, 2.0, 1.2, (1.0, 0.08), 45.0),
    Kind("van", 0.11, (5.0, 6.2), (1.92, 2.05), (2.1, 2.6), 1.2, 2.0, 1.4, (0.97, 0.06), 34.0),
    Kind("lorry", 0.07, (7.2, 10.0), (2.4, 2.55), (3.2, 3.8), 0.8, 1.6, 1.7, (0.92, 0.04), 24.5),
    Kind("bus", 0.03, (10.8, 12.4), (2.5, 2.55), (2.9, 3.2), 0.8, 1.6, 1.7, (0.92, 0.04), 27.0),
)
CLASS_BOUNDS_M = {
    "motorcycle": (1.5, 3.0),
    "car": (3.0, 4.9),
    "van": (4.9, 6.8),
    "lorry": (6.8, 10.4),
    "bus": (10.4, 13.0),
}
"""Lengths by which the classes can be told apart."""


@dataclass(frozen=True, slots=True, eq=False)
class Fleet:
    """All vehicles of a clip, arrays (N,): class (index in KINDS), sizes [m], colour (N, 3), and the drivers."""

    kind: Ints
    length: Floats
    width: Floats
    height: Floats
    colour: Floats
    faster: Floats
    top: Floats

    def drivers(self, who: Ints) -> tuple[Floats, Floats, Floats]:
        """a, b and T of some of them."""
        a, b, T = np.array([(kind.a, kind.b, kind.T) for kind in KINDS])[self.kind[who]].T
        return a, b, T


def fleet(count: int, rng: Generator) -> Fleet:
    """Draw `count` vehicles."""
    shares = np.array([kind.share for kind in KINDS])
    kind = rng.choice(len(KINDS), count, p=shares / shares.sum())
    size = [np.array([getattr(k, name) for k in KINDS])[kind] for name in ("length", "width", "height")]
    length, width, height = (rng.uniform(low, high) for low, high in (part.T for part in size))
    faster = np.array([k.faster for k in KINDS])[kind]
    colours = np.array(CAR_COLOURS)[rng.integers(0, len(CAR_COLOURS), count)] * rng.uniform(0.85, 1.05, (count, 1))
    return Fleet(
        kind=kind,
        length=length,
        width=width,
        height=height,
        colour=np.clip(colours, 0, 255),
        faster=np.clip(rng.normal(faster[:, 0], faster[:, 1]), 0.75, 1.25),
        top=np.array([k.top for k in KINDS])[kind],
    )
