"""The look of objects as a feature in the association."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.gate import Pairs
from vidtrack.compiled import kernel


@dataclass(frozen=True, slots=True)
class Look:
    """Likelihood ratio of mean luminance and chroma: of the same object against another one.

    same   standard deviations [grey levels] of the luminance and the chroma of an object, from scan to scan, as it
           turns and as others hide parts of it
    other  those of the difference between two objects
    most   the ln of the ratio is not below -most: lamps and shade change a look more than by these deviations
    """

    same: tuple[float, float] = (10.0, 3.0)
    other: tuple[float, float] = (40.0, 8.0)
    most: float = 4.0

    def weigh(self, pairs: Pairs, mine: Floats, theirs: Floats) -> Pairs:
        """The pairs with the ratio in their cost and likelihood; looks mine (T, 3), NaN unknown, and theirs (M, 3)."""
        told = self.ratio(mine, theirs, pairs.row, pairs.measurement)
        return Pairs(
            pairs.row, pairs.measurement, pairs.d2, pairs.nis, pairs.log_s, pairs.log_l + told,
            pairs.cost - 2 * told, pairs.limit, pairs.start,
        )  # fmt: skip

    def ratio(self, mine: Floats, theirs: Floats, row: Ints, measurement: Ints) -> Floats:
        """(N,) ln of the ratio of rows and measurements (N,) with the looks mine (T, 3) and theirs (M, 3)."""
        same, other = (np.array([luma, chroma, chroma]) for luma, chroma in (self.same, self.other))
        return np.asarray(_compare(row, measurement, mine, theirs, same, other, self.most))


@kernel
def _compare(
    row: Ints, measurement: Ints, mine: Floats, theirs: Floats, same: Floats, other: Floats, most: float
) -> Floats:
    """(N,) ln of the ratio of each pair, not below -most; 0 where a look is not known."""
    told = np.zeros(len(row))
    for k in range(len(row)):
        a, b = mine[row[k]], theirs[measurement[k]]
        if np.isnan(a[0]):
            continue
        for c in range(len(same)):
            d2 = (a[c] - b[c]) ** 2
            told[k] += np.log(other[c] / same[c]) - 0.5 * d2 * (1 / same[c] ** 2 - 1 / other[c] ** 2)
        told[k] = max(told[k], -most)
    return told
