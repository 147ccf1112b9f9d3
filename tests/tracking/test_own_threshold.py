"""Each track of a tracker may have a detection threshold of its own, set from its innovation covariance."""

import numpy as np
import pytest

from vidtrack.amplitude.densities import RAYLEIGH, swerling1
from vidtrack.amplitude.reduction import gated
from vidtrack.amplitude.threshold import ThresholdController
from vidtrack.associate.adaptive import thresholded
from vidtrack.associate.gate import Gate
from vidtrack.associate.pda import PDA
from vidtrack.associate.problem import Problem
from vidtrack.errors import ScanError
from vidtrack.radar.performance.in_gate import Gates
from vidtrack.radar.performance.prediction import normalised
from vidtrack.scan import Scan
from vidtrack.tracking.lifecycle import LifeCycle
from vidtrack.tracking.tracker import Tracker

CELL, SNR, R, RUNS, SCANS = 2.0, 10.0, np.eye(2), 300, 25
CONTROLLER = ThresholdController(SNR, CELL, p_fa_max=1e-2)
TARGET = normalised(0.01, 4.0, CELL)


def test_a_wide_gate_asks_for_a_higher_threshold():
    cov = np.array([1.0, 100.0])[:, None, None] * np.eye(2)
    amplitude = RAYLEIGH.threshold(np.array([5e-3, 1e-6]))
    scan = Scan(0.0, np.zeros((2, 2)), R, amplitude=amplitude)
    problem = thresholded(Problem.gated(Gate(gated(2, 4.0)), np.zeros((2, 2)), cov, scan), CONTROLLER, np.zeros((2, 2)))
    p_fa = CONTROLLER.p_fa(cov + R)
    assert p_fa[1] < p_fa[0] < 5e-3
    assert set(zip(problem.pairs.row.tolist(), problem.pairs.measurement.tolist(), strict=True)) == {(0, 1), (1, 1)}
    assert problem.clutter == pytest.approx(p_fa / CELL)
    assert problem.detection == pytest.approx(p_fa ** (1 / (1 + SNR)))


def test_amplitudes_are_needed():
    tracker = Tracker(threshold=CONTROLLER)
    with pytest.raises(ScanError, match="no amplitudes"):
        tracker.step(Scan(0.0, np.zeros((1, 2)), R))
    tracker.step(Scan(1.0, np.zeros((0, 2)), R))


def lost(**options):
    """Share of tracks lost in a radar that reports all that exceeds P_F = 1e-2, with amplitudes."""
    rng = np.random.default_rng(3)
    life = LifeCycle(coast_s=1e6, coast_scans=None)
    tracker = Tracker(TARGET.model, PDA(), Gate(gated(2, 4.0)), life, births=False, **options)
    truth = np.zeros((RUNS, 4))
    x = rng.multivariate_normal(np.zeros(4), TARGET.P0, RUNS)
    tracker.add(0.0, x, np.tile(TARGET.P0, (RUNS, 1, 1)), run=np.arange(RUNS))
    threshold = float(RAYLEIGH.threshold(1e-2))
    for k in range(SCANS):
        truth = truth @ TARGET.F.T + rng.multivariate_normal(np.zeros(4), TARGET.Q, RUNS, method="eigh")
        ahead = tracker.predict(k + 1.0)
        gates = Gates(ahead.xy, ahead.xy_cov + R, 4.0, truth[:, [0, 2]] + rng.standard_normal((RUNS, 2)))
        echo = swerling1(SNR).sample(rng, RUNS)
        hit = np.flatnonzero((echo > threshold) & gates.holds_target)
        false = np.repeat(np.arange(RUNS), rng.poisson(np.minimum(1e-2 / CELL * gates.volume, 500)))
        amplitude = np.concatenate([echo[hit], RAYLEIGH.sample(rng, len(false), above=threshold)])
        z = np.concatenate([gates.target[hit], gates.uniform(rng, false)])
        scan = Scan(k + 1.0, z, R, amplitude=amplitude, run=np.concatenate([hit, false]), noise=R)
        tracks = tracker.step(scan)
    return (np.linalg.norm(tracks.xy - truth[:, [0, 2]], axis=1) > 10).mean()


def test_it_loses_fewer_tracks_than_the_radars_own_threshold():
    fixed = lost(detection_probability=1e-2 ** (1 / (1 + SNR)), clutter_density=1e-2 / CELL)
    assert lost(threshold=CONTROLLER) < 0.08 < fixed
