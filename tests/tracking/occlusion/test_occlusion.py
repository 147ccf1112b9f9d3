"""Vehicles that share a blob stay vehicles: who they are, where they are, when they are given up."""

import numpy as np
import pytest
from blob_scene import centred, confirmed_ids, default_tracker, events, nearest_id, play
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.errors import ConfigError
from vidtrack.tracking.boxes import box_scan, overlapping
from vidtrack.tracking.lifecycle import LifeCycle
from vidtrack.tracking.occlusion.aboard import go_along
from vidtrack.tracking.occlusion.edges import from_edges
from vidtrack.tracking.occlusion.occlusion import Occlusion
from vidtrack.tracking.picture.border import Border
from vidtrack.tracking.picture.picture import View
from vidtrack.tracks import Status

SPEED = 60.0


def right(t, meet=2.0, size=(30, 16)):
    return centred(160 + SPEED * (t - meet), 120, *size)


def down(t, meet=2.05, size=(16, 30)):
    return centred(160, 120 + SPEED * (t - meet), *size)


def left(t, meet=2.1, size=(30, 16)):
    return centred(170 - SPEED * (t - meet), 124, *size)


def track_of(tracks, number):
    return int(np.flatnonzero(tracks.id == number)[0])


def overlaps(a, b):
    return a[0] < b[0] + b[2] and b[0] < a[0] + a[2] and a[1] < b[1] + b[3] and b[1] < a[1] + a[3]


@pytest.mark.parametrize("method", ["nn", "gnn"])
@pytest.mark.parametrize("seed", range(5))
def test_two_vehicles_that_cross_in_one_blob_keep_their_ids_and_velocities(method, seed):
    tracker = default_tracker(method=method)
    seen = play(tracker, lambda t: [right(t), down(t)], 4.0, jitter=0.5, seed=seed)
    before, after = seen[25], seen[-10]  # 1.0 s, 3.6 s
    ids = nearest_id(before, 100, 120), nearest_id(before, 160, 57)
    assert confirmed_ids(seen) == set(ids)
    for number, place, velocity in ((ids[0], (256, 120), (SPEED, 0)), (ids[1], (160, 213), (0, SPEED))):
        row = track_of(after, number)
        np.testing.assert_allclose(after.xy[row], place, atol=5)
        np.testing.assert_allclose(after.v[row], velocity, atol=12)


def test_group_says_who_shares_a_blob_and_since_when():
    seen = play(default_tracker(), lambda t: [right(t), down(t)], 4.0)
    shared = [tracks for tracks in seen if (tracks.group >= 0).any()]
    ids = confirmed_ids(seen)
    assert len(shared) >= 5
    since = shared[0].t
    for tracks in shared:
        both = np.isin(tracks.id, list(ids))
        assert (tracks.status[both] == Status.MERGED).all()
        assert len(set(tracks.group[both].tolist())) == 1
        np.testing.assert_array_equal(tracks.group_since_s[both], since)
        assert tracks.seen[both].all()
        assert overlaps(right(tracks.t), down(tracks.t))
    alone = [tracks for tracks in seen if (tracks.group < 0).all()]
    for tracks in alone:
        assert np.isnan(tracks.group_since_s).all()
        assert not (tracks.status == Status.MERGED).any()
    assert {(since, number) for number in ids} == set(events(seen, "merge"))
    split = events(seen, "split")
    assert {number for _, number in split} == ids
    assert all(time > shared[-1].t for time, _ in split)


def test_three_vehicles_in_one_blob_come_out_as_three():
    seen = play(default_tracker(), lambda t: [right(t), down(t), left(t)], 4.0, jitter=0.3, seed=1)
    before, after = seen[25], seen[-10]
    ids = nearest_id(before, 100, 120), nearest_id(before, 160, 57), nearest_id(before, 236, 124)
    assert any((tracks.group >= 0).sum() == 3 for tracks in seen)
    assert confirmed_ids(seen) == set(ids)
    for number, vehicle in zip(ids, (right, down, left), strict=True):
        x, y, width, height = vehicle(after.t)
        assert nearest_id(after, x + width / 2, y + height / 2) == number


def test_a_blob_that_swallows_a_car_for_good_does_not_keep_it_alive():
    """A car drives behind a lorry that stopped and stays there: nothing in the picture is evidence for it."""

    def scene(t):
        lorry = centred(min(100 + 60 * t, 220), 120, 80, 60)
        car = centred(min(20 + 50 * t, 220), 120, 24, 14)
        return [lorry, car]

    tracker = default_tracker(confirm_travel=0.0, coast_s=1.0)
    seen = play(tracker, scene, 9.0)
    lorry = nearest_id(seen[40], 196, 120)
    assert len(seen[40].id[seen[40].status != Status.TENTATIVE]) == 2
    assert seen[-1].id.tolist() == [lorry]
    hidden_at = (220 - 40 + 12 - 20) / 50
    (gone,) = (t for t, number in events(seen, "delete") if number != lorry)
    assert hidden_at < gone < hidden_at + 5.0  # coast_s after it would have passed the lorry's far edge


def test_a_car_behind_a_pillar_lags_no_more_than_what_is_left_of_it():
    """Half covered, the centroid of what is left lags by 10 px; the track lags no more and keeps its id."""
    pillar = 200

    def centre(t):
        return 20 + 50 * t

    def scene(t):
        x, y, width, height = centred(centre(t), 120, 40, 20)
        return [[x, y, min(width, pillar - x), height]] if x < pillar - 1 else []

    seen = play(default_tracker(), scene, 4.2, jitter=0.2)
    number = nearest_id(seen[60], centre(seen[60].t), 120)
    for tracks in seen[75:]:
        covered = centre(tracks.t) + 20 - pillar
        if 0 < covered <= 20:
            row = track_of(tracks, number)
            assert abs(tracks.xy[row, 0] - centre(tracks.t)) < 10.5
    assert confirmed_ids(seen) == {number}


def test_one_shared_blob_is_two_deaths_and_a_birth_without_groups():
    """The switch does what it says: without groups the crossing vehicles are never merged."""
    seen = play(default_tracker(merged_blobs=False), lambda t: [right(t), down(t)], 4.0)
    assert not any((tracks.status == Status.MERGED).any() or (tracks.group >= 0).any() for tracks in seen)
    assert not events(seen, "merge")


def measure(predicted, relative, var, on, blobs):
    """Positions by the edges of blobs that no border cuts and that hide nobody."""
    whole, nobody = np.zeros((len(blobs), 4), bool), np.zeros(len(blobs), bool)
    rule = Occlusion()
    return from_edges(predicted, relative, var, on, blobs, whole, nobody, rule.gate, rule.edge, 1.0)


numbers = st.floats(-1e4, 1e4)
lengths = st.floats(0, 1e3)
boxes = st.tuples(numbers, numbers, lengths, lengths)


@given(
    members=st.lists(st.tuples(boxes, st.floats(0, 1e6)), min_size=1, max_size=5),
    blobs=st.lists(boxes, min_size=1, max_size=3),
    data=st.data(),
)
@settings(max_examples=200, deadline=None)
def test_edges_never_give_anything_but_a_measurement(members, blobs, data):
    predicted = np.array([box for box, _ in members])
    var = np.array([[v, v] for _, v in members])
    relative = np.column_stack([-predicted[:, 2:] / 2, predicted[:, 2:]])
    on = np.array(data.draw(st.lists(st.integers(0, len(blobs) - 1), min_size=len(members), max_size=len(members))))
    z, R, own = measure(predicted, relative, var, on, np.array(blobs))
    assert np.isfinite(z).all()
    assert np.isfinite(R).all()
    assert (R > 0).all()
    assert ((own >= 0) & (own <= 4)).all()


def test_a_lone_members_edges_are_those_of_its_blob():
    """A vehicle of 20 x 10 predicted at (50, 50), its blob seen 3 px to the right."""
    predicted, relative = np.array([[40.0, 45.0, 20.0, 10.0]]), np.array([[-10.0, -5.0, 20.0, 10.0]])
    seen = np.array([[43.0, 45.0, 20.0, 10.0]])
    z, R, own = measure(predicted, relative, np.ones((1, 2)), np.array([0]), seen)
    np.testing.assert_allclose(z, [[53.0, 50.0]])
    assert own.tolist() == [4]
    assert (R < 20**2).all()


def catch(tracks, blobs, idle, free):
    """The blob that each track (T,) continues on, and which of the free blobs (M,) still are."""
    view = View(blobs, blobs, tracks, np.full(len(tracks), 9), Border(), 0.3, None, np.full((len(tracks), 3), np.nan))
    taken = np.where(idle, -1, len(blobs))
    shared, still = Occlusion().catch(view, taken, np.full(len(tracks), -1), free.copy())
    return shared.tolist(), still.tolist()


def test_catch_gives_each_idle_track_the_free_blob_that_it_overlaps_most():
    tracks = np.array([[0.0, 0, 40, 20], [100.0, 0, 40, 20], [200.0, 0, 40, 20]])
    blobs = np.array([[10.0, 0, 40, 20], [2.0, 0, 40, 20], [130.0, 0, 40, 20], [200.0, 0, 14, 20]])
    everyone, all_free, one_less = np.ones(3, bool), np.ones(4, bool), np.array([True, False, True, True])
    assert catch(tracks, blobs, everyone, all_free) == ([1, -1, 3], [True, False, True, False])
    assert catch(tracks, blobs, everyone, one_less) == (
        [0, -1, 3],
        [False, False, True, False],
    )
    assert catch(tracks, blobs, np.array([False, True, True]), all_free) == ([-1, -1, 3], [True, True, True, False])
    assert catch(tracks, np.empty((0, 4)), everyone, np.empty(0, bool)) == ([-1] * 3, [])


def test_of_two_tracks_on_one_blob_the_one_that_overlaps_it_more_has_it():
    tracks = np.array([[0.0, 0, 40, 20], [6.0, 0, 40, 20], [np.nan, 0, 40, 20]])
    blob = np.array([[8.0, 0, 40, 20]])
    assert overlapping(tracks, blob, np.arange(3), np.arange(1), 0.3).tolist() == [-1, 0, -1]


@pytest.mark.parametrize("cover", [0.0, -1.0, 1.1])
def test_a_cover_that_makes_no_sense_is_refused(cover):
    with pytest.raises(ConfigError, match=str(cover)):
        Occlusion(cover=cover)


def in_two_pieces(apart_s):
    """A lorry whose cab and trailer are two blobs at first, and one for the rest of its way."""

    def boxes(t):
        x, gap = 40 + SPEED * t, 4 if t < apart_s else -2
        return [centred(x, 120, 40, 24), centred(x + 20 + gap + 8, 122, 16, 18)]

    return boxes


@pytest.mark.parametrize("seed", range(3))
def test_a_piece_that_was_hardly_ever_alone_is_no_vehicle_of_its_own(seed):
    assert len(confirmed_ids(play(default_tracker(), in_two_pieces(0.36), 3.0, jitter=0.3, seed=seed))) == 1
    seen = play(default_tracker(confirm_s=0.2), in_two_pieces(0.36), 3.0, jitter=0.3, seed=seed)
    assert len(confirmed_ids(seen)) == 2
    assert len(seen[-1]) == 1
    (_, piece), *_ = events(seen, "delete")
    assert [event.reason for tracks in seen for event in tracks.events if event.track_id == piece][-1] == (
        "part of another vehicle"
    )


@pytest.mark.parametrize("seed", range(3))
def test_who_was_alone_for_long_stays_a_vehicle_in_the_group(seed):
    seen = play(default_tracker(), in_two_pieces(1.0), 3.5, jitter=0.3, seed=seed)
    assert len(seen[-1]) == len(confirmed_ids(seen)) == 2


def passing(faster):
    """A lorry, and in front of it in the picture a car that passes it, by so many px/s."""
    return lambda t: [centred(SPEED * t, 120, 60, 40), centred(SPEED * t - 15 + faster * t, 130, 16, 12)]


def queue(t):
    """A lorry that came to a motorcycle at 1 s, stands behind it for 4 s, and follows it, which starts faster."""
    x = SPEED * (min(t, 1.0) + max(t - 5.0, 0.0))
    bike = SPEED + 25 + 1.6 * SPEED * max(t - 5.0, 0.0)
    return [centred(x, 120, 60, 40), centred(bike, 132, 10, 14)]


def rolling(t):
    """A car that comes beside a lorry at 2 s; both roll by 20 px, and stand."""
    x = 50 * min(max(t - 2.0, 0.0), 0.4)
    return [centred(x, 120, 60, 40), centred(x - 10, 130 - 80 * max(2.0 - t, 0.0), 16, 12)]


def cab(t):
    """A lorry and its cab."""
    return [centred(50 * t, 0, 60, 40), centred(20 + 50 * t, 5, 16, 20)]


def go(boxes, seconds, confirmed=(True, True), seen=(True, True), fps=25.0):
    """Time [s] from which on each of two tracks goes along with the other, NaN: never; boxes(t) are of a row each."""
    host, seat, since = np.full(2, -1), np.full((2, 5), np.nan), np.full(2, np.nan)
    confirmed, seen = np.array(confirmed), np.array(seen)
    rest, rest_s = np.array(boxes(0.0), float), np.zeros(2)
    for t in np.arange(round(seconds * fps)) / fps:
        box = np.array(boxes(t), float)
        on = np.hypot(*(box - rest)[:, :2].T) > 0.5 * box[:, 2:].max(axis=1)
        rest[on], rest_s[on] = box[on], t
        along = go_along(box, np.array([7, 8]), confirmed, seen, np.zeros(2), rest_s, host, seat, t, 0.6, 0.5)
        since[along & np.isnan(since)] = t
    return since


def test_a_track_that_keeps_its_place_in_a_larger_one_which_drives_goes_along_with_it():
    lorry, part = go(cab, 2.0)
    assert np.isnan(lorry)
    assert 0.6 < part < 0.7


def test_a_track_also_goes_along_with_one_that_comes_nearer_and_grows():
    def boxes(t):
        grown = 1 + 0.4 * t
        return [centred(50 * t, 20 * t, 60 * grown, 40 * grown), centred(50 * t + 20 * grown, 20 * t, 15, 12)]

    assert 0.6 < go(boxes, 2.0)[1] < 0.7


@pytest.mark.parametrize(
    "boxes",
    [
        pytest.param(passing(30), id="passes"),
        pytest.param(passing(-16), id="is passed"),
        pytest.param(queue, id="stands in a queue and starts"),
        pytest.param(rolling, id="comes beside it, rolls with it, and stands"),
        pytest.param(lambda t: [centred(50 * t, 0, 60, 40), centred(50 * t, 0, 32, 40)], id="is half as large"),
        pytest.param(lambda t: [centred(7 * t, 0, 60, 40), centred(10 + 7 * t, 0, 16, 20)], id="hardly drives"),
        pytest.param(lambda t: [centred(50 * t, 0, 60, 40), centred(34 + 50 * t, 0, 16, 20)], id="is outside by half"),
    ],
)
def test_who_passes_stands_or_is_no_smaller_goes_by_itself(boxes):
    assert np.isnan(go(boxes, 7.0)).all()


def test_only_the_larger_one_need_be_seen_and_only_the_part_confirmed():
    assert np.isnan(go(cab, 2.0, seen=(False, True))[1])
    assert np.isnan(go(cab, 2.0, confirmed=(True, False))[1])
    assert 0.6 < go(cab, 2.0, seen=(True, False), confirmed=(False, True))[1] < 0.7


def test_who_was_outside_meanwhile_begins_anew():
    def boxes(t):
        lorry, part = cab(t)
        return [lorry, part if not 0.4 < t < 0.5 else centred(50 * t, 90, 16, 20)]

    assert 1.1 < go(boxes, 2.0)[1] < 1.2


@pytest.mark.parametrize("alone_s", [0.5, 1.5])
def test_who_drove_alone_for_most_of_its_life_is_no_part(alone_s):
    def boxes(t):
        lorry, part = cab(t)
        return [lorry if t >= alone_s else centred(50 * t, 200, 60, 40), part]

    assert np.isnan(go(boxes, alone_s + 1.2)[1]) == (alone_s == 1.5)


@pytest.mark.parametrize("parts", [True, False])
def test_a_cab_that_was_tracked_first_ends_when_its_lorry_is_a_track(parts):
    tracker = default_tracker(parts=parts)
    snapshots = []
    for t in np.arange(60) / 25:
        x = 20 + SPEED * t
        boxes = np.array([centred(x + 20, 124, 14, 20), centred(x, 120, 60, 40)][: 2 if t >= 0.5 else 1])
        snapshots.append(tracker.step(box_scan(t, boxes)))
    assert len(snapshots[-1]) == (1 if parts else 2)
    gone = [(e.track_id, e.reason) for tracks in snapshots for e in tracks.events if e.kind == "delete"]
    assert gone == ([(1, "part of another vehicle")] if parts else [])


class LorryEnds(LifeCycle):
    """Ends the second track in the scan in which it would take the first one with it."""

    def hopeless(self, register):
        return (register.id == 2) & (register.updated_s > 1.19)


def test_nobody_is_a_part_of_a_track_that_ends_in_the_same_scan():
    def ended(life):
        tracker = default_tracker()
        tracker.life = life(3, 5, confirm_travel=0.5)
        for t in np.arange(31) / 25:
            boxes = np.array([centred(40 + SPEED * t, 124, 14, 20), centred(20 + SPEED * t, 120, 60, 40)])
            tracks = tracker.step(box_scan(t, boxes[: 2 if t >= 0.5 else 1]))
            yield from ((t, event.track_id) for event in tracks.events if event.kind == "delete")

    assert list(ended(LifeCycle)) == [(1.2, 1)]
    assert list(ended(LorryEnds)) == [(1.2, 2)]


def test_of_vehicles_that_were_never_alone_one_stays_that_does_not_end():
    tracker = default_tracker()
    tracker.add(0.0, np.zeros((2, 4)), np.tile(np.eye(4), (2, 1, 1)), box=np.array([[-9.0, -9, 18, 18]] * 2))
    register = tracker.register
    register.merged[:], register.alone_s[:], register.merged_since_s[:] = 7, [0.2, 0.1], 0.0
    for ending, parts in (([False, False], [False, True]), ([True, False], [True, False])):
        assert tracker.sharing.parts(register, tracker.bank, 60.0, np.array(ending)).tolist() == parts
