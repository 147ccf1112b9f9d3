"""Figure 10: histogram of the elevation errors of figure 9."""

from __future__ import annotations

import numpy as np

from vidtrack.papers import style
from vidtrack.papers.p003.drawing import histogram, histogram_rows, summary
from vidtrack.papers.p003.experiment import RUNS
from vidtrack.papers.p003.scenario import study
from vidtrack.papers.result import Result
from vidtrack.simulate.radar_scenarios import altitude

CLAIM = "particle filter within 0.007 degrees, Kalman filter within 0.06 degrees, once settled"
PAPER = (
    ("the paper's particle filter: ±0.007 deg", 0.007, style.RED),
    ("the paper's Kalman filter: ±0.06 deg", 0.06, style.BLUE),
)
BINS = np.linspace(-0.14, 0.14, 71)
ELEVATION = 2


def reproduce(runs: int | None, seed: int) -> Result:
    """Run all filters on the same measurements."""
    rng = np.random.default_rng(seed)
    each = study(altitude(rng)[0].flight, RUNS if runs is None else runs, rng)
    kalman, particles = (each.half_width(name, ELEVATION) for name in ("Kalman, tuned", "particles, the paper's"))
    verdict = (
        f"95 % of a tuned Kalman filter's elevation errors are within {kalman:.3f} degrees and of the paper's particle "
        f"filter's within {particles:.3f}; no filter here comes within 0.007 degrees, for which the paper's "
        f"measurements must be much better than 0.04 degrees; mean errors: {summary(each, ELEVATION)}."
    )
    return Result(histogram(each, ELEVATION, BINS, PAPER), histogram_rows(each, ELEVATION, BINS, CLAIM), verdict)
