"""The length of a vehicle from all rows of its track, and its class."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vidtrack.arrays.types import Floats, Ints

UNKNOWN = "unknown"
"""The class of a vehicle of which none is sure."""
_LEAST_SIGMA_M = 0.01
"""m; to which lengths are known at best"""


def length_sums(track: Ints, length: Floats, sigma: Floats, tracks: int) -> Floats:
    """(T, 3) sums of length / sigma^2, of 1 / sigma^2 and of 1 over the rows (N,) of each track that have both."""
    weight = 1 / np.maximum(sigma, _LEAST_SIGMA_M) ** 2
    known = np.isfinite(weight * length)
    terms = (weight * length, weight, np.ones(len(track)))
    return np.column_stack([np.bincount(track[known], term[known], tracks) for term in terms])


def mean_length(sums: Floats) -> tuple[Floats, Floats]:
    """(T,) m; the mean weighted by the variances, from `length_sums` (T, 3), and its standard deviation.

    That is the one of a row, since errors last. NaN where nothing is known.
    """
    total, weight, rows = sums.T
    known = weight > 0
    length, variance = (np.divide(a, weight, out=np.full(len(a), np.nan), where=known) for a in (total, rows))
    return length, np.sqrt(variance)


def class_of(length: Floats, classes: dict[str, tuple[float, float]]) -> list[str | None]:
    """(T,) the first class of the site with low <= length < high [m]; None where there is none."""
    number = np.full(len(length), len(classes))
    for k, (low, high) in reversed(list(enumerate(classes.values()))):
        number[(length >= low) & (length < high)] = k
    names = [*classes, None]
    return [names[k] for k in number.tolist()]


def bounds(of_class: tuple[float, float]) -> tuple[float, float]:
    """The same low and high length [m] of a class. Raises ValueError where these are no lengths in that order."""
    if not 0 <= of_class[0] < of_class[1]:
        raise ValueError("write the shortest length, then the longest, in metres")
    return of_class


def apart(classes: dict[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """The same classes of a site. Raises ValueError where two overlap, or one has the name of none."""
    if UNKNOWN in classes:
        raise ValueError(f"{UNKNOWN} is the class of vehicles of which none is sure; take another name")
    ordered = sorted(classes.items(), key=lambda one: one[1])
    for (name, (low, high)), (other, (low2, high2)) in pairwise(ordered):
        if low2 < high:
            raise ValueError(
                f"{name}, {low:g} to {high:g} m, and {other}, {low2:g} to {high2:g} m, overlap; let them touch"
            )
    return classes
