"""Birth, confirmation and death, seen from outside: one target that is there or is missed."""

from itertools import product

import numpy as np
import pytest
from blob_scene import centred, confirmed_ids, default_tracker, events, play

from vidtrack.associate.gate import Gate
from vidtrack.errors import ConfigError
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.scan import Scan
from vidtrack.tracking.lifecycle import LifeCycle
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracks import Status

EYE = np.eye(2)


def target(t, there=True, x=0.0):
    return Scan(t, np.array([[x, 0.0]]) if there else np.empty((0, 2)), EYE)


def one_target_tracker(life):
    return Tracker(ConstantVelocity(accel=0.1, speed=1.0), gate=Gate(0.99999), life=life)


def reference(pattern, hits, window):
    """(id, confirmed) after each scan, from the definition; id 0 is no track."""
    number, history, confirmed, result = 0, [], False, []
    newest = 0
    for seen in pattern:
        if number:
            history.append(seen)
            recent = history[-window:]
            if sum(recent) >= hits:
                confirmed = True
            elif not confirmed and recent.count(False) > window - hits:
                number = 0
        elif seen:
            newest += 1
            number, history, confirmed = newest, [True], hits == 1
        result.append((number, confirmed and number > 0))
    return result


@pytest.mark.parametrize(("hits", "window"), [(2, 3), (3, 4), (3, 5), (2, 2), (1, 1)])
def test_m_of_n_by_its_definition_for_all_patterns(hits, window):
    life = LifeCycle(confirm_hits=hits, confirm_window=window, coast_scans=60)
    for pattern in product((True, False), repeat=7):
        tracker, found = one_target_tracker(life), []
        for k, seen in enumerate(pattern):
            tracks = tracker.step(target(0.1 * k, seen))
            assert len(tracks) <= 1
            row = (int(tracks.id[0]), bool(tracks.status[0] != Status.TENTATIVE)) if len(tracks) else (0, False)
            found.append(row)
        assert found == reference(pattern, hits, window), pattern


@pytest.mark.parametrize(
    ("hits", "window", "p", "expected"),
    [(2, 3, 0.9, 0.99), (3, 4, 0.9, 0.972), (3, 5, 0.9, 0.9963), (3, 4, 0.1, 0.028), (3, 5, 0.5, 0.6875)],
)
def test_probability_to_confirm_within_the_window_counts_the_first_hit(hits, window, p, expected):
    """SPEC 001, `m_of_n`: P(Bin(N - 1, p) >= M - 1) once the initiating hit is there."""
    life = LifeCycle(confirm_hits=hits, confirm_window=window, coast_scans=60)
    total = 0.0
    for pattern in product((True, False), repeat=window - 1):
        tracker = one_target_tracker(life)
        seen = [tracker.step(target(0.1 * k, hit)) for k, hit in enumerate((True, *pattern))]
        if confirmed_ids(seen) == {1}:
            total += np.prod([p if hit else 1 - p for hit in pattern])
    assert total == pytest.approx(expected, abs=1e-12)


def follow_then_lose(life, fps, last_seen_s, until_s):
    """Time of the last snapshot that still holds the track."""
    tracker = one_target_tracker(life)
    alive = 0.0
    for k in range(round(until_s * fps) + 1):
        tracks = tracker.step(target(k / fps, k / fps <= last_seen_s + 1e-9))
        if len(tracks):
            alive = k / fps
    return alive


@pytest.mark.parametrize("fps", [5, 10, 25, 60])
@pytest.mark.parametrize("coast_s", [0.5, 1.5])
def test_a_lost_track_lives_coast_s_whatever_the_scan_rate(fps, coast_s):
    life = LifeCycle(coast_s=coast_s, coast_scans=None)
    alive = follow_then_lose(life, fps, 2.0, 6.0)
    assert 2.0 + coast_s - 1 / fps - 1e-9 <= alive <= 2.0 + coast_s + 1e-9


@pytest.mark.parametrize("scans", [1, 3, 5])
def test_a_lost_track_dies_after_coast_scans_misses(scans):
    tracker = one_target_tracker(LifeCycle(coast_s=None, coast_scans=scans))
    for k in range(6):
        tracker.step(target(0.1 * k))
    alive = [len(tracker.step(target(0.1 * k, False))) for k in range(6, 20)]
    assert sum(alive) in (scans - 1, scans)  # gone with its last miss, or before the scan after it


def test_a_track_that_a_long_gap_outlived_does_not_take_the_next_vehicle():
    tracker = one_target_tracker(LifeCycle(coast_s=1.0, coast_scans=None))
    for k in range(6):
        before = tracker.step(target(0.1 * k))
    after = tracker.step(target(60.0))
    assert set(before.id.tolist()).isdisjoint(after.id.tolist())
    assert [event.kind for event in after.events] == ["delete", "birth"]


def test_a_coasting_track_that_is_found_again_goes_on():
    tracker = one_target_tracker(LifeCycle(coast_s=1.0, coast_scans=None))
    states = [tracker.step(target(0.1 * k, not 6 <= k < 12)).status.tolist() for k in range(14)]
    assert states[5] == [Status.CONFIRMED]
    assert states[8] == [Status.COASTING]
    assert states[13] == [Status.CONFIRMED]


@pytest.mark.parametrize("fps", [10, 30])
def test_no_track_is_confirmed_before_its_time(fps):
    tracker = one_target_tracker(LifeCycle(confirm_s=0.5, coast_s=1.0, coast_scans=None))
    seen = [tracker.step(target(k / fps)) for k in range(fps)]
    (time, _), *more = events(seen, "confirmed")
    assert not more
    assert 0.5 - 1e-9 <= time <= 0.5 + 1 / fps


def test_what_only_sways_is_never_confirmed():
    """A tree of 20 px sways by 5 px; a car of 20 px beside it drives off."""

    def scene(t):
        return [centred(100 + 5 * np.sin(6 * t), 60, 20, 20), centred(50 + 40 * t, 160, 20, 20)]

    seen = play(default_tracker(confirm_travel=0.5), scene, 4.0)
    assert len(confirmed_ids(seen)) == 1
    assert seen[-1].xy[seen[-1].status == Status.CONFIRMED][0, 1] == pytest.approx(160, abs=2)


def test_small_things_must_travel_as_far_as_a_thirtieth_of_the_picture_asks():
    """Leaves of 4 px that sway by 2 px are more than half their size on the way, but not in a picture of 320 px."""

    def leaf(t):
        return [centred(100 + 2 * np.sin(6 * t), 60, 4, 4)]

    assert len(confirmed_ids(play(default_tracker(confirm_travel=0.3), leaf, 4.0))) == 0
    assert len(confirmed_ids(play(default_tracker(confirm_travel=0.1), leaf, 4.0))) == 1


def test_a_track_ends_where_the_picture_ends():
    seen = play(default_tracker(coast_s=30.0), lambda t: [centred(20 + 80 * t, 120, 30, 16)] if t < 3.9 else [], 6.0)
    (time, _), *more = events(seen, "delete")
    assert not more
    assert time < 4.5
    assert len(seen[-1]) == 0


@pytest.mark.parametrize(
    "bad",
    [
        {"confirm_hits": 4, "confirm_window": 3},
        {"confirm_hits": 0},
        {"confirm_window": 64},
        {"coast_s": None, "coast_scans": None},
        {"coast_scans": -1},
        {"coast_s": -1.0},
        {"coast_s": float("nan")},
    ],
)
def test_a_life_that_makes_no_sense_is_refused(bad):
    with pytest.raises(ConfigError):
        LifeCycle(**bad)
