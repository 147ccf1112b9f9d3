"""What stands: queues of vehicles that drove in stay, what never travelled ends; changed shapes are followed."""

import pytest
from blob_scene import confirmed_ids, default_tracker, events, nearest_id, play

from vidtrack.errors import ConfigError
from vidtrack.tracking.lifecycle import LifeCycle
from vidtrack.tracking.picture.picture import Picture
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracks import Status


def test_what_never_travelled_and_stands_still_ends():
    seen = play(default_tracker(confirm_travel=0.0), lambda t: [[100, 100, 40, 20]], 5.0)
    ((gone, number),) = events(seen, "delete")
    assert 4.0 < gone < 4.2
    assert number == seen[0].id[0]
    (reason,) = (e.reason for tracks in seen for e in tracks.events if e.kind == "delete")
    assert reason == "never travelled and stands still"


def test_a_vehicle_that_came_in_over_the_border_may_stand_at_once():
    """It has travelled 0.7 of its size; one that appeared amid the picture and moved as far ends."""

    def stops(t):
        x = -95 + 60 * min(t, 2)
        return [[max(x, 0), 60, min(x + 100, 100), 50], [150 + 60 * min(t, 1), 160, 100, 50]]

    seen = play(default_tracker(), stops, 12.0, fps=10)
    came, appeared = nearest_id(seen[30], 75, 85), nearest_id(seen[30], 260, 185)
    assert nearest_id(seen[-1], 75, 85) == came
    ended = [number for _, number in events(seen, "delete")]
    assert ended[0] == appeared
    assert came not in ended


def test_without_idle_s_it_stays():
    life = LifeCycle(coast_s=1.0, coast_scans=None)
    tracker = Tracker(life=life, picture=Picture((320.0, 240.0)))
    seen = play(tracker, lambda t: [[100, 100, 40, 20]], 8.0, fps=5)
    assert not events(seen, "delete")


def test_a_queue_that_drove_in_stays_for_two_minutes():
    def queue(t):
        return [[min(30 * t - 60 * k, 240 - 60 * k), 100, 40, 20] for k in range(3)]

    seen = play(default_tracker(), queue, 132.0, fps=10, jitter=0.3)
    standing = [tracks for tracks in seen if tracks.t > 12.0]
    ids = {int(number) for number in standing[0].id}
    assert len(ids) == 3
    for tracks in standing:
        assert set(tracks.id.tolist()) == ids
        assert (tracks.status == Status.CONFIRMED).all()


def test_a_slow_vehicle_is_not_idle():
    seen = play(default_tracker(confirm_travel=0.0), lambda t: [[100 + 8 * t, 100, 40, 20]], 10.0, fps=10)
    assert confirmed_ids(seen) == {int(seen[0].id[0])}
    assert not events(seen, "delete")


def test_a_track_continues_on_what_is_left_of_its_blob():
    """At once only the rear third is seen, as where a shadow falls on a vehicle: its centroid is far off."""

    def shrinking(t):
        x = 20 + 60 * t
        return [[x, 100, 60, 24]] if t < 1.5 else [[x, 100, 22, 24]]

    seen = play(default_tracker(), shrinking, 3.5)
    number = nearest_id(seen[35], 20 + 60 * seen[35].t + 30, 112)
    assert confirmed_ids(seen) == {number}
    assert seen[-1].id.tolist() == [number]
    assert not events(seen, "delete")


def test_a_tentative_track_is_confirmed_before_it_joins_a_group():
    """Two vehicles on one blob that hides more: a newcomer on it is told of before it is shown as merged."""
    before = None
    for tracks in play(default_tracker(), lambda t: [[20 + 40 * t, 100, 40, 20], [180 - 40 * t, 112, 40, 20]], 4.0):
        told = {e.track_id for e in tracks.events if e.kind == "confirmed"}
        known = set() if before is None else set(before.id[before.status != Status.TENTATIVE].tolist())
        assert set(tracks.id[tracks.status != Status.TENTATIVE].tolist()) <= known | told
        before = tracks


def test_a_life_without_end_is_refused():
    with pytest.raises(ConfigError):
        LifeCycle(coast_s=None, coast_scans=None, idle_s=3.0)
