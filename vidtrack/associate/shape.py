"""The size of a box as evidence: a lorry's box is not a motorcycle's, however near it lies."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from vidtrack.associate.gate import Pairs
from vidtrack.errors import ConfigError
from vidtrack.scan import Floats


@dataclass(frozen=True, slots=True)
class Shape:
    """Boxes of a vehicle keep their size from scan to scan.

    sigma        standard deviation of the logarithm of width and height between a track and its measurement
    probability  share of a vehicle's own boxes that position and size together admit
    """

    sigma: float = 0.2
    probability: float = 0.99

    def __post_init__(self) -> None:
        if not self.sigma > 0:
            raise ConfigError(f"shape sigma is {self.sigma}; it must be above zero")
        if not 0 < self.probability < 1:
            raise ConfigError(f"shape probability is {self.probability}; it must lie between 0 and 1")

    def weigh(self, pairs: Pairs, predicted: Floats, boxes: Floats) -> Pairs:
        """The pairs that size allows, with the size's distance added to their cost.

        predicted (T, 4) and boxes (M, 4) in the picture. A pair stays if its d2 and its size distance
        |ln(w h ratios)|^2 / sigma^2 together are below the gate plus the size's own chi-square quantile,
        and if the boxes overlap in both axes: nothing jumps clear of its own prediction.
        """
        mine, theirs = predicted[pairs.row], boxes[pairs.measurement]
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.log(theirs[:, 2:] / mine[:, 2:]) / self.sigma
        size2 = np.nan_to_num((off * off).sum(axis=1), nan=0.0)
        low = np.maximum(mine[:, :2], theirs[:, :2])
        high = np.minimum(mine[:, :2] + mine[:, 2:], theirs[:, :2] + theirs[:, 2:])
        touching = (high > low).all(axis=1) | np.isnan(mine[:, 0])
        limit = pairs.limit[pairs.row] + chi2.ppf(self.probability, 2)
        return replace(pairs, cost=pairs.cost + size2).only((pairs.d2 + size2 <= limit) & touching)
