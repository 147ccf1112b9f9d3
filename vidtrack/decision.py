"""The decision of an associator, and its reasons."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints, Mask


@dataclass(slots=True)
class Decision:
    """The association of one scan: how K successor rows follow from T rows and M measurements.

    parent     (K,) the row each successor continues; 0..T-1 for one-scan methods
    row, measurement, beta   (B,) sparse weights over (successor, measurement), sorted by row
    beta0      (K,) weight of "not detected"; with the betas of its row it sums to one
    inflation  (K,) factor by which a miss inflates P: the missed branch has P + inflation K S K' (PDA, PSNF); None: 0
    spread     whether the spread of the weighted measurements is added to P; generalized nearest neighbour uses
               their mean as one measurement
    approximate  (K,) rows with approximate weights, in clusters too large for exact ones; None: no row
    shows      whether the measurements show the targets; else they are what a miss tells, and no row is hit
    """

    parent: Ints
    row: Ints
    measurement: Ints
    beta: Floats
    beta0: Floats
    inflation: Floats | None = None
    spread: bool = True
    approximate: Mask | None = None
    shows: bool = True

    @property
    def hit(self) -> Mask:
        """(K,) rows that are rather detected than not."""
        return np.logical_and(self.shows, self.beta0 < 0.5)

    def without(self, rows: Mask) -> Decision:
        """The same decision with a plain miss, without inflation, in these rows (K,)."""
        if not np.count_nonzero(rows):
            return self
        stay = ~rows[self.row]
        beta0 = np.where(rows, 1.0, self.beta0)
        inflation = None if self.inflation is None else np.where(rows, 0.0, self.inflation)
        row, measurement, beta = self.row[stay], self.measurement[stay], self.beta[stay]
        return Decision(self.parent, row, measurement, beta, beta0, inflation, self.spread, self.approximate)

    def joined(self, other: Decision) -> Decision:
        """The union of two decisions about disjoint sets of rows."""
        from vidtrack.arrays.rows import merged  # loads the compiler

        row, measurement, beta, beta0 = merged(
            self.row, self.measurement, self.beta, self.beta0, other.row, other.measurement, other.beta, other.beta0
        )
        inflation = _chosen(other.row, other.inflation, self.inflation)
        approximate = _chosen(other.row, other.approximate, self.approximate)
        return Decision(self.parent, row, measurement, beta, beta0, inflation, self.spread, approximate)


def _chosen(theirs: Ints, other: Any, own: Any) -> Any:
    """`own` with the values of `other` in the rows `theirs` (B,); None if `own` is None."""
    if own is None:
        return None
    chosen = own.copy()
    chosen[theirs] = 0 if other is None else other[theirs]
    return chosen


class Event(NamedTuple):
    """A change of a track's status, with its reason in words."""

    t: float
    track_id: int
    kind: str  # "birth", "confirmed", "merge", "split", "delete"
    reason: str

    @classmethod
    def each(cls, t: float, ids: Ints, kind: str, reason: str) -> list[Event]:
        """The same event for each of these tracks (N,)."""
        return [cls(t, track, kind, reason) for track in ids.tolist()]


@dataclass(slots=True)
class Choices:
    """The choice made for each track of a scan, for `--decisions`. -1 and NaN: none.

    track_id, measurement, weight, d2, gate, runner_up, runner_up_d2   (T,)
    candidates, candidates_weight, candidates_d2   (T, C) the C measurements of largest weight in the gate
    """

    track_id: Ints
    measurement: Ints
    weight: Floats
    d2: Floats
    gate: Floats
    runner_up: Ints
    runner_up_d2: Floats
    candidates: Ints
    candidates_weight: Floats
    candidates_d2: Floats

    def only(self, rows: NDArray[Any]) -> Choices:
        """The rows selected by a mask or by indices."""
        return Choices(*(getattr(self, column.name)[rows] for column in fields(self)))
