"""Scores: which detections may start tracks and which only continue them."""

import numpy as np
import pytest

from vidtrack.associate.hard import GNN
from vidtrack.associate.jpda import JPDA
from vidtrack.associate.two_stage import TwoStage
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.scan import Scan
from vidtrack.tracking.lifecycle import LifeCycle
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracks import Status

R = np.eye(2)


def tracker(associate=None, **life):
    return Tracker(
        ConstantVelocity(accel=1.0, speed=5.0), associate or GNN(), life=LifeCycle(**life), two_stage=TwoStage(0.5)
    )


def fed(tracker, *scans):
    """Tracks after scans of (positions, scores), a second apart."""
    for t, (z, score) in enumerate(scans):
        tracks = tracker.step(Scan(float(t), np.array(z, float).reshape(-1, 2), R, score=np.array(score, float)))
    return tracks


@pytest.mark.parametrize("associate", [GNN(), JPDA()])
def test_a_low_score_starts_no_track_but_continues_one(associate):
    sure, unsure = ([[0, 0]], [0.9]), ([[0, 0]], [0.2])
    assert len(fed(tracker(associate), *[unsure] * 5)) == 0
    tracks = fed(tracker(associate), *[sure] * 4, unsure)
    assert tracks.status.tolist() == [Status.CONFIRMED]
    assert tracks.measurement.tolist() == [0]


def test_a_low_score_takes_a_tentative_track_along_without_confirming_it():
    """Its position counts: the next sure detection is where the unsure one led, not where the track began."""
    scans = ([[0, 0]], [0.9]), ([[4, 0]], [0.2]), ([[8, 0]], [0.9]), ([[12, 0]], [0.9])
    rules = {"confirm_hits": 3, "confirm_window": 5, "coast_scans": 3}
    assert fed(tracker(**rules), *scans[:2]).measurement.tolist() == [0]
    assert fed(tracker(**rules), *scans[:3]).status.tolist() == [Status.TENTATIVE]
    assert fed(tracker(**rules), *scans).status.tolist() == [Status.CONFIRMED]


def test_low_scores_confirm_no_track():
    tracks = fed(tracker(), ([[0, 0]], [0.9]), ([[0, 0]], [0.2]), ([[0, 0]], [0.2]))
    assert len(tracks) == 0


def test_a_sure_detection_comes_before_a_nearer_unsure_one():
    sure = ([[0, 0]], [0.9])
    tracks = fed(tracker(), *[sure] * 4, ([[0, 0], [1, 0]], [0.2, 0.9]))
    assert tracks.measurement.tolist() == [1]


def test_low_scores_do_not_keep_a_track_alive():
    sure, unsure = ([[0, 0]], [0.9]), ([[0, 0]], [0.2])
    kept = fed(tracker(coast_s=2.5, coast_scans=None), *[sure] * 4, *[unsure] * 2)
    lost = fed(tracker(coast_s=2.5, coast_scans=None), *[sure] * 4, *[unsure] * 3)
    assert (len(kept), len(lost)) == (1, 0)


def test_without_scores_all_detections_are_sure():
    scans = [Scan(float(t), np.zeros((1, 2)), R) for t in range(4)]
    core = tracker()
    for scan in scans:
        tracks = core.step(scan)
    assert tracks.status.tolist() == [Status.CONFIRMED]
