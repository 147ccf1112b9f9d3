"""The tracker's promises, whatever comes in."""

from collections import Counter

import numpy as np
import pytest
from blob_scene import SIZE, centred, confirmed_ids, default_tracker, events, play
from hypothesis import example, given, settings
from hypothesis import strategies as st

from vidtrack.associate.gate import Gate
from vidtrack.associate.hard import GNN, NN
from vidtrack.errors import ConfigError, ScanError
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.scan import Scan
from vidtrack.tracking.lifecycle import LifeCycle
from vidtrack.tracking.occlusion.occlusion import Occlusion
from vidtrack.tracking.picture.picture import Picture
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracks import Status

EYE = np.eye(2)
NOTHING = np.empty((0, 2))


def wandering_scans(rng, count, boxes):
    """Scans of a few wandering objects, now and then missed, repeated, doubled or far away; time may stand still."""
    place, t = rng.uniform([0, 0], SIZE, (4, 2)), 0.0
    for _ in range(count):
        t += rng.choice([0.0, 0.02, 0.1, 0.7, 5.0], p=[0.1, 0.3, 0.4, 0.15, 0.05])
        place += 4 * rng.normal(size=place.shape)
        z = place[rng.random(len(place)) < 0.8]
        z = np.vstack([z, z[:1], rng.uniform([0, 0], SIZE, (rng.integers(0, 2), 2))])
        size = rng.choice([8.0, 20.0, 60.0], (len(z), 2))
        yield Scan(t, z, rng.choice([0.01, 1.0, 100.0]) * EYE, box=np.hstack([-size / 2, size]) if boxes else None)


def check_snapshot(tracks):
    assert len(set(tracks.id.tolist())) == len(tracks)
    assert np.isfinite(tracks.x).all()
    np.testing.assert_array_equal(tracks.P, np.swapaxes(tracks.P, 1, 2))
    assert (np.linalg.eigvalsh(tracks.P) > 0).all()
    assert ((tracks.existence > 0) & (tracks.existence < 1)).all()
    assert (tracks.age_s >= 0).all()
    np.testing.assert_array_equal(tracks.group >= 0, tracks.status == Status.MERGED)
    np.testing.assert_array_equal(tracks.group >= 0, np.isfinite(tracks.group_since_s))
    members = Counter(tracks.group[tracks.group >= 0].tolist())
    assert all(count > 1 for count in members.values()), "a group of one"


def check_exclusive(before, after):
    """No two tracks on one measurement. Newcomers may rise from a blob that hides more than its tracks."""
    known = np.isin(after.id, [] if before is None else before.id[before.status != Status.TENTATIVE])
    for members in (known & (after.group < 0), ~known):
        taken = after.measurement[members & (after.measurement >= 0)].tolist()
        assert len(set(taken)) == len(taken), "two tracks on one measurement"


def check_events(before, after):
    """Every change between two snapshots is told, and nothing else."""
    told = {
        kind: sorted(e.track_id for e in after.events if e.kind == kind) for kind in ("birth", "confirmed", "delete")
    }
    old = set() if before is None else set(before.id.tolist())
    new = set(after.id.tolist())
    assert told["birth"] == sorted(new - old)
    assert told["delete"] == sorted(old - new)
    was = {} if before is None else dict(zip(before.id.tolist(), before.status.tolist(), strict=True))
    believed = {i for i, s in zip(after.id.tolist(), after.status.tolist(), strict=True) if s != Status.TENTATIVE}
    assert set(told["confirmed"]) & new == {i for i in believed if was.get(i, Status.TENTATIVE) == Status.TENTATIVE}
    grouped = set() if before is None else set(before.id[before.group >= 0].tolist())
    now = set(after.id[after.group >= 0].tolist())
    told |= {kind: {e.track_id for e in after.events if e.kind == kind} for kind in ("merge", "split")}
    assert now - grouped <= told["merge"]
    assert (grouped - now) & new <= told["split"] <= grouped
    assert all(e.t == after.t and e.reason for e in after.events)


@given(seed=st.integers(0, 2**32 - 1), rule=st.sampled_from([NN(), GNN()]), boxes=st.booleans())
@settings(max_examples=60, deadline=None)
@example(seed=3519, rule=NN(), boxes=True)  # a tentative track on a shared blob that hides more
def test_promises_hold_for_any_sequence_of_scans(seed, rule, boxes):
    rng = np.random.default_rng(seed)
    tracker = Tracker(
        ConstantVelocity(accel=20.0, cross=5.0, speed=60.0, hold_s=0.5),
        rule,
        life=LifeCycle(coast_s=1.0, coast_scans=None),
        sharing=Occlusion() if boxes else None,
        picture=Picture(SIZE),
    )
    before, newest = None, 0
    for scan in wandering_scans(rng, 25, boxes):
        tracks = tracker.step(scan)
        check_snapshot(tracks)
        if isinstance(rule, GNN):
            check_exclusive(before, tracks)
        check_events(before, tracks)
        born = [e.track_id for e in tracks.events if e.kind == "birth"]
        assert all(i > newest for i in born), "an id came back"
        newest = max([newest, *born])
        before = tracks


def test_the_same_scans_give_the_same_tracks():
    def ids_and_states():
        tracker = default_tracker()
        return [tracker.step(scan) for scan in wandering_scans(np.random.default_rng(11), 40, boxes=True)]

    for one, other in zip(ids_and_states(), ids_and_states(), strict=True):
        np.testing.assert_array_equal(one.id, other.id)
        np.testing.assert_array_equal(one.x, other.x)
        assert one.events == other.events


def test_looking_ahead_changes_nothing():
    plain, curious = default_tracker(), default_tracker()
    for scan in wandering_scans(np.random.default_rng(12), 30, boxes=True):
        for ahead in (0.0, 0.04, 10.0):
            expected = curious.predict((curious.t or 0.0) + ahead)
            assert expected.t == pytest.approx((curious.t or 0.0) + ahead)
            assert (expected.measurement == -1).all()
        one, other = plain.step(scan), curious.step(scan)
        np.testing.assert_array_equal(one.id, other.id)
        np.testing.assert_array_equal(one.x, other.x)
        np.testing.assert_array_equal(one.P, other.P)


def test_prediction_is_where_the_track_will_be():
    tracker = Tracker(ConstantVelocity(accel=0.1))
    for k in range(20):
        tracks = tracker.step(Scan(0.1 * k, np.array([[3.0 * k, 0.0]]), 0.01 * EYE))
    ahead = tracker.predict(tracks.t + 1.0)
    np.testing.assert_allclose(ahead.xy, [[3.0 * 29, 0.0]], atol=0.5)
    assert (ahead.xy_cov[:, 0, 0] > tracks.xy_cov[:, 0, 0]).all()


def test_a_snapshot_does_not_change_later():
    tracker = Tracker()
    first = tracker.step(Scan(0.0, np.array([[1.0, 2.0]]), EYE))
    x, status = first.x.copy(), first.status.copy()
    for k in range(1, 6):
        tracker.step(Scan(0.1 * k, np.array([[1.0 + k, 2.0]]), EYE))
    np.testing.assert_array_equal(first.x, x)
    np.testing.assert_array_equal(first.status, status)


def test_time_never_runs_backwards():
    tracker = Tracker()
    tracker.step(Scan(1.0, np.zeros((1, 2)), EYE))
    with pytest.raises(ScanError, match=r"0\.5 s.*1 s"):
        tracker.step(Scan(0.5, np.zeros((1, 2)), EYE))
    assert len(tracker.step(Scan(1.5, np.zeros((1, 2)), EYE))) == 1  # the refused scan left no trace


def test_time_may_stand_still():
    tracker = Tracker()
    for _ in range(10):
        tracks = tracker.step(Scan(1.0, np.zeros((1, 2)), EYE))
    check_snapshot(tracks)
    assert tracks.id.tolist() == [1]
    assert tracks.xy_cov[0, 0, 0] == pytest.approx(0.1)  # ten looks at once


def test_measurements_of_another_dimension_are_refused():
    with pytest.raises(ScanError, match="3 components"):
        Tracker().step(Scan(0.0, np.zeros((1, 3)), np.eye(3)))


@pytest.mark.parametrize("dim", [1, 3])
def test_tracks_live_in_one_and_three_dimensions(dim):
    tracker = Tracker(ConstantVelocity(dim=dim, accel=1.0))
    for k in range(12):
        tracks = tracker.step(Scan(0.1 * k, np.vstack([np.full(dim, 2.0 * k), np.full(dim, 500.0)]), 0.1 * np.eye(dim)))
    assert tracks.status.tolist() == [Status.CONFIRMED] * 2
    np.testing.assert_allclose(tracks.xy, [np.full(dim, 22.0), np.full(dim, 500.0)], atol=0.5)
    np.testing.assert_allclose(tracks.v[0], 20.0, atol=2)


def test_empty_scans_are_scans():
    tracker = default_tracker()
    for k in range(5):
        assert len(tracker.step(Scan(0.1 * k, NOTHING, EYE, box=np.empty((0, 4))))) == 0
    for k in range(5, 9):
        tracks = tracker.step(
            Scan(0.1 * k, np.array([[100.0 + 5 * k, 50.0]]), EYE, box=np.array([[-10.0, -5, 20, 10]]))
        )
    assert len(tracks) == 1
    tracks = tracker.step(Scan(0.9, NOTHING, EYE))
    assert tracks.measurement.tolist() == [-1]


def test_identical_measurements_are_one_track_each():
    tracker = Tracker()
    for k in range(8):
        tracks = tracker.step(Scan(0.1 * k, np.full((5, 2), 40.0), EYE))
        check_snapshot(tracks)
    assert tracks.id.tolist() == [1, 2, 3, 4, 5]
    assert (tracks.status == Status.CONFIRMED).all()


def test_targets_of_different_runs_never_meet():
    """Three runs of one scene in one tracker are three trackers."""
    rng = np.random.default_rng(3)
    z = np.cumsum(rng.normal(size=(20, 6, 2)), axis=0)
    together = Tracker()
    alone = [Tracker() for _ in range(3)]
    for k in range(20):
        run = np.repeat(np.arange(3), 2)
        all_runs = together.step(Scan(0.1 * k, z[k], EYE, run=run))
        for number, tracker in enumerate(alone):
            own = tracker.step(Scan(0.1 * k, z[k, run == number], EYE))
            np.testing.assert_allclose(all_runs.x[all_runs.run == number], own.x, rtol=1e-12, atol=1e-12)


def test_known_states_can_be_put_in():
    tracker = Tracker()
    x, P = np.array([[5.0, 10.0, 7.0, 0.0]]), np.eye(4)[None]
    assert tracker.add(2.0, x, P).tolist() == [1]
    tracks = tracker.step(Scan(2.1, np.array([[6.0, 7.0]]), EYE))
    assert tracks.id.tolist() == [1]
    assert tracks.status.tolist() == [Status.CONFIRMED]
    np.testing.assert_allclose(tracks.xy, [[6.0, 7.0]], atol=0.1)


@pytest.mark.parametrize(
    ("x", "P", "words"),
    [
        (np.full((1, 4), np.nan), np.eye(4)[None], "state 0 is not finite"),
        (np.zeros((1, 4)), np.full((1, 4, 4), np.inf), "P of state 0 is not finite"),
        (np.zeros((1, 4)), np.triu(np.ones((4, 4)))[None], "P of state 0 is not symmetric"),
        (np.zeros((1, 4)), -np.eye(4)[None], "P of state 0 is not positive definite"),
    ],
)
def test_a_state_that_is_none_is_not_added(x, P, words):
    with pytest.raises(ScanError, match=words):
        Tracker().add(0.0, x, P)


@pytest.mark.parametrize("P", [np.diag([1.0, 0.0, 1.0, 0.0]), np.zeros((4, 4))])
def test_a_state_may_be_known_exactly_in_part_or_whole(P):
    tracker = Tracker(ConstantVelocity(2, 1.0))
    tracker.add(0.0, np.array([[0.0, 1.0, 0.0, 0.0]]), P[None])
    tracks = tracker.step(Scan(1.0, np.array([[1.1, 0.0]]), np.eye(2)))
    assert tracks.measurement.tolist() == [0]
    assert np.linalg.eigvalsh(tracks.P[0]).min() > -1e-12


def test_an_id_that_was_given_is_not_given_again():
    tracker = Tracker()
    tracker.add(0.0, np.zeros((1, 4)), np.eye(4)[None], ids=np.array([7]))
    tracks = tracker.step(Scan(0.0, np.array([[0.0, 0.0], [50.0, 50.0]]), EYE))
    assert tracks.id.tolist() == [7, 8]


def test_choices_tell_who_was_taken_and_who_came_second():
    tracker = Tracker(ConstantVelocity(speed=1.0), explain=True)
    tracker.step(Scan(0.0, np.zeros((1, 2)), EYE))
    tracks = tracker.step(Scan(0.1, np.array([[3.0, 0.0], [1.0, 0.0], [90.0, 0.0]]), EYE))
    choices = tracks.choices
    assert choices.measurement.tolist() == [1]
    assert choices.runner_up.tolist() == [0]
    assert choices.runner_up_d2[0] == pytest.approx(9 * choices.d2[0])
    assert choices.gate[0] == pytest.approx(Gate().limit(2))
    assert choices.weight.tolist() == [1.0]
    assert choices.candidates[0, :3].tolist() == [1, 0, -1]
    assert choices.candidates_weight[0, :2].tolist() == [1.0, 0.0]
    assert choices.candidates_d2[0, :2].tolist() == [choices.d2[0], choices.runner_up_d2[0]]


def test_round_noise_makes_the_confidence_region_the_plain_distance():
    """SPEC trap 12: with isotropic Q and equal R every S is s^2 I, so mahalanobis and euclidean decide alike."""
    rng = np.random.default_rng(9)
    place, v = rng.uniform(0, 100, (8, 2)), 8 * rng.normal(size=(8, 2))
    trackers = [
        Tracker(ConstantVelocity(accel=5.0), gate=gate)
        for gate in (Gate(1 - 1e-15), Gate(distance="euclidean", radius=1e5))
    ]
    for k in range(60):
        z = rng.permutation(place + 0.1 * k * v + rng.normal(size=(8, 2)))
        one, other = (tracker.step(Scan(0.1 * k, z, EYE)) for tracker in trackers)
        np.testing.assert_array_equal(one.measurement, other.measurement)
        np.testing.assert_allclose(one.x, other.x, rtol=1e-9)
    assert len(one) == 8


def street(t):
    """Ten vehicles on two lanes, 1.2 s apart, with a little weave."""
    boxes = []
    for n in range(10):
        x = 60 * (t - 1.2 * n)
        if 0 < x < 320:
            boxes.append(centred(x if n % 2 else 320 - x, 80 + 60 * (n % 2) + 2 * np.sin(2 * t + n), 26, 14))
    return boxes


@pytest.mark.parametrize("seed", range(3))
def test_frame_rate_does_not_change_the_number_of_vehicles(seed):
    counts = {fps: len(confirmed_ids(play(default_tracker(), street, 17.0, fps, 0.5, seed))) for fps in (10, 30)}
    assert counts == {10: 10, 30: 10}


def test_a_vehicle_that_stops_and_goes_on_stays_one():
    def scene(t):
        way = 60 * t if t < 2 else 120 if t < 6 else 120 + 60 * (t - 6)
        return [centred(30 + way, 120, 30, 16)]

    seen = play(default_tracker(), scene, 8.0, jitter=0.4)
    assert len(confirmed_ids(seen)) == 1
    assert not events(seen, "delete")


def test_nothing_can_be_added():
    tracker = Tracker()
    tracker.step(Scan(0.0, np.array([[0.0, 0.0], [50.0, 50.0]]), EYE))
    assert len(tracker.add(0.0, np.empty((0, 4)), np.empty((0, 4, 4)))) == 0
    assert (tracker.register.status == Status.TENTATIVE).all()


def test_no_prediction_into_the_past():
    tracker = Tracker()
    tracker.step(Scan(1.0, np.zeros((1, 2)), EYE))
    with pytest.raises(ScanError, match="before the last scan"):
        tracker.predict(0.5)


@pytest.mark.parametrize("distance", ["mahalanobis", "decoupled", "euclidean"])
def test_nis_and_existence_mean_the_same_whatever_the_gate_compares(distance):
    """A target with matched noise: the normalised innovation squared averages its dimension, and it surely exists."""
    rng = np.random.default_rng(1)
    tracker = Tracker(gate=Gate(0.9999, distance), model=ConstantVelocity(accel=0.5, speed=5.0))
    R = 4.0 * np.array([[1.0, 0.6], [0.6, 1.0]])
    noise = rng.multivariate_normal([0, 0], R, 400)
    seen = [tracker.step(Scan(0.1 * k, 100 + noise[k : k + 1], R)) for k in range(400)]
    assert [int(tracks.id[0]) for tracks in seen] == [1] * 400
    assert 1.5 < np.mean([tracks.nis[0] for tracks in seen[20:]]) < 2.5
    assert seen[-1].existence[0] > 0.99


@pytest.mark.parametrize("rule", ["gnn", GNN])
def test_a_rule_is_given_as_an_instance(rule):
    with pytest.raises(ConfigError, match=r"such as GNN\(\)"):
        Tracker(associate=rule)
