"""Where false measurements are: their density by place, learnt while tracking."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from vidtrack.arrays.types import Floats, Ints

_LEVELS = 5
"""The map has 2^5 cells along each of its two axes."""
_WEIGHT = 16.0
"""Measurements; weight of the prior at the first level. With 1, slow targets at the beginning of a recording are taken
for clutter at their places before they are confirmed."""
_NEW = 0.1
"""Measurements of new targets per false one, as in LogRatio and LikelihoodGate; they begin anywhere."""

_STEP = 0.1
"""Share of its length by which the surveyed box grows at once at one of its sides: one measurement changes the mean
density by at most 1.1 along each axis."""
_FEW, _RARE = 2.0, 0.01
"""So many of the remembered measurements, or this share of them, may be beyond a side before the box grows there."""


class EvenClutter:
    """The same density everywhere in what is surveyed."""

    STATE: tuple[str, ...] = ()
    grown = 1.0
    """How many times as large as at first is what is surveyed."""

    def reach(self, z: Floats) -> None:
        """What is surveyed has no box."""

    def at(self, z: Floats) -> float | Floats:
        """One."""
        return 1.0

    def forget(self, fade: float) -> None:
        """Nothing is remembered."""

    def learn(self, z: Floats, false: Floats) -> None:
        """Nothing is learnt."""


class EvenBox(EvenClutter):
    """The same density everywhere in a box, which grows where measurements are outside.

    A few wild measurements do not move it: a side moves by `_STEP` of the box's length, at most once a scan, and only
    when more than `_FEW` of the remembered measurements, and a share of more than `_RARE`, have been beyond it.

    low, high  (2,) corners of the box, on the first two axes of the measurements
    polar      whether these are range and azimuth [rad], and not positions: the box is part of a ring
    """

    STATE: tuple[str, ...] = ("low", "high", "grown", "beyond", "seen")
    ADDED: ClassVar = {"beyond": lambda box: np.zeros((2, 2)), "seen": lambda box: 0.0}

    def __init__(self, low: Floats, high: Floats, polar: bool = False) -> None:
        self.low, self.high = np.asarray(low, float), np.asarray(high, float)
        self.polar = polar
        self.grown = 1.0
        self.beyond: Floats = np.zeros((2, 2))
        """Measurements remembered below the box and above it (rows), along each axis, since its side moved."""
        self.seen = 0.0
        """Measurements remembered."""

    def reach(self, z: Floats) -> None:
        """Note which of measurements (N, m) are outside, and move the sides that too many have been beyond."""
        side, place = self.high - self.low, self._places(z)
        self.seen += len(z)
        self.beyond += [(place < self.low).sum(axis=0), (place > self.high).sum(axis=0)]
        below, above = move = self.beyond > max(_FEW, _RARE * self.seen)
        self.beyond[move] = 0.0
        self.low = np.where(below, self.low - _STEP * side, self.low)
        self.high = np.where(above, self.high + _STEP * side, self.high)
        if self.polar:
            over = max(0.0, self.high[1] - self.low[1] - 2 * np.pi) / 2
            self.low, self.high = np.array([max(self.low[0], 0.0), self.low[1] + over]), self.high - [0.0, over]
        self.grown *= float(((self.high - self.low) / side).prod())

    def forget(self, fade: float) -> None:
        """Keep this share of what is remembered."""
        self.beyond *= fade
        self.seen *= fade

    def _places(self, z: Floats) -> Floats:
        """(N, 2) measurements (N, m) on the axes of the box; azimuths within half a turn of its middle."""
        if not self.polar:
            return z[:, :2]
        middle = (self.low[1] + self.high[1]) / 2
        return np.column_stack([z[:, 0], middle + (z[:, 1] - middle + np.pi) % (2 * np.pi) - np.pi])


class ClutterMap(EvenBox):
    """The density of measurements of no known target at a place, over its mean in the whole box.

    New targets begin anywhere; false measurements are distributed by a Polya tree. The box is quartered, each quarter
    again, and so on. How the false measurements of a part at level k divide among its quarters has a Dirichlet prior
    with the weight of 16 k^2 measurements, evenly: where they are few, a place has the density of what surrounds it.
    With k^2 the density has no steps that the data do not show (M. Lavine, "Some aspects of Polya tree distributions
    for statistical modelling", Annals of Statistics 20(3), 1992).
    """

    STATE = ("count", *EvenBox.STATE)

    def __init__(self, low: Floats, high: Floats, polar: bool = False) -> None:
        super().__init__(low, high, polar)
        self.count: Floats = np.zeros((2**_LEVELS, 2**_LEVELS))
        """False measurements remembered in each cell."""

    @property
    def density(self) -> Floats:
        """(32, 32) relative density in each cell, along the first axis and the second; its mean is one."""
        density, whole = np.ones((1, 1)), np.full((1, 1), self.count.sum())
        for level in range(1, _LEVELS + 1):
            side = 2 ** (_LEVELS - level)
            part = self.count.reshape(2**level, side, 2**level, side).sum(axis=(1, 3))
            density, whole = (each.repeat(2, axis=0).repeat(2, axis=1) for each in (density, whole))
            density, whole = density * (4 * part + _WEIGHT * level**2) / (whole + _WEIGHT * level**2), part
        return (density + _NEW) / (1 + _NEW)

    def reach(self, z: Floats) -> None:
        """As of an even box; what was counted in a cell is spread evenly over its place."""
        low, high = self.low, self.high
        super().reach(z)
        for axis in np.flatnonzero((low != self.low) | (high != self.high)):
            old = np.linspace(low[axis], high[axis], len(self.count) + 1)
            new = np.linspace(self.low[axis], self.high[axis], len(self.count) + 1)
            common = np.minimum(new[1:, None], old[None, 1:]) - np.maximum(new[:-1, None], old[None, :-1])
            share = np.maximum(common, 0.0) / np.diff(old)
            self.count = share @ self.count if axis == 0 else self.count @ share.T

    def at(self, z: Floats) -> Floats:
        """(N,) relative density at measurements (N, m)."""
        return np.asarray(self.density[self._cells(z)])

    def forget(self, fade: float) -> None:
        """Keep this share of what is remembered."""
        super().forget(fade)
        self.count *= fade

    def learn(self, z: Floats, false: Floats) -> None:
        """Take measurements (N, m) that are false with probabilities (N,)."""
        np.add.at(self.count, self._cells(z), false)

    def _cells(self, z: Floats) -> tuple[Ints, Ints]:
        share = (self._places(z) - self.low) / (self.high - self.low)
        row, column = np.clip((share * len(self.count)).astype(np.int64), 0, len(self.count) - 1).T
        return row, column
