"""Groups of targets: who belongs together, where the group is, how many it is, and when it splits or merges."""

import numpy as np
import pytest

import vidtrack as vt
from vidtrack.associate.gate import Gate
from vidtrack.associate.redundancy import linked

Z = np.array([[0.0, 0.0], [1.0, 0.5], [0.5, 1.0], [10.0, 10.0], [11.0, 10.5]])


def scan(t, z, sigma=1.0):
    return vt.Scan(t, np.asarray(z, float).reshape(-1, 2), sigma**2 * np.eye(2))


def groups(link=3.0, merge=3.0, by="members", scans=3, **options):
    model = vt.ConstantVelocity(accel=0.5, speed=10.0)
    return vt.GroupTracker(vt.Formation(link, merge, scans, by), model=model, **options)


def test_single_linkage_and_centroids():
    """SPEC 001, `group`."""
    assert linked(scan(0.0, Z), Gate(distance="euclidean", radius=3.0)).tolist() == [0, 0, 0, 3, 3]
    found = groups().step(scan(0.0, Z))
    np.testing.assert_allclose(found.tracks.xy, [[0.5, 0.5], [10.5, 10.25]], atol=1e-12)
    np.testing.assert_allclose(found.tracks.xy_cov, [np.eye(2) / 3, np.eye(2) / 2], atol=1e-12)
    assert found.seen.tolist() == [3, 2]


def test_groups_that_come_close_are_one_weighted_by_their_members():
    """SPEC 001, `group`: three members around (0, 0) and two around (2, 0) have their centre at (0.8, 0)."""
    tracker = groups(link=1.0, merge=1.0, scans=2)
    three = np.array([[0.0, 0.5], [0.0, -0.5], [0.0, 0.0]])
    two = np.array([[0.0, 0.3], [0.0, -0.3]])
    for k in range(5):
        found = tracker.step(scan(k, np.vstack([three, two + 2.0 * np.eye(2)[0]]), 0.1))
    assert found.size.tolist() == [3, 2]
    tracker._close = Gate(distance="euclidean", radius=3.0)
    found = tracker.step(scan(5, np.vstack([three, two + 2.0 * np.eye(2)[0]]), 0.1))
    np.testing.assert_allclose(found.tracks.xy, [[0.8, 0.0]], atol=1e-9)
    assert found.tracks.id.tolist() == [1]
    assert [event.kind for event in found.tracks.events] == ["merge", "merge"]


def flight(rng, k, shape, speed=(20.0, 5.0), detection=1.0, sigma=1.0):
    z = shape + np.array(speed) * k
    z = z[rng.random(len(z)) < detection]
    return z + sigma * rng.normal(size=z.shape)


SHAPE = np.array([[0.0, 0.0], [30.0, 0.0], [60.0, 0.0], [30.0, 30.0], [60.0, 30.0]])


@pytest.mark.parametrize("by", ["measurements", "members"])
def test_a_group_with_misses_keeps_its_size_and_its_way(by):
    rng = np.random.default_rng(0)
    tracker, error = groups(link=40.0, merge=20.0, by=by), []
    for k in range(60):
        found = tracker.step(scan(k, flight(rng, k, SHAPE, detection=0.8 if k > 5 else 1.0)))
        if k > 10:
            assert len(found.tracks) == 1
            assert found.size.tolist() == [5]
            error.append(found.tracks.xy[0] - SHAPE.mean(axis=0) - [20.0 * k, 5.0 * k])
            assert found.tracks.v[0] == pytest.approx([20.0, 5.0], abs=6.0)
    spread = np.sqrt(np.mean(np.square(error)))
    assert spread < {"measurements": 6.0, "members": 1.5}[by]


def test_members_that_one_plot_stands_for_are_still_counted():
    rng = np.random.default_rng(0)
    tracker = groups(link=40.0, merge=20.0)
    for k in range(30):
        shape = SHAPE[:2] if k < 10 or k >= 20 else SHAPE[:2].mean(axis=0, keepdims=True)
        found = tracker.step(scan(k, flight(rng, k, shape)))
        if k >= 5:
            assert found.size.tolist() == [2]
            assert found.tracks.id.tolist() == [1]
    assert found.seen.tolist() == [2]


def test_a_group_splits_after_the_gap_has_lasted_and_not_before():
    rng = np.random.default_rng(0)
    tracker, ids = groups(link=40.0, merge=20.0), []
    for k in range(40):
        shape = SHAPE.copy()
        shape[3:] += [0.0, 12.0 * max(k - 10, 0)]
        found = tracker.step(scan(k, flight(rng, k, shape)))
        ids.append(found.tracks.id.tolist())
        for event in found.tracks.events:
            if event.kind == "split":
                assert 13 <= k <= 15
    assert ids[8] == [1]
    assert len(ids[-1]) == 2
    assert ids[-1][0] == 1 or 1 in ids[-1]
    order = np.argsort(found.tracks.xy[:, 1])
    assert found.size[order].tolist() == [3, 2]
    np.testing.assert_allclose(found.tracks.v[order], [[20.0, 5.0], [20.0, 17.0]], atol=2.0)


def test_a_gap_in_one_scan_splits_nothing():
    rng = np.random.default_rng(0)
    tracker = groups(link=40.0, merge=20.0)
    for k in range(20):
        z = flight(rng, k, SHAPE)
        found = tracker.step(scan(k, z[[0, 4]] if k == 12 else z))
        if k > 4:
            assert found.tracks.id.tolist() == [1]


def test_clutter_beside_a_group_is_not_counted():
    rng = np.random.default_rng(0)
    tracker = groups(link=40.0, merge=20.0)
    for k in range(60):
        z = flight(rng, k, SHAPE)
        near = SHAPE.mean(axis=0) + np.array([20.0, 5.0]) * k + rng.uniform(-60, 60, (rng.poisson(0.3), 2))
        found = tracker.step(scan(k, np.vstack([z, near])))
    assert found.size[found.tracks.id == 1].tolist() == [5]


def test_empty_scans_and_the_end_of_a_group():
    tracker = groups()
    assert len(tracker.step(scan(0.0, np.empty((0, 2)))).tracks) == 0
    for k in range(1, 5):
        tracker.step(scan(k, Z[:3]))
    for k in range(5, 15):
        found = tracker.step(scan(k, np.empty((0, 2))))
    assert len(found.tracks) == 0
    assert len(tracker.members.group) == 0
    with pytest.raises(vt.ScanError, match="before the last scan"):
        tracker.step(scan(1.0, Z))


def test_a_heap_is_one_group():
    tracker = groups()
    for k in range(2):
        found = tracker.step(scan(k, np.zeros((1500, 2))))
    assert len(found.tracks) == 1


@pytest.mark.parametrize("bad", [{"link": 0.0}, {"merge": np.inf}, {"scans": 0}, {"by": "mean"}])
def test_a_rule_that_makes_no_sense_is_refused(bad):
    with pytest.raises(vt.ConfigError):
        vt.Formation(**{"link": 1.0, "merge": 1.0} | bad)
