"""The length of a vehicle from all rows of its track, and its class: of finished runs, of rows, and live."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask

UNKNOWN = "unknown"
"""The class of a vehicle of which none is sure."""
_LEAST_SIGMA_M = 0.01
"""m; to which lengths are known at best"""


def length_terms(length: Floats, sigma: Floats, hidden: Mask) -> Floats:
    """(N, 4) what rows add to the mean length of their track: 1 / sigma^2, times length, times length^2, and 1.

    0 of rows whose length is not known or, hidden (N,), not that of the whole vehicle.

    length, sigma  (N,) m
    """
    weight = 1 / np.maximum(sigma, _LEAST_SIGMA_M) ** 2
    terms = np.column_stack([weight, weight * length, weight * length**2, np.ones(len(length))])
    return np.where((np.isfinite(terms[:, 2]) & ~hidden)[:, None], terms, 0.0)


def length_sums(track: Ints, terms: Floats, tracks: int) -> Floats:
    """(T, 4) sums of `length_terms` (N, 4) over the rows of each track (N,)."""
    return np.column_stack([np.bincount(track, term, tracks) for term in terms.T])


def mean_length(sums: Floats) -> tuple[Floats, Floats]:
    """(T,) m; the mean weighted by the variances, from sums (T, 4) of `length_terms`, and its standard deviation.

    That is the one of a row, since errors last, or as large as lengths that contradict each other say. NaN where
    nothing is known.
    """
    known = np.where(sums[:, 3:] > 0, sums, np.nan)
    weight, by_length, by_square, rows = known.T
    mean = by_length / weight
    apart = (by_square - by_length * mean) / rows  # mean square about it, 1 where errors are as stated
    return mean, np.sqrt(rows / weight * np.maximum(apart, 1.0))


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
