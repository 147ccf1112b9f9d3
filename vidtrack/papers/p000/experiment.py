"""The experiment of both figures: a target of 10 dB, 35 scans, P_F fixed or set in each scan from the filter's S.

The paper gives neither process noise nor resolution cell. r = 1, q = 0.01, g = 4 and two cells are our choice: the best
threshold and the loss by a fixed threshold depend on the cell.
"""

from __future__ import annotations

from typing import Literal

from vidtrack.amplitude.densities import detection_probability
from vidtrack.amplitude.reduction import q2, q2_fit
from vidtrack.amplitude.threshold import closed_form, optimum
from vidtrack.radar.performance.prediction import Factor, Scenario, normalised

SNR, FIXED, SCANS, LOST = 10.0, 1e-2, 35, 10.0
CELLS = (4.0, 2.0)


def scenario(cell_volume: float) -> Scenario:
    """The target and the radar in units of the measurement noise."""
    return normalised(q=0.01, gate=4.0, cell_volume=cell_volume)


def best_p_fa(method: Literal["closed-form", "exact"], cells: float) -> float:
    """P_F* for n cells in the gate."""
    return float(closed_form(SNR, cells)[0] if method == "closed-form" else optimum(SNR, cells))


def controlled(method: Literal["closed-form", "exact"]) -> Factor:
    """q2 of a PDAF with P_F* from its gate; the closed form uses the fit's q2, from which it is derived."""
    factor = q2_fit if method == "closed-form" else q2

    def of_cells(cells: float) -> float:
        p_fa = best_p_fa(method, cells)
        return float(factor(detection_probability(p_fa, SNR), cells * p_fa))

    return of_cells
