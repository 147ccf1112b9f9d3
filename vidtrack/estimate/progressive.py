"""Progressive correction: a measurement far from the particles acts in powers of its likelihood, one after another.

Weighted at once, all particles but a few would be lost, and the covariance with them. By powers they move to the
measurement step by step (progressive correction, Oudjane and Musso 2000). After each power they are drawn again from
the normal distribution of the same mean and covariance (as in the Gaussian particle filter, Kotecha and Djuric 2003):
what is far from all particles is so by their tail, of which they do not know the shape. Where enough particles remain
when the rest of the likelihood acts at once, it does, and they are resampled as they are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays.rows import starts
from vidtrack.arrays.types import Floats, Ints
from vidtrack.decision import Decision

STEPS = 100
"""After so many powers the rest of the likelihood acts at once; no gate lets so far a measurement through."""
_EFFECTIVE = 0.5  # share of the particles that one power leaves effective
_HALVINGS = 16
_LEAST = 1e-30  # power


class Parts(NamedTuple):
    """The densities that a decision mixes in some of its rows: one a measurement, and one of a miss.

    row     (C,) the row of each, in order
    share   (C,) its share of the row
    start   (C + 1,) from which of the pairs (B,) on its own begin; those of one part act as one measurement
    measurement, beta   (B,) with these powers
    """

    row: Ints
    share: Floats
    start: Ints
    measurement: Ints
    beta: Floats

    @classmethod
    def of(cls, decision: Decision, rows: Ints) -> Parts:
        """Those of these rows (K,)."""
        begin = starts(decision.row, len(decision.parent))
        pairs = np.concatenate([np.arange(begin[row], begin[row + 1]) for row in rows.tolist()])
        measurement, beta = decision.measurement[pairs], decision.beta[pairs]
        count = (begin[1:] - begin[:-1])[rows]
        if not decision.spread:
            return cls(rows, np.ones(len(rows)), np.concatenate([[0], count.cumsum()]), measurement, beta)
        missed = rows[decision.beta0[rows] > 0]
        row = np.concatenate([decision.row[pairs], missed])
        share = np.concatenate([beta, decision.beta0[missed]])
        holds = np.concatenate([np.ones(len(pairs), np.int64), np.zeros(len(missed), np.int64)])
        order = row.argsort(kind="stable")
        start = np.concatenate([[0], holds[order].cumsum()])
        return cls(row[order], share[order], start, measurement, np.ones(len(pairs)))

    def mixture(self, particles: Floats) -> Floats:
        """(K, N, n) particles of each row, as many of each part (C, N, n) as its share says."""
        number = particles.shape[1]
        mixed = []
        for row in dict.fromkeys(self.row.tolist()):
            own = np.flatnonzero(self.row == row)
            ends = np.rint(number * self.share[own].cumsum() / self.share[own].sum()).astype(np.int64)
            counts = np.diff(ends, prepend=0)
            mixed.append(np.concatenate([_evenly(particles[c], n) for c, n in zip(own, counts, strict=True)]))
        return np.stack(mixed)


def _evenly(particles: Floats, count: int) -> Floats:
    """So many of the particles (N, n), evenly spread over their order: those of one mode may stand together."""
    return particles[((np.arange(count) + 0.5) * (len(particles) / max(count, 1))).astype(np.int64)]


def effective(weight: Floats) -> Floats:
    """(K,) effective numbers of particles with weights (K, N): 1 / sum of w^2."""
    return np.asarray(1.0 / np.einsum("kn,kn->k", weight, weight))


def weighed(log_weight: Floats, gain: Floats, power: Floats) -> Floats:
    """(C, N) logarithms of the weights after a power (C,) of likelihoods with logarithms `gain` (C, N)."""
    log_weight = log_weight + power[:, None] * gain
    log_weight -= log_weight.max(axis=1, keepdims=True)
    return np.asarray(log_weight - np.log(np.exp(log_weight).sum(axis=1, keepdims=True)))


def powers(log_weight: Floats, gain: Floats, left: Floats, least: float) -> Floats:
    """(C,) `left` (C,), where such a power leaves a share `least` effective, else the largest that leaves half."""
    number = log_weight.shape[1]
    low, high = np.full(len(left), np.log(_LEAST)), np.log(left)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        fits = effective(np.exp(weighed(log_weight, gain, np.exp(middle)))) >= _EFFECTIVE * number
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
    return np.where(effective(np.exp(weighed(log_weight, gain, left))) >= least * number, left, np.exp(low))
