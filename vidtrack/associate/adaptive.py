"""Detection thresholds set for each track and scan from the innovation covariance (paper 000)."""

from __future__ import annotations

from dataclasses import replace

from vidtrack.amplitude.densities import RAYLEIGH, detection_probability
from vidtrack.amplitude.threshold import ThresholdController
from vidtrack.arrays.types import Floats
from vidtrack.associate.problem import Problem
from vidtrack.errors import ScanError


def thresholded(problem: Problem, controller: ThresholdController, zhat: Floats) -> Problem:
    """The problem with each track limited to the measurements that exceed its own threshold.

    The controller sets P_F (T,) from S and the predicted measurements zhat (T, m). P_D (T,) follows from P_F, and the
    clutter density (T,) is P_F / V_c. The scan must hold all measurements above the controller's p_fa_max, with
    amplitudes in units of the noise.

    Raises ScanError for a scan with measurements and without amplitudes.
    """
    scan = problem.scan
    if scan.noise is None:  # an empty scan without measurement covariance
        return problem
    if scan.amplitude is None and len(scan):
        raise ScanError("the scan has no amplitudes, which a threshold of each track's own needs; leave it out")
    volume = controller.volumes(zhat)
    p_fa = controller.p_fa(problem.cov + scan.noise, volume)
    problem = replace(problem, detection=detection_probability(p_fa, controller.snr), clutter=p_fa / volume)
    if scan.amplitude is None:
        return problem
    return problem.only(scan.amplitude[problem.pairs.measurement] >= RAYLEIGH.threshold(p_fa)[problem.pairs.row])
