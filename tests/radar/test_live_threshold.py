"""A tracker whose detection threshold follows its own innovation covariances, scan by scan."""

import numpy as np
import pytest

from vidtrack.amplitude.reduction import gated
from vidtrack.amplitude.threshold import ThresholdController
from vidtrack.associate.gate import Gate
from vidtrack.associate.pda import PDA
from vidtrack.radar.performance.in_gate import AllPlots, Gates
from vidtrack.radar.performance.prediction import normalised
from vidtrack.tracking.lifecycle import LifeCycle
from vidtrack.tracking.rates import Rates
from vidtrack.tracking.station import Station, Stations
from vidtrack.tracking.tracker import Tracker

CELL, RUNS, SCANS, R = 2.0, 600, 35, np.eye(2)
TARGET = normalised(0.01, 4.0, CELL)


def follow(threshold):
    """Position errors (SCANS, RUNS) and P_F (SCANS, RUNS)."""
    rng = np.random.default_rng(7)
    tracker = Tracker(TARGET.model, PDA(), Gate(gated(2, 4.0)), LifeCycle(coast_s=1e6, coast_scans=None), births=False)
    truth = np.zeros((RUNS, 4))
    x = rng.multivariate_normal(np.zeros(4), TARGET.P0, RUNS)
    tracker.add(0.0, x, np.tile(TARGET.P0, (RUNS, 1, 1)), run=np.arange(RUNS))
    error, p_fa = np.empty((2, SCANS, RUNS))
    for k in range(SCANS):
        truth = truth @ TARGET.F.T + rng.multivariate_normal(np.zeros(4), TARGET.Q, RUNS, method="eigh")
        ahead = tracker.predict(k + 1.0)
        target = truth[:, [0, 2]] + rng.standard_normal((RUNS, 2))
        gates = Gates(ahead.xy, ahead.xy_cov + R, 4.0, target)
        plots = AllPlots(10.0, threshold, CELL).draw(rng, k + 1.0, gates, R)
        tracker.stations = Stations([Station(Rates(plots.p_d, plots.density))])
        tracks = tracker.step(plots.scan)
        error[k], p_fa[k] = np.linalg.norm(tracks.xy - truth[:, [0, 2]], axis=1), plots.p_fa
    return error, p_fa


def test_it_loses_fewer_tracks_than_a_fixed_threshold():
    star, p_fa = follow(ThresholdController(10.0, CELL))
    fixed, _ = follow(1e-2)
    assert (star[-1] > 10).mean() < 0.08 < (fixed[-1] > 10).mean()
    assert np.median(p_fa[2]) < 0.5 * np.median(p_fa[-1]), "wide gates at the start ask for a higher threshold"
    assert np.median(p_fa[-1]) == pytest.approx(1.9e-3, rel=0.2)
