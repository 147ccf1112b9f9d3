"""Deferred decisions: a track is a tree, and each of its leaves, a row of the bank, is one possible history."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.problem import Problem
from vidtrack.decision import Decision, Event
from vidtrack.tracking.register import Register


class Growth(NamedTuple):
    """The trees after a scan.

    problem   what each successor could choose from, limited to the likeliest measurements
    decision  how the successors come from the rows
    born      (M,) measurements that start trees
    """

    problem: Problem
    decision: Decision
    born: Mask


class Forest(Protocol):
    """The trees of a tracker, one leaf a row of its bank and register; leaves of one tree have one track id.

    shown  rows that are shown as tracks at present, at most one of each tree
    sure   (T,) rows whose tree is probable enough to be confirmed
    """

    @property
    def shown(self) -> Ints: ...

    @property
    def sure(self) -> Mask: ...

    def grow(self, problem: Problem, register: Register, starts: Mask, events: list[Event]) -> Growth:
        """Decide on a scan and replace the rows of the register by their successors.

        starts (M,) measurements that may start a tree. New trees become the last rows, in the order of their
        measurements.
        """

    def settle(self, register: Register, t: float, events: list[Event]) -> None:
        """Choose the rows that are shown, once those of the new trees are in the bank."""

    def keep(self, kept: Mask) -> None:
        """Drop all rows but these; trees that are not yet in the bank stay."""

    def add(self, count: int) -> None:
        """Append `count` trees of one leaf each as last rows."""


@runtime_checkable
class ForestRule(Protocol):
    """An association rule that decides some scans later: MHT, Split."""

    def forest(self) -> Forest:
        """A new tracker's trees."""


class Window:
    """The measurements of each row in the last scans.

    past  (T, N) running numbers of the measurements, newest first; -1 for none
    age   (T,) scans since the tree began
    seen  measurements so far
    """

    STATE = ("past", "age", "seen")

    def __init__(self, scans: int) -> None:
        self.past = np.empty((0, scans), np.int64)
        self.age = np.empty(0, np.int64)
        self.seen = 0

    def __len__(self) -> int:
        return len(self.age)

    def move(self, parent: Ints, taken: Ints, born: Ints, measurements: int) -> None:
        """Add a scan: successors of `parent` (K,) took measurement `taken` (K,) or -1; then trees from `born` (B,)."""
        number = np.where(taken < 0, -1, taken + self.seen)
        past = np.full((len(parent) + len(born), self.past.shape[1]), -1)
        past[: len(parent), 1:] = self.past[parent, :-1]
        past[:, 0] = np.concatenate([number, born + self.seen])
        self.past = past
        self.age = np.concatenate([self.age[parent] + 1, np.zeros(len(born), np.int64)])
        self.seen += measurements

    def keep(self, kept: Mask) -> None:
        """Drop all rows but these."""
        self.past, self.age = self.past[kept], self.age[kept]

    def add(self, count: int) -> None:
        """Append rows without measurements."""
        self.past = np.concatenate([self.past, np.full((count, self.past.shape[1]), -1)])
        self.age = np.concatenate([self.age, np.full(count, self.past.shape[1])])


def one_each(parent: Ints, measurement: Ints) -> Decision:
    """Successors (K,) of parents that take one measurement, or none (-1)."""
    row = np.flatnonzero(measurement >= 0)
    missed: Floats = (measurement < 0).astype(float)
    return Decision(parent, row, measurement[row], np.ones(len(row)), missed)
