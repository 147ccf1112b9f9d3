"""Generalized nearest neighbour: the mean of the gated measurements with weights 1 / distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.problem import Problem
from vidtrack.compiled import kernel
from vidtrack.decision import Decision


@dataclass(frozen=True, slots=True)
class GeneralizedNN:
    """Generalized nearest neighbour (SPEC 001): the mean of the gated measurements with weights 1 / d.

    d is the square root of d2. The filter is updated as by one measurement, without a weight for a miss and without
    spread, so the covariance is too small in clutter.

    gated_births  off: every measurement in a gate is used, so none starts a track
    """

    gated_births: bool = False

    def decide(self, problem: Problem) -> Decision:
        """alpha_i = (1 / d_i) / sum(1 / d_j); measurements at distance zero take all the weight."""
        pairs = problem.pairs
        return Decision(
            parent=np.arange(problem.rows),
            row=pairs.row,
            measurement=pairs.measurement,
            beta=_by_nearness(pairs.start, pairs.d2),
            beta0=(np.diff(pairs.start) == 0).astype(float),
            spread=False,
        )


@kernel
def _by_nearness(start: Ints, d2: Floats) -> Floats:
    """(N,) weights of the pairs, scaled by the nearest of each row to avoid overflow."""
    alpha = np.empty(len(d2))
    for t in range(len(start) - 1):
        mine = slice(start[t], start[t + 1])
        if start[t] == start[t + 1]:
            continue
        nearest = d2[mine].min()
        for k in range(start[t], start[t + 1]):
            alpha[k] = np.sqrt(nearest / d2[k]) if nearest > 0.0 else 1.0 * (d2[k] == 0.0)
        alpha[mine] /= alpha[mine].sum()
    return alpha
