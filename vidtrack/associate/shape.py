"""Box size as a feature in the association."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.gate import Pairs, quantile
from vidtrack.compiled import kernel
from vidtrack.errors import ConfigError


@dataclass(frozen=True, slots=True)
class Shape:
    """Gate and likelihood of box sizes, which change little from scan to scan.

    sigma        standard deviation of the logarithm of width and height between a track and its measurement
    probability  share of a vehicle's own boxes that the joint gate of position and size admits
    overlap      smallest admitted intersection over union of a box with the predicted box
    """

    sigma: float = 0.15
    probability: float = 0.99
    overlap: float = 0.3

    def __post_init__(self) -> None:
        if not self.sigma > 0:
            raise ConfigError(f"shape sigma is {self.sigma}; it must be above zero")
        if not 0 <= self.overlap < 1:
            raise ConfigError(f"shape overlap is {self.overlap}; it must be at least 0 and below 1")
        if not 0 < self.probability < 1:
            raise ConfigError(f"shape probability is {self.probability}; it must lie between 0 and 1")

    def weigh(self, pairs: Pairs, predicted: Floats, boxes: Floats) -> Pairs:
        """The pairs that the size admits, with its distance added to their cost and likelihood.

        predicted (T, 4) and boxes (M, 4) in the picture. A pair stays if d2 plus the size distance
        |ln(w h ratios)|^2 / sigma^2 is below the gate plus the chi-square quantile of the size, and if the boxes
        overlap enough.
        """
        most = pairs.limit + quantile(self.probability, 2)
        log_l, cost, stays = _compare(
            pairs.row, pairs.measurement, pairs.d2, pairs.log_l, pairs.cost, most,
            predicted, boxes, self.sigma, self.overlap,
        )  # fmt: skip
        weighed = Pairs(
            pairs.row, pairs.measurement, pairs.d2, pairs.nis, pairs.log_s, log_l, cost, pairs.limit, pairs.start
        )
        return weighed.only(stays)


@kernel
def _compare(
    row: Ints, measurement: Ints, d2: Floats, log_l: Floats, cost: Floats, most: Floats,
    predicted: Floats, boxes: Floats, sigma: float, overlap: float,
) -> tuple[Floats, Floats, Mask]:  # fmt: skip
    """(N,) the pairs' log_l and cost with their size distances, and which of them stay.

    A track without a box admits any size; a box of size zero is never admitted.
    """
    log_l, cost, stays = log_l.copy(), cost.copy(), np.ones(len(row), np.bool_)
    for k in range(len(row)):
        mine, theirs = predicted[row[k]], boxes[measurement[k]]
        if np.isnan(mine[0]):
            continue
        common, size2 = 1.0, 0.0
        for axis in range(2):
            near = max(mine[axis], theirs[axis])
            far = min(mine[axis] + mine[axis + 2], theirs[axis] + theirs[axis + 2])
            common *= max(0.0, far - near)
            size2 += (np.log(theirs[axis + 2] / mine[axis + 2]) / sigma) ** 2
        union = mine[2] * mine[3] + theirs[2] * theirs[3] - common
        stays[k] = common >= overlap * union and d2[k] + size2 <= most[row[k]]
        log_l[k] -= 0.5 * size2
        cost[k] += size2
    return log_l, cost, stays
