"""Probabilistic data association: all measurements in the gate, weighted by their probabilities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.problem import Problem
from vidtrack.associate.widening import widening
from vidtrack.compiled import kernel
from vidtrack.decision import Decision


@dataclass(frozen=True, slots=True)
class PDA:
    """Probabilistic data association (paper 000, eqs. 9 to 14), parametric: the clutter density is known.

    The weights of "missed" and of the gated measurements sum to one for each track, independent of other tracks.

    inflate       widen the missed branch for targets outside the gate (SPEC 000, correction 8); without it the filter
                  is 15 % optimistic with a gate of 2 sigma, 0.2 % with 4 sigma
    gated_births  a measurement in a gate may start a track if its weights are small
    """

    inflate: bool = False
    gated_births: bool = True

    def decide(self, problem: Problem) -> Decision:
        """beta_i = e_i / (b + sum e), beta0 = b / (b + sum e), in logarithms."""
        pairs = problem.pairs
        beta, beta0 = _shared_out(pairs.start, problem.log_ratio, problem.log_missed)
        return Decision(
            parent=np.arange(problem.rows),
            row=pairs.row,
            measurement=pairs.measurement,
            beta=beta,
            beta0=beta0,
            inflation=widening(problem, problem.detection * problem.inside) if self.inflate else None,
        )


@kernel
def _shared_out(start: Ints, log_pair: Floats, log_miss: Floats) -> tuple[Floats, Floats]:
    """(N,) weights of the pairs and (T,) of the misses; they sum to one in each row."""
    beta, beta0 = np.empty(len(log_pair)), np.empty(len(log_miss))
    for t in range(len(log_miss)):
        most = log_miss[t]
        for k in range(start[t], start[t + 1]):
            most = max(most, log_pair[k])
        beta0[t] = np.exp(log_miss[t] - most)
        pairs = 0.0
        for k in range(start[t], start[t + 1]):
            beta[k] = np.exp(log_pair[k] - most)
            pairs += beta[k]
        total = beta0[t] + pairs
        for k in range(start[t], start[t + 1]):
            beta[k] /= total
        beta0[t] /= total
    return beta, beta0
