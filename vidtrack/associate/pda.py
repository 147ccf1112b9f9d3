"""Probabilistic data association: all measurements in the gate, each by its probability."""

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

    Each track shares out one detection among "missed" and its gated measurements, whatever other tracks do.

    inflate       widen the missed branch by what the gate cuts off (SPEC 000, correction 8); it matters for small
                  gates: at 2 sigma the filter is 15 % optimistic without, at 4 sigma 0.2 %
    gated_births  a measurement in a gate may start a track if the tracks hardly claim it
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
    """(N,) and (T,) weights of the pairs and misses, which sum to one in each row."""
    beta, beta0 = np.empty(len(log_pair)), np.empty(len(log_miss))
    for t in range(len(log_miss)):
        mine = slice(start[t], start[t + 1])
        most = log_miss[t]
        for k in range(start[t], start[t + 1]):
            most = max(most, log_pair[k])
        beta[mine] = np.exp(log_pair[mine] - most)
        beta0[t] = np.exp(log_miss[t] - most)
        total = beta0[t] + beta[mine].sum()
        beta[mine] /= total
        beta0[t] /= total
    return beta, beta0
