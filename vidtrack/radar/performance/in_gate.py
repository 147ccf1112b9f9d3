"""Simulated plots in the gates of many independent runs: target and clutter.

A single-target filter uses the plots in its gate only, so clutter is drawn only there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.amplitude.densities import RAYLEIGH, Weibull, detection_probability
from vidtrack.amplitude.reduction import gate_volume
from vidtrack.amplitude.strongest import Strongest
from vidtrack.amplitude.threshold import ThresholdController
from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.scan import Scan

MOST_CLUTTER = 1000.0
"""If more false plots than this are expected in a gate, no plot is drawn there: the scan carries no information."""


@dataclass(frozen=True, slots=True, eq=False)
class Gates:
    """The gates of T runs at one time, and the target's measurement of each run.

    zhat (T, m), S (T, m, m); gate g [standard deviations]; target (T, m)
    """

    zhat: Floats
    S: Floats
    gate: float
    target: Floats

    @property
    def volume(self) -> Floats:
        """(T,) volume of each gate."""
        return gate_volume(self.S, self.gate)

    @property
    def holds_target(self) -> Mask:
        """(T,) gates that contain the target's measurement."""
        v = self.target - self.zhat
        d2 = np.einsum("ti,ti->t", v, np.linalg.solve(self.S, v[..., None])[..., 0])
        return np.asarray(d2 < self.gate**2)

    def uniform(self, rng: np.random.Generator, run: Ints) -> Floats:
        """(N, m) points, each uniform in the gate of its run (N,)."""
        dim = self.zhat.shape[1]
        point = rng.standard_normal((len(run), dim))
        point *= (self.gate * rng.random(len(run)) ** (1 / dim) / np.linalg.norm(point, axis=1))[:, None]
        return self.zhat[run] + np.einsum("nij,nj->ni", np.linalg.cholesky(self.S)[run], point)


@dataclass(frozen=True, slots=True, eq=False)
class Plots:
    """A scan of all runs, with P_FA, P_D and clutter density (T,) for the associator."""

    scan: Scan
    p_fa: Floats
    p_d: Floats
    density: Floats


@dataclass(frozen=True, slots=True)
class AllPlots:
    """All plots above the threshold, for a PDAF; threshold: P_FA, fixed or by a controller from each S."""

    snr: float
    threshold: float | ThresholdController
    cell_volume: float
    clutter: Weibull = RAYLEIGH

    def draw(self, rng: np.random.Generator, t: float, gates: Gates, R: Floats) -> Plots:
        """Poisson clutter, uniform in each gate, and the target if it is detected in the gate."""
        runs = len(gates.zhat)
        level = self.threshold
        p_fa = level.p_fa(gates.S) if isinstance(level, ThresholdController) else np.full(runs, level)
        p_d = detection_probability(p_fa, self.snr, self.clutter)
        density = p_fa / self.cell_volume
        expected = density * gates.volume
        blind = expected > MOST_CLUTTER
        false = np.repeat(np.arange(runs), rng.poisson(np.where(blind, 0.0, expected)))
        hit = np.flatnonzero((rng.random(runs) < p_d) & gates.holds_target & ~blind)
        run = np.concatenate([hit, false])
        z = np.concatenate([gates.target[hit], gates.uniform(rng, false)])
        return Plots(Scan(t, z, R, run=run, noise=R), p_fa, p_d, density)


@dataclass(frozen=True, slots=True)
class StrongestPlot:
    """The strongest detection of each gate, for a strongest neighbour filter (paper 002)."""

    strongest: Strongest
    cell_volume: float

    def draw(self, rng: np.random.Generator, t: float, gates: Gates, R: Floats) -> Plots:
        """At most one plot a run, with its amplitude.

        The strongest false amplitude is drawn directly: with E exponential, it is exceeded in a cell with probability
        E V_c / V; it is a plot if that is below P_FA.
        """
        runs, law = len(gates.zhat), self.strongest
        share = rng.standard_exponential(runs) * self.cell_volume / gates.volume
        false = np.where(share < law.p_fa, law.clutter.threshold(np.minimum(share, 1.0)), 0.0)
        seen = (rng.random(runs) < law.p_d) & gates.holds_target
        echo = law.target.sample(rng, runs, above=law.clutter.threshold(law.p_fa))
        target = np.where(seen, echo, 0.0)
        amplitude = np.maximum(target, false)
        run = np.flatnonzero(amplitude > 0)
        z = np.where((target > false)[:, None], gates.target, gates.uniform(rng, np.arange(runs)))
        same = np.ones(runs)
        return Plots(
            Scan(t, z[run], R, amplitude=amplitude[run], run=run, noise=R),
            law.p_fa * same,
            law.p_d * same,
            law.p_fa / self.cell_volume * same,
        )
