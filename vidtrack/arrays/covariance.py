"""Correlations of errors."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats


def correlation(cov: Floats, scale: Floats) -> Floats:
    """(N,) covariances (N,) of two errors over the product of their sigmas (N,); NaN where there is no error."""
    return np.divide(cov, scale, out=np.full(len(cov), np.nan), where=~(scale <= 0))
