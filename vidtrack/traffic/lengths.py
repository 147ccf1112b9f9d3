"""The length of a vehicle from all rows of its track, and its class: of finished runs, of rows, and live."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import inlined, kernel

UNKNOWN = "unknown"
"""The class of a vehicle of which none is sure."""
_LEAST_SIGMA_M = 0.01
"""m; to which lengths are known at best"""


@kernel
def length_terms(length: Floats, sigma: Floats, hidden: Mask) -> Floats:
    """(N, 4) what rows add to the mean length of their track: 1 / sigma^2, times length, times length^2, and 1.

    0 of rows whose length is not known or, hidden (N,), not that of the whole vehicle.

    length, sigma  (N,) m
    """
    terms = np.zeros((len(length), 4))
    for i in range(len(length)):
        _add_term(terms, i, length[i], sigma[i], hidden[i])
    return terms


@kernel
def add_lengths(sums: Floats, track: Ints, length: Floats, sigma: Floats, hidden: Mask) -> None:
    """Add `length_terms` of rows to the sums (T, 4) of their tracks (N,)."""
    for i in range(len(track)):
        _add_term(sums, track[i], length[i], sigma[i], hidden[i])


@inlined
def _add_term(sums: Floats, k: int, length: float, sigma: float, hidden: bool) -> None:
    """Add what a row says to the sums in row k of a table (T, 4)."""
    weight = 1 / max(sigma * sigma, _LEAST_SIGMA_M**2)
    by_square = weight * length * length
    if not (hidden or np.isnan(sigma) or np.isnan(length)) and np.isfinite(by_square):
        sums[k, 0] += weight
        sums[k, 1] += weight * length
        sums[k, 2] += by_square
        sums[k, 3] += 1.0


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
