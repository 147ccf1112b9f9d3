"""What a vehicle is, by its size and speed: Bayes' rule over a few classes, each with normal sizes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from vidtrack.arrays.types import Floats, Ints
from vidtrack.traffic.lengths import UNKNOWN, class_of

CLASSES = ("motorcycle or bicycle", "person", "car", "van", "lorry or bus")
SURE = 0.8
"""Probability from which on a class is named."""


@dataclass(frozen=True, slots=True)
class Kind:
    """Mean and standard deviation of length, width, height [m] as a cuboid shows them, and of the speed [m/s].

    share  of the traffic
    speed  None: any
    """

    share: float
    mean: tuple[float, float, float]
    sigma: tuple[float, float, float]
    speed: tuple[float, float] | None = None


KINDS = (
    Kind(0.06, (2.0, 0.75, 1.5), (0.45, 0.2, 0.25)),
    Kind(0.04, (0.5, 0.55, 1.65), (0.3, 0.2, 0.2), (1.4, 0.8)),
    Kind(0.70, (4.3, 1.75, 1.25), (0.6, 0.25, 0.2)),
    Kind(0.10, (5.5, 1.95, 2.25), (0.8, 0.25, 0.3)),
    Kind(0.08, (10.0, 2.5, 3.2), (3.5, 0.25, 0.4)),
    Kind(0.02, (4.0, 2.0, 2.0), (4.0, 1.5, 1.5)),
)
"""Of CLASSES, and last of what is none of them, as two vehicles in one blob. A cuboid around a car is lower than the
car, since roofs are narrower than bodies; the standard deviations hold what cuboids are off by."""
_FASTEST = 40.0
"""m/s; up to which any speed is as likely where a kind has none"""


@dataclass(frozen=True, slots=True, eq=False)
class Classified:
    """T vehicles: probability (T, len(CLASSES)), and size (T, 3), sigma (T, 3) m with all of them considered."""

    probability: Floats
    size: Floats
    sigma: Floats

    def of(self, vehicle: Ints) -> Classified:
        """Those of some vehicles (N,)."""
        return Classified(self.probability[vehicle], self.size[vehicle], self.sigma[vehicle])


def named(found: Classified) -> tuple[list[str | None], Floats]:
    """(T,) the likeliest class of each vehicle, UNKNOWN where none is sure; (T,) its probability."""
    best = np.nan_to_num(found.probability).max(axis=1)
    number = np.where(best >= SURE, np.nan_to_num(found.probability).argmax(axis=1), len(CLASSES))
    names = [*CLASSES, UNKNOWN]
    return [names[k] for k in number.tolist()], np.where(np.isnan(found.size[:, 0]), np.nan, best)


def named_by_length(length: Floats, sigma: Floats, bounds: dict[str, tuple[float, float]]) -> tuple[list[str], Floats]:
    """(T,) the class of each vehicle by a site's bounds, UNKNOWN where none is sure; (T,) its probability.

    length, sigma (T,) m; NaN where they are not known
    """
    names = class_of(length, bounds)
    low, high = np.array([bounds.get(name or "", (np.nan, np.nan)) for name in names]).reshape(-1, 2).T
    inside = np.asarray(ndtr((high - length) / sigma) - ndtr((low - length) / sigma))
    sure = (inside >= SURE).tolist()
    return [name if name and known else UNKNOWN for name, known in zip(names, sure, strict=True)], inside


def classified(information: Floats, vector: Floats, speed: Floats) -> Classified:
    """The classes of vehicles whose boxes say exp(-s' A s / 2 + b' s) about their size s [m].

    information (T, 3, 3) A, vector (T, 3) b; speed (T,) m/s
    """
    logs, sizes, variances = zip(*(evidence(kind, information, vector, speed) for kind in KINDS), strict=True)
    probability = np.exp(np.array(logs) - np.max(logs, axis=0))
    probability /= probability.sum(axis=0)
    size = np.einsum("kt,kti->ti", probability, sizes)
    square = np.einsum("kt,kti->ti", probability, np.array(variances) + np.square(sizes))
    return Classified(probability[:-1].T, size, np.sqrt(np.maximum(square - size**2, 0)))


def evidence(kind: Kind, information: Floats, vector: Floats, speed: Floats) -> tuple[Floats, Floats, Floats]:
    """(T,) logarithm of share and likelihood of a kind, (T, 3) the sizes if it is this kind, and their variances.

    The integral of the normal density of the kind's sizes times exp(-s' A s / 2 + b' s).
    """
    mean, prior = np.array(kind.mean), np.diag(1 / np.square(kind.sigma))
    cov, det = _inverse(information + prior)
    b = vector + prior @ mean
    size = np.einsum("tij,tj->ti", cov, b)
    log = np.log(kind.share) + (np.einsum("ti,ti->t", b, size) - mean @ prior @ mean) / 2
    log -= (np.log(det) + 2 * np.log(kind.sigma).sum()) / 2
    if kind.speed is None:
        log -= np.log(_FASTEST)
    else:
        walk, sigma = kind.speed
        log -= ((speed - walk) / sigma) ** 2 / 2 + np.log(np.sqrt(2 * np.pi) * sigma)
    return log, size, np.diagonal(cov, axis1=1, axis2=2)


def _inverse(matrix: Floats) -> tuple[Floats, Floats]:
    """(T, 3, 3) inverses of symmetric matrices by their cofactors, and (T,) determinants.

    Good to 5e-8 for information of up to 1e6 per m^2, which errors of shape do not let a vehicle reach.
    """
    cofactor = np.cross(matrix[:, [1, 2, 0]], matrix[:, [2, 0, 1]])
    det = np.einsum("ti,ti->t", matrix[:, 0], cofactor[:, 0])
    return cofactor / det[:, None, None], det
