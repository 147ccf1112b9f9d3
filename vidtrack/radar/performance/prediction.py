"""Predicted covariance of a track in clutter: modified Riccati equation, hybrid conditional averaging (HYCA).

Every prediction is the recursion P = P^- - q K S K'. The factor q in 0..1 follows from the volume of the gate: q2 for a
PDAF (paper 000), its counterpart for a PSNF (paper 002). If q falls as the gate grows, the error can grow without
bound; the prediction then has no steady state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vidtrack.amplitude.densities import RAYLEIGH, Weibull
from vidtrack.amplitude.reduction import KE_DIM, KE_GATE, LEAST_GATE, MOST_GATE, gate_volume, q2, q2_fit
from vidtrack.amplitude.strongest import Strongest
from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError
from vidtrack.estimate.motion.model import Motion
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.estimate.sensor import POSITION

Factor = Callable[[float], float]
"""q of a gate of n = V / V_c resolution cells."""


@dataclass(frozen=True, eq=False)
class Scenario:
    """Target, radar and gate; the plots are positions.

    model        motion model of the target
    R            (m, m) covariance of a plot
    P0           (n, n) covariance after the initialisation
    gate         g [standard deviations]
    cell_volume  V_c, volume of a resolution cell in the units of R
    dt           time from scan to scan [s]
    """

    model: Motion
    R: Floats
    P0: Floats
    gate: float
    cell_volume: float
    dt: float = 1.0

    @property
    def dim(self) -> int:
        """m, components of a plot."""
        return self.model.dim

    @cached_property
    def F(self) -> Floats:  # noqa: N802
        """(n, n)."""
        return self.model.transition(self.dt, np.zeros((1, self.model.states)))[0]

    @cached_property
    def Q(self) -> Floats:  # noqa: N802
        """(n, n)."""
        one = np.ones(1)
        return self.model.process_noise(
            self.dt, np.zeros((1, self.model.states)), self.P0[None], one.astype(np.int64), one
        )[0]

    @cached_property
    def H(self) -> Floats:  # noqa: N802
        """(m, n)."""
        return POSITION.H(np.zeros((1, self.model.states)), self.model.position)[0]


def normalised(q: float, gate: float, cell_volume: float, dim: int = 2) -> Scenario:
    """Nearly constant velocity with T = 1 and R = I, initialised from two points (paper 002, section V).

    q: variance of the acceleration in units of r / T^4. Raises ConfigError for values out of range.
    """
    for name, value, low, high in (
        ("q", q, 1e-9, 1e9),
        ("gate", gate, LEAST_GATE, MOST_GATE),
        ("cell volume", cell_volume, 1e-9, 1e9),
    ):
        if not low <= value <= high:
            raise ConfigError(f"{name} is {value:g}; it must lie in {low:g}..{high:g}")
    axes: Floats = np.eye(dim)
    two_points: Floats = np.kron(axes, np.array([[1.0, 1.0], [1.0, 2.0]]))
    return Scenario(ConstantVelocity(dim, accel=float(np.sqrt(q))), axes, two_points, gate, cell_volume)


def pda_factor(scenario: Scenario, p_d: float, p_fa: float, fit: bool = False) -> Factor:
    """q2 of a PDAF; fit: by Kershaw and Evans' formula, not exact.

    Raises ConfigError for the fit outside 2 dimensions and gate 4.
    """
    if fit and (scenario.dim, scenario.gate) != (KE_DIM, KE_GATE):
        raise ConfigError(
            f"Kershaw and Evans' fit holds for 2 dimensions and gate 4, not {scenario.dim} and {scenario.gate:g}; "
            "use the exact factor"
        )
    if fit:
        return lambda cells: float(q2_fit(p_d, p_fa * cells))
    return lambda cells: float(q2(p_d, p_fa * cells, scenario.dim, scenario.gate))


def psn_factor(
    scenario: Scenario, snr: float, p_fa: float, clutter: Weibull = RAYLEIGH, mode: str = "corrected"
) -> Factor:
    """q of a PSNF for HYCA.

    mode  "paper": eq. (33) as printed, a lower bound of the error; "corrected": the mean of the filter's covariance,
          eq. (24)
    """
    strongest = Strongest(snr, p_fa, clutter, scenario.dim, scenario.gate)
    if mode not in ("paper", "corrected"):
        raise ConfigError(f"the PSNF's prediction is {mode!r}; choose paper or corrected")
    return strongest.factor if mode == "corrected" else strongest.factor_paper


def advance(scenario: Scenario, factor: Factor, P: Floats) -> Floats:
    """Expected covariance (n, n) after the update, from the covariance P after the last update."""
    P = scenario.F @ P @ scenario.F.T + scenario.Q
    PH = P @ scenario.H.T
    S = scenario.H @ PH + scenario.R
    q = factor(float(gate_volume(S, scenario.gate)) / scenario.cell_volume)
    P = P - q * PH @ np.linalg.solve(S, PH.T)
    return np.asarray((P + P.T) / 2)


def predict(scenario: Scenario, factor: Factor, scans: int) -> Floats:
    """Expected covariances (scans, n, n) after the updates of scans 1, 2, ..."""
    P, history = scenario.P0, []
    for _ in range(scans):
        P = advance(scenario, factor, P)
        history.append(P)
    return np.array(history)


def position_error(scenario: Scenario, P: Floats) -> Floats:
    """sqrt(P11 + P33 + ...) of covariances (..., n, n): the expected root mean square position error."""
    return np.asarray(np.sqrt(np.diagonal(P, axis1=-2, axis2=-1)[..., scenario.model.position].sum(axis=-1)))


def steady_state(scenario: Scenario, factor: Factor, tolerance: float = 1e-9, most: int = 2000) -> Floats | None:
    """The steady-state covariance (n, n); None if the recursion has not converged after `most` scans."""
    P = scenario.P0
    for _ in range(most):
        before, P = P, advance(scenario, factor, P)
        if np.abs(P - before).max() <= tolerance * np.abs(P).max():
            return P
    return None
