"""Multiple hypotheses: Reid's probabilities, the decisions that wait, and the bounds that hold."""

from itertools import pairwise, product
from math import exp, log, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vidtrack as vt
from vidtrack.associate.two_stage import TwoStage
from vidtrack.state import gather, restore
from vidtrack.tracking.deferred.generation import likeliest
from vidtrack.tracking.deferred.hypotheses import Hypotheses, kept
from vidtrack.tracking.methods import rule

UNPRUNED = {"n_scan": 20, "hypotheses": 100_000, "threshold": 0.0, "mass": 1.0, "branches": 1000}
ETERNAL = vt.LifeCycle(confirm_hits=1, confirm_window=63, coast_scans=62)


def reid_tracker(**model):
    """The tracker of the reference's examples: one dimension, everything gated, nothing pruned."""
    return vt.Tracker(
        vt.ConstantVelocity(dim=1, **model),
        vt.MHT(new_share=0.2, **UNPRUNED),
        gate=1.0,
        life=ETERNAL,
        detection_probability=0.9,
        clutter_density=0.05,
    )


def scan(t, *z):
    return vt.Scan(t, np.reshape(z, (-1, 1)).astype(float), np.eye(1))


def probabilities(tracker):
    """Of all hypotheses over all clusters, falling."""
    found = tracker.timing.forest.hypotheses
    clusters = [np.exp(found.log_p[a:b]) for a, b in zip(found.first[:-1], found.first[1:], strict=True)]
    return np.sort([np.prod(p) for p in product(*clusters)])[::-1]


def test_one_track_and_two_measurements():
    tracker = reid_tracker(accel=1.0, speed=1.0)
    tracker.add(0.0, np.zeros((1, 2)), np.eye(2)[None])
    tracker.step(scan(0.0, 0.5, 3.0))
    expected = [
        0.015360275585411013, 0.0030720551170822018, 0.08220609080674136, 0.0030720551170822018,
        0.0006144110234164404, 0.016441218161348276, 0.7326949118240987, 0.14653898236481974,
    ]  # fmt: skip
    np.testing.assert_allclose(probabilities(tracker), np.sort(expected)[::-1], rtol=1e-9)


def test_two_scans_with_one_measurement_each():
    tracker = reid_tracker(accel=2**0.5, speed=1e-9)  # P(2|1) = R + 0.5
    tracker.step(scan(0.0, 0.0))
    tracker.step(scan(1.0, 1.2))
    expected = [
        0.5249263292146156,
        0.3574901730413107,
        0.10498526584292309,
        0.010498526584292308,
        0.0020997053168584612,
    ]
    np.testing.assert_allclose(probabilities(tracker), expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("tracks", "measurements", "count"),
    [(0, 2, 4), (0, 3, 8), (1, 1, 3), (1, 2, 8), (1, 3, 20), (2, 1, 4), (2, 2, 14), (2, 3, 44), (3, 3, 86)],
)
def test_number_of_hypotheses(tracks, measurements, count):
    tracker = reid_tracker(accel=1.0, speed=1.0)
    tracker.add(0.0, np.arange(2.0 * tracks).reshape(tracks, 2), np.tile(np.eye(2), (tracks, 1, 1)))
    tracker.step(scan(0.0, *(1.5 * np.arange(measurements))))
    assert len(probabilities(tracker)) == count


def reid(scans, detection, clutter, new, accel, speed):
    """Every hypothesis of a few scans in one dimension by plain recursion: a list of probabilities."""
    hypotheses = [(0.0, ())]  # ln weight, ((x, P), ...)
    F, q = np.array([[1.0, 1.0], [0.0, 1.0]]), accel**2 * np.array([[0.25, 0.5], [0.5, 1.0]])
    for k, z in enumerate(scans):
        children = []
        for weight, tracks in hypotheses:
            ahead = [(F @ x, F @ P @ F.T + q) for x, P in tracks] if k else []
            for choice in product(["false", "new", *range(len(ahead))], repeat=len(z)):
                taken = [c for c in choice if isinstance(c, int)]
                if len(set(taken)) < len(taken):
                    continue
                w = weight + (len(ahead) - len(taken)) * log(1 - detection) + len(taken) * log(detection)
                after = list(ahead)
                for c, value in zip(choice, z, strict=True):
                    if c == "false":
                        w += log(clutter)
                    elif c == "new":
                        w += log(new)
                        after.append((np.array([value, 0.0]), np.diag([1.0, speed**2])))
                    else:
                        x, P = ahead[c]
                        S, v = P[0, 0] + 1.0, value - x[0]
                        w += -0.5 * (v * v / S + log(2 * pi * S))
                        K = P[:, 0] / S
                        after[c] = (x + K * v, P - np.outer(K, P[0]))
                children.append((w, tuple(after)))
        hypotheses = children
    weights = np.array([w for w, _ in hypotheses])
    p = np.exp(weights - weights.max())
    return np.sort(p / p.sum())[::-1]


@given(seed=st.integers(0, 2**32 - 1), counts=st.sampled_from([(1, 1, 1), (2, 1), (1, 2), (2, 0, 2), (1, 0, 1, 1)]))
@settings(max_examples=25, deadline=None)
def test_all_hypotheses_of_several_scans_are_those_of_an_enumeration(seed, counts):
    rng = np.random.default_rng(seed)
    cells = [rng.permutation(np.arange(-4, 4))[:n] for n in counts]  # what lies in one cell may start one track only
    scans = [cell + rng.uniform(0.0, 0.99, len(cell)) for cell in cells]
    tracker = reid_tracker(accel=1.5, speed=2.0)
    for k, z in enumerate(scans):
        tracker.step(scan(float(k), *z))
    expected = reid(scans, 0.9, 0.05, 0.01, 1.5, 2.0)
    found = probabilities(tracker)
    assert len(found) == len(expected)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("rule", "left"),
    [
        ({"threshold": 0.06}, 4),
        ({"most": 3}, 3),
        ({"mass": 0.85}, 4),
        ({"mass": 0.80}, 3),
        ({"most": 1}, 1),
        ({"threshold": 0.99}, 1),
    ],
)
def test_pruning_rules(rule, left):
    log_p = np.log([0.4, 0.25, 0.15, 0.1, 0.05, 0.03, 0.02])
    rule = {"threshold": 0.0, "most": 100, "mass": 1.0} | rule
    assert kept(log_p, rule["threshold"], rule["most"], rule["mass"]) == left


def test_what_is_left_after_pruning_sums_to_one():
    p = np.array([0.4, 0.25, 0.15, 0.1, 0.05, 0.03, 0.02])
    every = Hypotheses(np.array([0, 7]), np.log(p), np.arange(8), np.arange(7))
    left = every.only(np.arange(7) < 3)
    np.testing.assert_allclose(np.exp(left.log_p), [0.5, 0.3125, 0.1875])
    np.testing.assert_array_equal(left.leaf, [0, 1, 2])


def test_clusters_come_together_over_a_measurement_and_part_again():
    """Two hypotheses here, two there: four together, and taken apart again what they were."""
    p, q = np.array([0.7, 0.3]), np.array([0.9, 0.1])
    two = Hypotheses(np.array([0, 2, 4]), np.log([*p, *q]), np.array([0, 1, 2, 3, 4]), np.array([0, 1, 2, 3]))
    one = two.merged(np.zeros(2, np.int64), 1, 100, np.inf)
    np.testing.assert_allclose(np.exp(one.log_p), np.sort(np.outer(p, q).ravel())[::-1])
    apart = one.marginal(np.array([0, 0, 2, 2]))
    found = dict(zip(apart.leaf.tolist(), np.exp(apart.log_p), strict=True))
    assert found == pytest.approx({0: 0.7, 1: 0.3, 2: 0.9, 3: 0.1})
    best = two.merged(np.zeros(2, np.int64), 1, 2, np.inf)
    np.testing.assert_allclose(np.exp(best.log_p), np.array([0.63, 0.27]) / 0.9)


def crossing(rng, merged):
    """Two targets through one point; for a while only one measurement half-way between them."""
    for k in range(40):
        x = 2.0 * (k - 20)
        z = np.array([[x, x], [x, -x]]) + 0.7 * rng.normal(size=(2, 2))
        yield k, z.mean(axis=0, keepdims=True) if k in merged else z


def test_ids_do_not_flicker_when_the_likeliest_hypothesis_changes():
    rng = np.random.default_rng(3)
    tracker = vt.Tracker(vt.ConstantVelocity(accel=0.3, speed=4.0), vt.MHT(), clutter_density=1e-4)
    shown, hidden = set(), set()
    for k, z in crossing(rng, range(18, 22)):
        z = np.vstack([z, rng.uniform(-40, 40, (2, 2))])
        tracks = tracker.step(vt.Scan(float(k), z, 0.5 * np.eye(2)))
        ids = set(tracks.id.tolist())
        hidden |= shown - ids
        assert not ids & hidden, "a track came back"
        shown |= ids
    assert (tracks.status == vt.Status.CONFIRMED).sum() >= 2


def test_a_later_scan_corrects_an_earlier_choice():
    """Of two measurements the farther one is the target's, as the next scans show: the track goes on from there."""
    tracker = vt.Tracker(vt.ConstantVelocity(dim=1, accel=1.0, speed=1.0), vt.MHT(n_scan=4), clutter_density=0.01)
    tracker.add(0.0, np.array([[0.0, 1.0]]), np.array([[[1.0, 0.0], [0.0, 1.0]]]))
    first = tracker.step(scan(1.0, 0.8, 2.5))
    assert first.measurement[first.id == 1] == [0]
    for t, z in ((2.0, 4.6), (3.0, 6.4), (4.0, 8.2)):
        last = tracker.step(scan(t, z))
    track = last.id.tolist().index(1)
    assert last.x[track] == pytest.approx([8.2, 1.8], abs=0.6)
    path = tracker.timing.forest.window.past[tracker.timing.forest.shown[0]]
    assert path.tolist() == [4, 3, 2, 1], "of the first scan it now has the second measurement"


@pytest.mark.parametrize("detection", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("clutter", [0.0, 1e-4])
@pytest.mark.parametrize("gate", [0.0, 0.9, 1.0])
def test_limits_of_the_probabilities(detection, clutter, gate):
    tracker = vt.Tracker(
        vt.ConstantVelocity(dim=1), vt.MHT(), gate=gate, detection_probability=detection, clutter_density=clutter
    )
    tracker.add(0.0, np.zeros((2, 2)), np.tile(np.eye(2), (2, 1, 1)))
    for t, z in ((0.0, ()), (1.0, (0.0, 1.0, 50.0)), (2.0, (0.5,)), (3.0, ())):
        tracks = tracker.step(scan(t, *z))
        found = tracker.timing.forest.hypotheses
        assert np.isfinite(found.log_p).all()
        np.testing.assert_allclose(probabilities(tracker).sum(), 1.0)
        assert np.isfinite(tracks.x).all()


def test_what_was_seen_long_ago_costs_nothing():
    """Measurements have running numbers; a tracker that has seen 10^12 goes on like one that has just begun."""
    rng = np.random.default_rng(0)
    young, old = (vt.Tracker(vt.ConstantVelocity(accel=2.0, speed=5.0), vt.MHT(), clutter_density=1e-3) for _ in "ab")
    for k in range(12):
        one = vt.Scan(float(k), rng.uniform(0, 40, (10, 2)), np.eye(2))
        if k == 6:
            window = old.timing.forest.window
            window.past[window.past >= 0] += 10**12
            window.seen += 10**12
        np.testing.assert_array_equal(young.step(one).x, old.step(one).x)


@given(seed=st.integers(0, 2**32 - 1), most=st.integers(1, 6))
def test_a_row_keeps_its_likeliest_measurements(seed, most):
    """The first of equals, as a stable sort has them."""
    rng = np.random.default_rng(seed)
    start = np.concatenate([[0], np.cumsum(rng.integers(0, 12, 5))])
    value = rng.integers(0, 5, start[-1]).astype(float)
    chosen = likeliest(start, value, most)
    for a, b in pairwise(start):
        first = np.argsort(-value[a:b], kind="stable")[:most]
        np.testing.assert_array_equal(np.flatnonzero(chosen[a:b]), np.sort(first))


def test_a_tentative_track_keeps_its_name_while_it_is_doubted():
    """The likeliest hypothesis calls its first measurements false; once it is believed it has the id of the first."""
    tracker = vt.Tracker(vt.ConstantVelocity(dim=1, accel=0.1, speed=5.0), vt.MHT(n_scan=5), clutter_density=0.1)
    ids, doubts = [], 0
    for k in range(8):
        tracks = tracker.step(scan(float(k), 2.0 * k))
        ids.append(tracks.id.tolist())
        doubts += len(tracker.timing.forest.hypotheses.best) == 0
    assert doubts >= 2
    assert all(1 in known for known in ids)
    assert tracks.status[tracks.id == 1] == [vt.Status.CONFIRMED]


@pytest.mark.parametrize("method", [vt.MHT(), vt.Split()])
def test_unsure_detections_continue_a_track_but_do_not_confirm_it(method):
    tracker = vt.Tracker(
        vt.ConstantVelocity(dim=1, accel=1.0, speed=1.0), method, two_stage=TwoStage(0.5), clutter_density=1e-4
    )
    scores = [0.9, 0.2, 0.9, 0.9, 0.2, 0.2]
    status, taken = [], []
    for k, score in enumerate(scores):
        tracks = tracker.step(vt.Scan(float(k), np.array([[1.0 * k]]), np.eye(1), score=np.array([score])))
        own = tracks.id == 1
        status += tracks.status[own].tolist()
        taken += tracks.measurement[own].tolist()
    assert taken == [0] * 6
    assert [s == vt.Status.TENTATIVE for s in status] == [True] * 3 + [False] * 3


def test_without_births_no_hypothesis_has_any():
    tracker = vt.Tracker(vt.ConstantVelocity(dim=1), vt.MHT(**UNPRUNED), gate=1.0, births=False, clutter_density=0.1)
    tracker.add(0.0, np.zeros((1, 2)), np.eye(2)[None])
    tracker.step(scan(0.0, 0.0, 4.0))
    assert len(probabilities(tracker)) == 3
    assert set(tracker.register.id.tolist()) == {1}


def test_certain_detection_leaves_no_track_without_a_measurement():
    tracker = vt.Tracker(vt.ConstantVelocity(dim=1), vt.MHT(), gate=1.0, detection_probability=1.0, clutter_density=0.1)
    tracker.add(0.0, np.array([[0.0, 0.0], [9.0, 0.0]]), np.tile(np.eye(2), (2, 1, 1)))
    tracks = tracker.step(scan(0.0, 0.0, 4.0))
    assert sorted(tracks.measurement[np.isin(tracks.id, [1, 2])].tolist()) == [0, 1]


def test_the_set_of_hypotheses_stays_bounded():
    rule = vt.MHT(hypotheses=30, branches=5)
    tracker = vt.Tracker(vt.ConstantVelocity(speed=2.0), rule, clutter_density=1e-3, life=vt.LifeCycle(coast_scans=20))
    rng = np.random.default_rng(0)
    rows = []
    for k in range(30):
        tracker.step(vt.Scan(float(k), rng.uniform(0, 60, (40, 2)), np.eye(2)))
        found = tracker.timing.forest.hypotheses
        assert np.diff(found.first).max() <= 30
        assert len(tracker.bank) == len(tracker.register) == len(tracker.timing.forest.window)
        np.testing.assert_array_equal(np.unique(found.leaf), np.arange(len(tracker.bank)))
        rows.append(len(tracker.bank))
    assert max(rows[15:]) < 2 * max(rows[:15]) + 100


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_hypotheses_are_exclusive_and_runs_never_meet(seed):
    """In every hypothesis a measurement serves one leaf, and all leaves of a cluster belong to one run."""
    rng = np.random.default_rng(seed)
    tracker = vt.Tracker(vt.ConstantVelocity(accel=2.0, speed=5.0), vt.MHT(hypotheses=20), clutter_density=1e-3)
    for k in range(12):
        z, run = rng.uniform(0, 40, (12, 2)), np.sort(rng.integers(0, 3, 12))
        tracks = tracker.step(vt.Scan(float(k), z, np.eye(2), run=run))
        found, newest = tracker.timing.forest.hypotheses, tracker.timing.forest.window.past[:, 0]
        for h in range(len(found.log_p)):
            leaves = found.leaf[found.start[h] : found.start[h + 1]]
            used = newest[leaves][newest[leaves] >= 0]
            assert len(set(used.tolist())) == len(used)
            assert len(set(tracker.register.id[leaves].tolist())) == len(leaves)
        runs = tracker.register.run[found.leaf]
        for c in range(len(found.first) - 1):
            assert len(set(runs[found.cluster == c].tolist())) <= 1
        taken = tracks.measurement[tracks.measurement >= 0].tolist()
        assert len(set(taken)) == len(taken)


@pytest.mark.parametrize(
    "wrong",
    [{"n_scan": 0}, {"hypotheses": 0}, {"threshold": 1.0}, {"mass": 0.0}, {"new_share": 0.0}, {"branches": 0}],
)
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(vt.ConfigError, match=str(next(iter(wrong.values())))):
        vt.MHT(**wrong)


def test_likelihood_of_no_track_sums_up_what_it_could_have_been():
    """A birth that is never seen again becomes its false alarm: hypotheses that differ in it only are one."""
    tracker = vt.Tracker(vt.ConstantVelocity(dim=1), vt.MHT(), clutter_density=0.05)
    tracker.step(scan(0.0, 0.0))
    assert len(probabilities(tracker)) == 2
    for t in (1.0, 2.0, 3.0):
        tracker.step(scan(t))
    assert len(tracker.bank) == 0
    assert exp(0) == pytest.approx(probabilities(tracker).sum())


@pytest.mark.parametrize("method", ["mht", "split"])
def test_settings_choose_the_rule_and_how_long_it_waits(method):
    chosen = rule(vt.load_settings(assignments=[f"tracker.method={method}", "tracker.n_scan=5"]).tracker)
    assert chosen == {"mht": vt.MHT(n_scan=5), "split": vt.Split(n_scan=5)}[method]


@pytest.mark.parametrize(
    ("log_p", "follows", "reported"),
    [
        ((0.45, 0.40, 0.15), (True, False, True, False), 1),
        ((0.70, 0.20, 0.10), (True, False, True, False), 0),
        ((0.45, 0.15, 0.40), (True, False, False, True), 0),
        ((0.45, 0.40, 0.15), (True, True, True, True), 0),
    ],
    ids=["about as probable", "clearly less probable", "other histories", "nothing to follow"],
)
def test_tracks_exchange_what_they_took_only_if_that_is_clearly_likelier(log_p, follows, reported):
    """Leaves 0 and 1 are of one track, 2 and 3 of the other; the histories are 5 and 6 in both orders, or 5 and 7."""
    past = np.array([[5], [6], [6], [5]])
    exchanged, as_reported, another = [1, 3], [0, 2], [0, 3]
    found = Hypotheses(
        np.array([0, 3]), np.log(log_p), np.array([0, 2, 4, 6]), np.array(exchanged + as_reported + another)
    )
    assert found.steady(past, np.array(follows), log(3)).tolist() == [reported]


@pytest.mark.parametrize("method", [vt.MHT(), vt.Split()])
def test_a_saved_tracker_goes_on_as_if_it_had_not_stopped(method):
    def new():
        return vt.Tracker(vt.ConstantVelocity(accel=2.0, speed=5.0), method, clutter_density=1e-3)

    rng = np.random.default_rng(0)
    scans = [vt.Scan(float(k), rng.uniform(0, 40, (10, 2)), np.eye(2)) for k in range(12)]
    stopped, straight = new(), new()
    for s in scans[:6]:
        stopped.step(s)
        straight.step(s)
    resumed = new()
    restore(resumed, gather(stopped))
    for s in scans[6:]:
        one, other = resumed.step(s), straight.step(s)
        np.testing.assert_array_equal(one.id, other.id)
        np.testing.assert_array_equal(one.x, other.x)


@given(seed=st.integers(0, 2**32 - 1), method=st.sampled_from([vt.MHT(), vt.MHT(n_scan=1, hypotheses=5), vt.Split()]))
@settings(max_examples=30, deadline=None)
def test_every_life_is_told_once(seed, method):
    """A birth before a track is shown, no more of it after its end, and states that stay sound."""
    rng = np.random.default_rng(seed)
    tracker = vt.Tracker(vt.ConstantVelocity(accel=20.0, speed=30.0), method, clutter_density=1e-4, explain=True)
    born, dead, t = set(), set(), 0.0
    place = rng.uniform(0, 100, (6, 2))
    for _ in range(25):
        t += rng.choice([0.0, 0.1, 0.5])
        place = place + rng.normal(0, 2, place.shape)
        z = np.vstack([place[rng.random(6) < 0.8], rng.uniform(0, 100, (rng.poisson(3), 2))])
        tracks = tracker.step(vt.Scan(t, z, np.eye(2)))
        for event in tracks.events:
            if event.kind == "birth":
                assert event.track_id not in born
                born.add(event.track_id)
            if event.kind == "delete":
                assert event.track_id in born - dead
                dead.add(event.track_id)
        ids = tracks.id.tolist()
        assert len(set(ids)) == len(ids)
        assert set(ids) <= born - dead
        assert set(tracker.register.id.tolist()) <= born - dead
        assert (np.linalg.eigvalsh(tracks.P) > 0).all()
        assert len(set(tracks.choices.track_id.tolist())) == len(tracks.choices.track_id)
