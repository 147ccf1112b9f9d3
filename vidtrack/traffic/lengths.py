"""The length of a vehicle from all rows of its track, and its class."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints

UNKNOWN = "unknown"
"""The class of a vehicle of which none is sure."""
_LEAST_SIGMA_M = 0.01
"""m; to which lengths are known at best"""


def length_sums(track: Ints, length: Floats, sigma: Floats, tracks: int) -> Floats:
    """(T, 2) sums of length / sigma^2 and of 1 / sigma^2 over the rows (N,) of each track that have both."""
    weight = 1 / np.maximum(sigma, _LEAST_SIGMA_M) ** 2
    known = np.isfinite(weight * length)
    terms = (weight * length, weight)
    return np.column_stack([np.bincount(track[known], term[known], tracks) for term in terms])


def mean_length(sums: Floats) -> Floats:
    """(T,) m; the mean weighted by the variances, from `length_sums` (T, 2); NaN where it is not known."""
    total, weight = sums.T
    return np.asarray(np.divide(total, weight, out=np.full(len(total), np.nan), where=weight > 0))


def class_of(length: Floats, classes: dict[str, tuple[float, float]]) -> list[str | None]:
    """(T,) the first class of the site with low <= length < high [m]; None where there is none."""
    number = np.full(len(length), len(classes))
    for k, (low, high) in reversed(list(enumerate(classes.values()))):
        number[(length >= low) & (length < high)] = k
    names = [*classes, None]
    return [names[k] for k in number.tolist()]
