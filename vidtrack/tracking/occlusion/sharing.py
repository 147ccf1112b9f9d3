"""The interface of models for shared measurements, and the null model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from vidtrack.arrays.rows import every, no_index
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.problem import Problem
from vidtrack.decision import Event
from vidtrack.estimate.bank import Estimator
from vidtrack.tracking.association import Association
from vidtrack.tracking.picture.picture import View
from vidtrack.tracking.picture.road import Road
from vidtrack.tracking.register import Register


class Sharing(Protocol):
    """A model for measurements that tracks share: `Exclusive` (no sharing), `Occlusion` or `Unresolved`.

    A view is None if measurements have no extent.
    """

    def unresolved(self, problem: Problem, shown: Mask, register: Register, bank: Estimator, dt: float) -> Ints:
        """(T,) the measurement that each row shares whatever the association decides about others; -1: none.

        shown  (T,) rows that are output; dt seconds after the last scan
        """

    def claim(self, view: View | None, taken: Ints, confirmed: Mask, count: int) -> tuple[Ints, Mask]:
        """(T,) the measurement whose edges update each track, -1: none; (M,) those that may hide another target.

        taken  (T,) which of all `count` measurements each of the confirmed (T,) tracks has; -1: none
        """

    def catch(self, view: View | None, taken: Ints, shared: Ints, free: Mask) -> tuple[Ints, Mask]:
        """`shared` (T,) and `free` (M,) after tracks that got nothing took free measurements that they overlap."""

    def update(self, found: Association, view: View | None, register: Register, bank: Estimator, dt: float) -> None:
        """Update the tracks on shared measurements by the edges they can claim, dt seconds after the last scan."""

    def parts(self, register: Register, bank: Estimator, t: float, ending: Mask) -> Mask:
        """(T,) tracks that are no targets but parts of another one, which is none of those ending (T,) in this scan."""

    def merge(self, shared: Ints, register: Register, t: float, events: list[Event]) -> None:
        """Update the groups of tracks on the same shared (T,) measurement, with events."""

    def newcomers(self, born: Ints, view: View | None, register: Register, bank: Estimator) -> Ints:
        """Those of the free measurements born (B,) that are no pieces of known targets."""

    def travel(self, register: Register, bank: Estimator, road: Road | None, dt: float) -> Floats:
        """(T,) how far each row travelled by itself since it began; dt seconds after the last scan."""


@dataclass(frozen=True, slots=True)
class Exclusive:
    """Each measurement is of one target."""

    STATE = ()

    def unresolved(self, problem: Problem, shown: Mask, register: Register, bank: Estimator, dt: float) -> Ints:
        """(T,) none."""
        return no_index(problem.rows)

    def claim(self, view: View | None, taken: Ints, confirmed: Mask, count: int) -> tuple[Ints, Mask]:
        """No track shares a measurement, and all measurements may be of new targets."""
        return no_index(len(confirmed)), every(count)

    def catch(self, view: View | None, taken: Ints, shared: Ints, free: Mask) -> tuple[Ints, Mask]:
        """No track continues on what its gate does not hold."""
        return shared, free

    def update(self, found: Association, view: View | None, register: Register, bank: Estimator, dt: float) -> None:
        """Nothing is shared."""

    def parts(self, register: Register, bank: Estimator, t: float, ending: Mask) -> Mask:
        """(T,) none."""
        return np.zeros(len(register), bool)

    def merge(self, shared: Ints, register: Register, t: float, events: list[Event]) -> None:
        """No tracks are merged."""

    def newcomers(self, born: Ints, view: View | None, register: Register, bank: Estimator) -> Ints:
        """All of them."""
        return born

    def travel(self, register: Register, bank: Estimator, road: Road | None, dt: float) -> Floats:
        """(T,) distances from where the rows began."""
        return register.travel(bank.x.take(bank.model.position, axis=1))
