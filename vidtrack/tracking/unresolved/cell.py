"""Resolution cells: how near to each other two targets give one measurement."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from scipy.special import ndtr

from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError
from vidtrack.tracking.unresolved.joint import Joint

SIZES = np.array([0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0])
"""Sizes of a cell that are told apart, in standard deviations of a measurement."""
USUAL, SPREAD = 4.0, 0.4
"""Size that is the likeliest before anything is seen, and the deviation of its logarithm."""
TINY = 1e-12
"""Smallest probability."""


@dataclass(slots=True)
class PolarCell:
    """The resolution cell of a radar: two targets nearer than that in range and in each angle give one measurement.

    origin  position of the radar [m]
    size    m, rad[, rad]; range, azimuth[, elevation]. None: learnt, in standard deviations of the measurements, from
            how often close targets give one measurement or two
    log_p   ln of the probabilities of SIZES, up to a constant

    Raises ConfigError for sizes that are not above zero.
    """

    origin: tuple[float, ...]
    size: tuple[float | None, ...]
    log_p: Floats = field(default_factory=lambda: -0.5 * (np.log(SIZES / USUAL) / SPREAD) ** 2)

    STATE = ("log_p",)

    def __post_init__(self) -> None:
        for value in self.size:
            if value is not None and not value > 0:
                raise ConfigError(f"the side of a resolution cell is {value}; it must be above zero")

    @property
    def probability(self) -> Floats:
        """Of each of SIZES."""
        p = np.exp(self.log_p - self.log_p.max())
        return np.asarray(p / p.sum())

    def axes(self, place: Floats) -> Floats:
        """(d, d) unit vectors at a place (d,), in rows: along range, azimuth[, elevation]."""
        line = place - np.asarray(self.origin)
        line = line / max(float(np.linalg.norm(line)), TINY)
        across = np.array([line[1], -line[0], 0.0][: len(line)])
        norm = float(np.linalg.norm(across))
        if norm < TINY:  # overhead, or at the radar
            return np.eye(len(line))
        across /= norm
        return np.stack([line, across] if len(line) == 2 else [line, across, np.cross(line, across)])

    def sides(self, place: Floats, R: Floats, size: float | Floats) -> Floats:
        """(..., d) sides at a place (d,) along the axes; `size` (...) deviations of R (d, d) where they are learnt."""
        axes = self.axes(place)
        sigma = np.sqrt(np.einsum("ki,ij,kj->k", axes, R, axes))
        sides = np.multiply.outer(np.asarray(size, float), sigma)
        far = float(np.linalg.norm(place - np.asarray(self.origin)))
        for k, side in enumerate(self.size):
            if side is not None:
                sides[..., k] = side * far if k else side
        return sides

    def reach(self, places: Floats, R: Floats) -> Floats:
        """(T,) longest side of a cell at places (T, d) for measurements with R (M, d, d)."""
        sigma = np.sqrt(np.linalg.eigvalsh(R).max())
        far = np.linalg.norm(places - np.asarray(self.origin), axis=1)
        sides = [
            np.full(len(far), SIZES[-1] * sigma) if side is None else side * (far if k else np.ones(len(far)))
            for k, side in enumerate(self.size)
        ]
        return np.asarray(np.max(sides, axis=0))

    def shared(self, joint: Joint, i: int, j: int, R: Floats, size: float | Floats) -> Floats:
        """(...) probability that targets i and j of a joint state are in one cell, of `size` (...) deviations of R."""
        middle, difference = joint.middle, joint.difference(i, j)
        axes = self.axes(middle) @ difference
        mean, sigma = axes @ joint.x, np.sqrt(np.einsum("ki,ij,kj->k", axes, joint.P, axes))
        sides = self.sides(middle, R, size)
        return np.asarray((ndtr((sides - mean) / sigma) - ndtr((-sides - mean) / sigma)).prod(axis=-1))

    def confined(self, joint: Joint, R: Floats) -> Joint:
        """The joint state given that its targets are in one cell."""
        middle = joint.middle
        sides = self.sides(middle, R, float(self.probability @ SIZES))
        for i, j in combinations(range(joint.targets), 2):
            for axis, side in zip(self.axes(middle) @ joint.difference(i, j), sides, strict=True):
                joint = joint.within(axis, float(side))
        return joint

    def learn(self, shared: Floats, log_odds: float) -> None:
        """Learn from two close targets: probability of one measurement by size (SIZES), ln odds of one against two."""
        shared = np.clip(shared, TINY, 1 - TINY)
        self.log_p = self.log_p + np.logaddexp(np.log(shared) + log_odds, np.log1p(-shared))
        self.log_p = self.log_p - self.log_p.max()
