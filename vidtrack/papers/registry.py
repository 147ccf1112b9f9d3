"""Names and modules of the experiments. A module is imported only when its experiment runs."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module

from vidtrack.errors import ConfigError
from vidtrack.papers.result import Result


@dataclass(frozen=True, slots=True)
class Experiment:
    """A figure or table of a paper: a module of this package with `reproduce(runs, seed)`, and a description."""

    module: str
    title: str

    def results(self, runs: int | None = None, seed: int = 0) -> Iterator[Result]:
        """Run the experiment: the result, before it in long experiments those of what is done by then.

        runs  Monte Carlo runs or simulated videos; None: as many as the claim needs
        """
        reproduce = import_module(f"vidtrack.papers.{self.module}").reproduce
        found: Result | Iterator[Result] = reproduce(runs, seed)
        yield from (found,) if isinstance(found, Result) else found


EXPERIMENTS = {
    "000-fig1": Experiment("p000.fig1", "The best P_F scan by scan, in closed form and exactly"),
    "000-fig2": Experiment("p000.fig2", "Error of a PDAF with a fixed threshold and with the best one"),
    "001-fig2": Experiment("p001.fig2", "Two close tracks, four observations: gates and association"),
    "001-fig3": Experiment("p001.fig3", "The gate shrinks as observations come in"),
    "001-fig4": Experiment("p001.fig4", "Two close targets by nearest neighbour"),
    "001-fig5": Experiment("p001.fig5", "Two close targets by branching"),
    "002-fig1": Experiment("p002.fig1", "Predicted and actual error of a PSNF, by SNR and threshold"),
    "002-fig2": Experiment("p002.fig2", "Predicted and actual error of a PSNF in Weibull clutter"),
    "003-fig7": Experiment("p003.fig7", "An incoming aircraft through particle and Kalman filters"),
    "003-fig8": Experiment("p003.fig8", "Histogram of its range errors"),
    "003-fig9": Experiment("p003.fig9", "An altitude manoeuvre through particle and Kalman filters"),
    "003-fig10": Experiment("p003.fig10", "Histogram of its elevation errors"),
    "003-table2": Experiment("p003.table2", "Mean range error in a 2.5 g manoeuvre, by filter"),
    "004-fig1": Experiment("p004.fig1", "A measurement nearer to one target and more probable for the other"),
    "004-fig2": Experiment("p004.fig2", "The confidence region of a moving target's predicted position"),
    "004-fig3": Experiment("p004.fig3", "Crossing targets: who takes which measurement, by distance and by region"),
    "004-fig5": Experiment("p004.fig5", "Two crossing objects in a video: minimum distance against confidence region"),
    "004-fig6": Experiment("p004.fig6", "Nine objects in a video: minimum distance against confidence region"),
    "004-fig7": Experiment("p004.fig7", "T-junction: the grey car covers the stop line"),
    "004-fig8": Experiment("p004.fig8", "T-junction: the stop line's ghost after the grey car has passed"),
    "004-fig9": Experiment("p004.fig9", "T-junction: the white car and the stop line's ghost"),
    "004-montecarlo": Experiment(
        "p004.montecarlo", "Shares of swapped, merged and lost tracks, thousands of crossings"
    ),
}


def choose(names: Iterable[str]) -> dict[str, Experiment]:
    """The experiments of these names; all if none are given. Raises ConfigError for unknown names, with the nearest."""
    chosen = {}
    for name in names or EXPERIMENTS:
        if name not in EXPERIMENTS:
            near = difflib.get_close_matches(name, EXPERIMENTS, n=1, cutoff=0.5)
            hint = f"did you mean {near[0]}?" if near else "vidtrack reproduce --list shows all"
            raise ConfigError(f"there is no experiment {name!r}; {hint}")
        chosen[name] = EXPERIMENTS[name]
    return chosen
