"""The interval of a share by Clopper and Pearson (Biometrika 26, 1934), which holds the truth at least as often as it
says."""

from __future__ import annotations

import numpy as np
from scipy.special import betaincinv

from vidtrack.arrays.types import Floats


def clopper_pearson(part: Floats | float, whole: Floats | float, below: float, above: float) -> tuple[Floats, Floats]:
    """(N,) bounds of the shares that `part` (N,) of `whole` (N,) trials are samples of.

    below, above  probabilities that the share lies below, and above the bounds
    """
    part, whole = np.asarray(part, float), np.asarray(whole, float)
    low = np.where(part > 0, betaincinv(np.maximum(part, 0.5), whole - part + 1, below), 0.0)
    high = np.where(part < whole, betaincinv(part + 1, np.maximum(whole - part, 0.5), 1 - above), 1.0)
    return low, high
