"""The experiment of both figures: a PSNF in clutter, its predicted error and that of thousands of runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.amplitude.densities import RAYLEIGH, Weibull, linear
from vidtrack.amplitude.strongest import Strongest
from vidtrack.arrays.types import Floats
from vidtrack.associate.strongest import PSN, StrongestNeighbour
from vidtrack.papers.result import Row
from vidtrack.radar.performance.in_gate import StrongestPlot
from vidtrack.radar.performance.monte_carlo import Outcome, root_mean_square, simulate
from vidtrack.radar.performance.prediction import normalised, position_error, predict, psn_factor

RUNS = 10_000
"""The paper has 1,000 and 500; the share of lost tracks, which are rare, needs more."""

SCANS, LOST = 50, 20.0
SCENARIO = normalised(q=0.16, gate=4.0, cell_volume=0.1)


@dataclass(frozen=True, slots=True)
class Case:
    """One curve of a figure."""

    name: str
    snr_db: float
    p_fa: float
    clutter: Weibull = RAYLEIGH


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """A case with its predictions (SCANS,) and the runs of a PSNF and of the plain strongest neighbour filter."""

    case: Case
    printed: Floats
    corrected: Floats
    psn: Outcome
    sn: Outcome

    @property
    def kept(self) -> Floats:
        """(SCANS, kept runs) errors of the PSNF's runs that never were above LOST."""
        return self.psn.error[:, ~self.psn.strayed(LOST)]

    @property
    def lost(self) -> float:
        """Share of the PSNF's runs that are lost."""
        return float(self.psn.lost(LOST).mean())

    def excess(self, prediction: Floats) -> float:
        """Relative excess of the steady-state error of the kept runs, k = 20..50, over a prediction."""
        return float(np.sqrt(np.mean(self.kept[19:] ** 2)) / np.sqrt(np.mean(prediction[19:] ** 2)) - 1)

    def rows(self, claim: str) -> list[Row]:
        """The table: one row per scan."""
        case, (every, every_se) = self.case, root_mean_square(self.psn.error)
        kept, kept_se = root_mean_square(self.kept)
        expected, _ = root_mean_square(self.psn.expected)
        head: Row = {
            "case": case.name,
            "snr_db": case.snr_db,
            "p_fa": case.p_fa,
            "clutter_b": case.clutter.shape,
            "clutter_c": case.clutter.rate,
            "runs": self.psn.error.shape[1],
            "lost_share": self.lost,
            "above_20_share": float(self.psn.strayed(LOST).mean()),
            "snf_lost_share": float(self.sn.lost(LOST).mean()),
        }
        names = ("paper_33", "corrected", "actual_all", "actual_all_se", "actual_kept", "actual_kept_se", "filter_rms")
        columns = (self.printed, self.corrected, every, every_se, kept, kept_se, expected)
        return [
            head | {"k": k + 1} | {name: float(column[k]) for name, column in zip(names, columns, strict=True)}
            | {"paper_claim": claim}
            for k in range(SCANS)
        ]  # fmt: skip


def study(case: Case, runs: int, rng: np.random.Generator) -> Study:
    """Predict and simulate one case."""
    law = Strongest(linear(case.snr_db), case.p_fa, case.clutter, SCENARIO.dim, SCENARIO.gate)
    printed, corrected = (
        position_error(SCENARIO, predict(SCENARIO, psn_factor(SCENARIO, law.snr, law.p_fa, law.clutter, mode), SCANS))
        for mode in ("paper", "corrected")
    )
    radar = StrongestPlot(law, SCENARIO.cell_volume)
    psn, sn = (
        simulate(SCENARIO, radar, associate, scans=SCANS, runs=runs, rng=rng)
        for associate in (PSN(law.snr, law.clutter), StrongestNeighbour())
    )
    return Study(case, printed, corrected, psn, sn)
