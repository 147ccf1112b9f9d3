"""The optimal detection threshold of a PSNF by its predicted error (paper 002)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.amplitude.densities import RAYLEIGH, Weibull, detection_probability
from vidtrack.amplitude.threshold import LEAST_LOG_P_FA
from vidtrack.errors import ConfigError
from vidtrack.radar.performance.prediction import Scenario, position_error, psn_factor, steady_state

SLACK = 1.01
"""Accepted ratio to the best error."""


@dataclass(frozen=True, slots=True)
class PsnThreshold:
    """The best threshold, and the highest threshold at little cost.

    p_fa              minimises the steady-state error; always the largest allowed, because a lower threshold never
                      removes information
    p_d               probability of detection at p_fa
    error             steady-state position error of the corrected prediction; None: the prediction diverges
    p_fa_one_percent  smallest P_FA with a steady-state error within 1 % of `error`; None: the prediction diverges
    """

    p_fa: float
    p_d: float
    error: float | None
    p_fa_one_percent: float | None


def best_psn_threshold(
    scenario: Scenario, snr: float, clutter: Weibull = RAYLEIGH, p_fa_max: float = 1.0
) -> PsnThreshold:
    """The P_FA in (0, p_fa_max] that minimises the corrected steady-state prediction.

    The factor q is an integral of positive terms over all amplitudes above the threshold, so it grows with P_FA. The
    P_FA at 1 % more error is found by bisection.
    """
    if not 0 < p_fa_max <= 1:
        raise ConfigError(f"the largest P_FA is {p_fa_max}; it must lie above 0 and up to 1")

    def error(log_p_fa: float) -> float:
        P = steady_state(scenario, psn_factor(scenario, snr, float(np.exp(log_p_fa)), clutter))
        return np.inf if P is None else float(position_error(scenario, P))

    high, low = float(np.log(p_fa_max)), LEAST_LOG_P_FA
    best = error(high)
    p_d = float(detection_probability(p_fa_max, snr, clutter))
    if best == np.inf:
        return PsnThreshold(p_fa_max, p_d, None, None)
    while high - low > 1e-3:
        middle = (low + high) / 2
        low, high = (low, middle) if error(middle) <= SLACK * best else (middle, high)
    return PsnThreshold(p_fa_max, p_d, best, float(np.exp(high)))
