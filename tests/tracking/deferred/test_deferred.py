"""Decisions that wait: what they refuse, and which rows are shown."""

import numpy as np
import pytest

import vidtrack as vt
from vidtrack.associate.two_stage import SINGLE_STAGE
from vidtrack.tracking.deferred.deferred import Deferred
from vidtrack.tracking.immediate import Immediate


@pytest.mark.parametrize("rule", [vt.MHT(), vt.Split()])
def test_a_sharing_of_measurements_without_effect_is_refused(rule):
    with pytest.raises(vt.ConfigError, match=type(rule).__name__):
        vt.Tracker(associate=rule, sharing=vt.Occlusion())


@pytest.mark.parametrize(("rule", "kind"), [(vt.MHT(), Deferred), (vt.Split(), Deferred), (vt.JPDA(), Immediate)])
def test_the_rule_says_when_decisions_are_made(rule, kind):
    assert isinstance(vt.Tracker(associate=rule).timing, kind)


@pytest.mark.parametrize("rule", [vt.MHT(), vt.Split()])
def test_of_each_track_one_row_is_shown(rule):
    tracker = vt.Tracker(vt.ConstantVelocity(speed=5.0), rule)
    rng = np.random.default_rng(2)
    for k in range(10):
        tracks = tracker.step(vt.Scan(float(k), rng.uniform(0, 20, (6, 2)), np.eye(2)))
        assert len(np.unique(tracks.id)) == len(tracks)
        assert (np.diff(tracks.id) > 0).all()
        shown = tracker.timing.shown(len(tracker.register))
        assert sorted(tracker.register.id[shown]) == tracks.id.tolist()
    assert len(tracker.register) > len(tracks)


def test_a_track_ends_with_its_last_row():
    waiting = Deferred(vt.MHT().forest(), SINGLE_STAGE, births=True)
    ids = np.array([1, 1, 2, 3])
    going = np.array([True, False, True, True])
    assert waiting.ended(ids, going, going).tolist() == [2, 3]
    assert waiting.ended(ids, going, np.array([True, False, True, False])).tolist() == [2]
