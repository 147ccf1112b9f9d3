"""Consistency: whether errors agree with the covariances.

Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and Navigation",
Wiley 2001, section 5.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaincinv

from vidtrack.arrays.types import Floats, Ints
from vidtrack.formats import Table


@dataclass(frozen=True, slots=True)
class Consistency:
    """The mean of a normalised squared error and its confidence bounds.

    low, high   confidence bounds of the mean of `samples` independent chi-square values; in one run the
                values of a track are correlated in time, and the true bounds are wider
    inside      share of the values within their own one-sided bound; should equal the confidence
    """

    mean: float
    low: float
    high: float
    inside: float
    samples: int


def consistency(values: Floats, dim: int, confidence: float = 0.95) -> Consistency | None:
    """Compare NEES or NIS values (K,) with chi-square of `dim` degrees of freedom; NaN is ignored, None without values.

    With a mean above `high` the covariances are too small, below `low` too large.
    """
    values = values[np.isfinite(values)]
    count = len(values)
    if count == 0:
        return None
    tail = (1 - confidence) / 2
    low, high = 2 * gammaincinv(count * dim / 2, [tail, 1 - tail]) / count  # chi-square quantiles
    inside = np.mean(values <= 2 * gammaincinv(dim / 2, confidence))
    return Consistency(float(values.mean()), float(low), float(high), float(inside), count)


def nees(result: Table, truth: Table, result_rows: Ints, truth_rows: Ints) -> Floats:
    """Normalised estimation error squared (K,) of the position, e' P^-1 e, of matched rows (K,).

    NaN if the covariance is missing or, as precisely as numbers are, not positive definite.
    """
    value = np.full(len(result_rows), np.nan)
    if result.cov is None:
        return value
    axes = min(result.xy.shape[1], truth.xy.shape[1])
    error = result.xy[result_rows, :axes] - truth.xy[truth_rows, :axes]
    cov = result.cov[result_rows, :axes, :axes]
    usable = np.isfinite(cov.sum(axis=(1, 2)))
    least, *_, most = np.linalg.eigvalsh(cov[usable]).T
    usable[usable] = least > axes * np.finfo(float).eps * most
    weighted = np.linalg.solve(cov[usable], error[usable][..., None])[..., 0]
    value[usable] = np.einsum("ki,ki->k", error[usable], weighted)
    return value
