"""The strongest detection in a gate: probabilities, and the reduction factor q of a PSNF.

PSNF: probabilistic strongest neighbour filter. All results depend on the gate only through n = V / V_c, its volume in
resolution cells (paper 002).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi

import numpy as np

from vidtrack.amplitude.densities import RAYLEIGH, Weibull, swerling1
from vidtrack.amplitude.reduction import LEAST_GATE, MOST_GATE, ball, gated, gated_spread
from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError

_X, _W = np.polynomial.legendre.leggauss(12)
_RADIUS, _RADIUS_WEIGHT = np.polynomial.legendre.leggauss(32)


@dataclass(frozen=True, slots=True)
class Strongest:
    """The strongest detection in a gate of `gate` standard deviations in `dim` dimensions.

    snr      linear SNR of the Swerling I target
    p_fa     probability of false alarm per resolution cell
    clutter  the clutter's amplitudes

    Raises ConfigError for a P_FA or gate out of range.
    """

    snr: float
    p_fa: float
    clutter: Weibull = RAYLEIGH
    dim: int = 2
    gate: float = 4.0

    def __post_init__(self) -> None:
        if not 0 < self.p_fa <= 1:
            raise ConfigError(f"P_FA is {self.p_fa}; it must lie above 0 and up to 1")
        if self.dim < 1 or not LEAST_GATE <= self.gate <= MOST_GATE:
            raise ConfigError(
                f"gate of {self.gate} standard deviations in {self.dim} dimensions; "
                f"take at least 1 and a gate in {LEAST_GATE}..{MOST_GATE}"
            )

    @property
    def target(self) -> Weibull:
        """Amplitudes of the target."""
        return swerling1(self.snr)

    @property
    def p_d(self) -> float:
        """P_D at the threshold of `p_fa`, for any clutter."""
        return float(self.target.survival(self.clutter.threshold(self.p_fa)))

    def alone(self, cells: float) -> float:
        """I_A: the target is detected and no false detection in the gate is stronger (paper 002, eq. 19)."""
        y, w = self._exponents(cells)
        return float(w @ (self._target_density(y) * np.exp(-cells * np.exp(-y))))

    def priors(self, cells: float) -> tuple[float, float, float]:
        """P(no detection in the gate), P(the strongest is the target), P(it is false); eqs. (15) to (18)."""
        none = (1 - self.p_d * gated(self.dim, self.gate)) * float(np.exp(-self.p_fa * cells))
        target = gated(self.dim, self.gate) * self.alone(cells)
        return none, target, 1 - none - target

    def factor_paper(self, cells: float) -> float:
        """The factor q of P = P^- - q K S K' in the paper's prediction, eq. (33).

        It is the mean error of a filter that knows whether the strongest detection is the target: a lower bound.
        """
        return gated_spread(self.dim, self.gate) * gated(self.dim, self.gate) * self.alone(cells)

    def factor(self, cells: float) -> float:
        """The factor q of the PSNF: E[P_T^2 v' S^-1 v] / dim, with its posterior weight P_T.

        It is the mean of eq. (24) and, as the PDAF's q2, includes the uncertainty of origin.
        """
        y, w = self._exponents(cells)
        r, w_r = self.gate * (_RADIUS + 1) / 2, self.gate * _RADIUS_WEIGHT / 2
        phi = np.exp(-(r**2) / 2) / (2 * pi) ** (self.dim / 2)
        target = self._target_density(y)
        false = cells / (ball(self.dim) * self.gate**self.dim) * np.exp(-y)
        false *= 1 - gated(self.dim, self.gate) * self.target.survival(self._amplitude(y))
        A = np.multiply.outer(phi, target)
        posterior = A / np.maximum(A + false, np.finfo(float).tiny)
        of_radius = (A * posterior) @ (w * np.exp(-cells * np.exp(-y)))
        return float(w_r @ (ball(self.dim) * r ** (self.dim + 1) * of_radius))

    def _amplitude(self, y: Floats) -> Floats:
        """Amplitude at y = rate a^shape = -ln(clutter's survival function)."""
        return np.asarray((y / self.clutter.rate) ** (1 / self.clutter.shape))

    def _target_density(self, y: Floats) -> Floats:
        """The target's density over y."""
        exponent = -self.target.log_survival(self._amplitude(y))
        return np.asarray(np.exp(-exponent) * exponent * 2 / (self.clutter.shape * y))

    def _exponents(self, cells: float) -> tuple[Floats, Floats]:
        """Quadrature points and weights of y above the threshold.

        Below ln n - 4 a false detection is stronger with certainty. Panels of width 2 cover the transition about ln n;
        then they grow, up to a target's survival of exp(-45). At the lower end they are finer, because y = 0 can be a
        branch point.
        """
        low = max(-log(self.p_fa), log(max(cells, 1e-300)) - 4, 0.0)
        high = self.clutter.rate * (90 * (1 + self.snr)) ** (self.clutter.shape / 2)
        reach = max(high - low, 4.0)
        even = np.arange(2.0, min(reach, 60.0), 2.0)
        grown = np.geomspace(even[-1] + 2, max(reach, even[-1] + 4), 16)
        edges = low + np.concatenate([[0.0], np.geomspace(1e-9, 1.0, 12), even, grown])
        half = np.diff(edges)[:, None] / 2
        return (edges[:-1, None] + half * (1 + _X)).ravel(), (half * _W).ravel()
