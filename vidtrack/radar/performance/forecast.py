"""A filter's error in clutter: predicted by two formulas, and simulated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from vidtrack.amplitude.densities import RAYLEIGH, Weibull
from vidtrack.amplitude.reduction import KE_DIM, KE_GATE
from vidtrack.amplitude.strongest import Strongest
from vidtrack.arrays.types import Floats, Ints
from vidtrack.radar.performance.prediction import (
    Factor,
    Scenario,
    normalised,
    pda_factor,
    position_error,
    predict,
    psn_factor,
    steady_state,
)

Kind = Literal["psn", "pda"]

LIMIT: dict[Kind, float] = {"psn": 20.0, "pda": 10.0}
"""Position error above which a track is lost, in units of sqrt(r), as in each paper."""


@dataclass(frozen=True, slots=True, eq=False)
class Forecast:
    """Position errors sqrt(P11 + P33 + ...).

    kind, scenario, law   filter, target and radar; law.p_d is the probability of detection
    scan    (scans,) 1, 2, ...
    error   errors (scans,) by each formula; None outside its range of validity
    steady  steady-state error by each formula; None: it grows without bound, or the formula is not valid
    """

    kind: Kind
    scenario: Scenario
    law: Strongest
    scan: Ints
    error: dict[str, Floats | None]
    steady: dict[str, float | None]


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """Simulated runs: actual_all (scans,) RMS error of all runs, actual_kept of the runs never above `limit`."""

    runs: int
    limit: float
    loss_share: float
    loss_share_se: float
    strayed_share: float
    actual_all: Floats
    actual_kept: Floats | None


def forecast(
    kind: Kind, snr: float, p_fa: float, clutter: Weibull, q: float, gate: float, cell_volume: float, scans: int
) -> Forecast:
    """In normalised units (`prediction.normalised`); snr linear. Raises ConfigError for values out of range."""
    scenario = normalised(q, gate, cell_volume)
    law = Strongest(snr, p_fa, clutter, scenario.dim, gate)
    factors: dict[str, Factor | None]
    if kind == "psn":
        factors = {mode: psn_factor(scenario, snr, p_fa, clutter, mode) for mode in ("paper", "corrected")}
    else:
        fitted = (scenario.dim, gate) == (KE_DIM, KE_GATE)
        factors = {
            "kershaw_evans": pda_factor(scenario, law.p_d, p_fa, fit=True) if fitted else None,
            "exact": pda_factor(scenario, law.p_d, p_fa),
        }
    error: dict[str, Floats | None] = {}
    steady: dict[str, float | None] = {}
    for name, factor in factors.items():
        settled = None if factor is None else steady_state(scenario, factor)
        error[name] = None if factor is None else position_error(scenario, predict(scenario, factor, scans))
        steady[name] = None if settled is None else float(position_error(scenario, settled))
    return Forecast(kind, scenario, law, np.arange(1, scans + 1), error, steady)


def trial(expected: Forecast, runs: int, seed: int) -> Trial:
    """Simulate the filter and radar of a forecast in `runs` tracks."""
    from vidtrack.associate.pda import PDA
    from vidtrack.associate.strongest import PSN
    from vidtrack.radar.performance.in_gate import AllPlots, StrongestPlot
    from vidtrack.radar.performance.monte_carlo import root_mean_square, simulate

    scenario, law, limit = expected.scenario, expected.law, LIMIT[expected.kind]
    rng, scans = np.random.default_rng(seed), len(expected.scan)
    if expected.kind == "psn":
        strongest = StrongestPlot(law, scenario.cell_volume)
        outcome = simulate(scenario, strongest, PSN(law.snr, law.clutter), scans=scans, runs=runs, rng=rng)
    else:
        plots = AllPlots(law.snr, law.p_fa, scenario.cell_volume, law.clutter)
        outcome = simulate(scenario, plots, PDA(), scans=scans, runs=runs, rng=rng)
    lost, strayed = float(outcome.lost(limit).mean()), outcome.strayed(limit)
    kept = outcome.error[:, ~strayed]
    return Trial(
        runs,
        limit,
        lost,
        float(np.sqrt(lost * (1 - lost) / runs)),
        float(strayed.mean()),
        root_mean_square(outcome.error)[0],
        root_mean_square(kept)[0] if kept.size else None,
    )


def first_trial(kind: Kind) -> None:
    """Simulate a few runs of a filter: a rehearsal of `trial`."""
    trial(forecast(kind, 40.0, 0.1, RAYLEIGH, 0.01, 4.0, 1.0, scans=3), runs=3, seed=0)
