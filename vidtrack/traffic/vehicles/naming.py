"""The class of a vehicle: of a whole track, and while it is tracked, by the lengths of its track so far."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.traffic.lengths import UNKNOWN, length_terms, mean_length
from vidtrack.traffic.vehicles.classes import CLASSES, Classified, classified, named, named_by_length


@dataclass(frozen=True, slots=True, eq=False)
class Named:
    """T whole tracks: length (T,) m, their classes, None where nothing tells one, and how likely these are (T,)."""

    length: Floats
    kind: list[str | None]
    probability: Floats


def whole_tracks(
    found: Classified | None, length: Floats, sigma: Floats, bounds: dict[str, tuple[float, float]]
) -> Named:
    """The classes of whole tracks by what was fitted to them; a site's, where nothing was, by the mean of their rows.

    length, sigma  (T,) m; mean lengths of the rows, and their standard deviations
    bounds         low and high length of each class of the site [m]; empty: those of `classes.CLASSES`
    """
    if found is not None:
        fitted = np.isfinite(found.size[:, 0])
        length, sigma = np.where(fitted, found.size[:, 0], length), np.where(fitted, found.sigma[:, 0], sigma)
    if bounds:
        names, probability = named_by_length(length, sigma, bounds)
        return Named(length, [*names], probability)
    if found is None:
        return Named(length, [None] * len(length), np.full(len(length), np.nan))
    return Named(length, *named(found))


def likeliest(found: Classified | None, length: Floats, sigma: Floats) -> list[str]:
    """(T,) of `classes.CLASSES` the likeliest of each whole track, however unsure; arguments as in `whole_tracks`."""
    probability = _by_length(length, sigma, np.zeros(len(length))).probability
    if found is not None:
        probability = np.where(np.isnan(found.probability), probability, found.probability)
    return [CLASSES[k] for k in probability.argmax(axis=1).tolist()]


def _by_length(length: Floats, sigma: Floats, speed: Floats) -> Classified:
    """Vehicles of lengths (T,) and standard deviations (T,) m, NaN where they are not known, at speeds (T,) m/s."""
    known = np.isfinite(length)
    about, vector = np.zeros((len(length), 3, 3)), np.zeros((len(length), 3))
    about[known, 0, 0] = 1 / sigma[known] ** 2
    vector[known, 0] = length[known] / sigma[known] ** 2
    return classified(about, vector, speed)


class Naming:
    """Takes rows in order of time; remembers the sums over each track that is still there.

    classes  low and high length of each class of the site [m]; empty: those of `classes.CLASSES`
    """

    def __init__(self, classes: Mapping[str, tuple[float, float]]) -> None:
        self._classes = dict(classes)
        self._sums: dict[int, Floats] = {}

    def named(
        self, track: Ints, length: Floats, sigma: Floats, speed: Floats, hidden: Mask
    ) -> tuple[NDArray[np.str_], Floats, Floats]:
        """(N,) classes, UNKNOWN where none is sure; (N,) m, the mean lengths of the tracks so far and their errors.

        Before a track has a length its class is "", and its mean NaN.

        track (N,), length and sigma (N,) m, NaN where it is not known, speed (N,) m/s; hidden (N,) who adds nothing
        """
        mean, error = mean_length(self._added(track, length_terms(length, sigma, hidden)))
        known = np.isfinite(mean)
        names = np.full(len(track), "", dtype=object)
        names[known] = self._class_of(mean[known], error[known], np.nan_to_num(speed[known]))
        return names.astype(str), mean, error

    def _class_of(self, mean: Floats, sigma: Floats, speed: Floats) -> list[str]:
        if self._classes:
            return named_by_length(mean, sigma, self._classes)[0]
        return [name or UNKNOWN for name in named(_by_length(mean, sigma, speed))[0]]

    def _added(self, track: Ints, terms: Floats) -> Floats:
        """(N, K) sums of the terms (N, K) of each track to each row; those of tracks that are gone are forgotten."""
        ids = np.unique(track)
        nothing = np.zeros(terms.shape[1])
        before = np.array([self._sums.get(one, nothing) for one in ids.tolist()]).reshape(-1, terms.shape[1])
        order = np.argsort(track, kind="stable")
        running = np.cumsum(terms[order], axis=0)
        first = np.searchsorted(track[order], ids)
        slot = np.searchsorted(ids, track[order])
        running += (before + terms[order][first] - running[first])[slot] if len(ids) else 0
        sums = np.empty_like(terms)
        sums[order] = running
        ends = np.append(first[1:], len(track)) - 1
        self._sums = dict(zip(ids.tolist(), running[ends], strict=True)) if len(ids) else {}
        return sums
