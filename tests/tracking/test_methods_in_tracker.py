"""Every one-scan method inside the tracker: whatever comes, states stay sound and identities are never reused."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vidtrack as vt
from vidtrack.tracking.immediate import CLAIMED
from vidtrack.tracking.methods import METHODS

ALL = {**METHODS, "greedy": vt.GreedyGNN, "jpda-star": lambda: vt.JPDA(star=True)}


def scan(t, z, seed=0):
    z = np.asarray(z, float).reshape(-1, 2)
    return vt.Scan(t, z, 4.0 * np.eye(2), amplitude=2 + np.random.default_rng(seed).exponential(3.0, len(z)))


EXCLUSIVE = {"gnn", "greedy", "mht"}
"""Methods that give no measurement to two tracks."""
SHARING = {"jpda", "jpda-star"}
"""Methods that give no measurement away more than once in sum, but for the little that confirmed tracks leave."""


class Watch:
    """A tracker whose decisions and snapshots are checked as they come."""

    def __init__(self, method, **settings):
        self.method = method
        self.tracker = vt.Tracker(associate=ALL[method](), **settings)
        self.gone, self.alive = set(), set()
        self._update = self.tracker.bank.update
        self.tracker.bank.update = self._decided

    def _decided(self, decision, scan, sensor):
        total = decision.beta0 + np.bincount(decision.row, decision.beta, len(decision.parent))
        np.testing.assert_allclose(total, 1.0, atol=1e-9)
        assert ((decision.beta >= 0) & (decision.beta <= 1 + 1e-9)).all()
        if self.method in SHARING:
            approximate = np.zeros(len(total)) if decision.approximate is None else decision.approximate
            given = approximate[decision.row] == 0
            assert np.bincount(decision.measurement[given], decision.beta[given]).max(initial=0.0) <= 1 + CLAIMED
        self._update(decision, scan, sensor)

    def step(self, scan):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            tracks = self.tracker.step(scan)
        ids = set(tracks.id.tolist())
        assert len(ids) == len(tracks), "two tracks of one identity"
        assert not ids & self.gone, "an identity came back"
        self.gone |= self.alive - ids
        self.alive = ids
        assert np.isfinite(tracks.x).all()
        assert not len(tracks) or np.linalg.eigvalsh(tracks.P).min() > 0
        assert ((tracks.existence >= 0) & (tracks.existence <= 1)).all()
        if self.method in EXCLUSIVE:
            taken = tracks.measurement[tracks.measurement >= 0]
            assert len(taken) == len(set(taken.tolist())), "two tracks with one measurement"
        return tracks


@pytest.mark.parametrize("method", ALL)
@given(
    seed=st.integers(0, 2**32 - 1),
    detection=st.sampled_from([0.0, 0.5, 0.9, 1.0, None]),
    clutter=st.sampled_from([0.0, 1e-5, 1e-2, None]),
    gate=st.sampled_from([0.0, 0.9, 0.999, 1.0]),
    life=st.sampled_from([vt.LifeCycle(), vt.LogRatio()]),
)
@settings(max_examples=20, deadline=None)
def test_random_sequences(method, seed, detection, clutter, gate, life):
    rng = np.random.default_rng(seed)
    watch = Watch(method, gate=gate, detection_probability=detection, clutter_density=clutter, life=life, smooth=True)
    targets, velocity = rng.uniform(0, 60, (5, 2)), rng.normal(0, 10, (5, 2))
    t = 0.0
    for k in range(25):
        t += rng.choice([0.0, 0.04, 0.04, 0.04, 0.5])
        targets = targets + 0.04 * velocity
        seen = targets[rng.random(5) < 0.8]
        z = np.vstack([seen + 2 * rng.normal(size=seen.shape), rng.uniform(0, 60, (rng.poisson(3), 2))])
        watch.step(scan(t, z, k))


@pytest.mark.parametrize("method", ALL)
def test_targets_well_apart_are_each_tracked(method):
    watch = Watch(method)
    start = np.array([[0.0, 0.0], [300.0, 0.0], [0.0, 300.0]])
    rng = np.random.default_rng(0)
    for k in range(30):
        tracks = watch.step(scan(0.04 * k, start + 2.0 * k + rng.normal(size=(3, 2)), k))
    assert len(tracks) == 3
    assert (tracks.status == vt.Status.CONFIRMED).all()
    order = np.lexsort(tracks.xy.T[::-1])
    np.testing.assert_allclose(tracks.xy[order], (start + 58.0)[np.lexsort(start.T[::-1])], atol=4.0)


@pytest.mark.parametrize("spread", [0.0, 1.0])
@pytest.mark.parametrize("count", [1, 5])
@pytest.mark.parametrize("method", ALL)
def test_a_heap_of_measurements_in_the_gates_of_all_tracks(method, count, spread):
    """10,000 measurements at one place or scattered in the gates, twice, and none afterwards."""
    watch = Watch(method, births=False)
    watch.tracker.add(0.0, np.zeros((count, 4)), np.tile(np.eye(4), (count, 1, 1)))
    rng = np.random.default_rng(0)
    for t in (0.04, 0.08):
        watch.step(scan(t, spread * rng.normal(size=(10_000, 2))))
        assert len(watch.tracker.bank) <= 200 * count, "as many rows as tracks have leaves at most"
    watch.step(scan(0.12, np.empty((0, 2))))


@pytest.mark.parametrize("method", [name for name in ALL if name not in ("split", "mht")])
def test_a_heap_of_measurements_starts_one_track(method):
    watch = Watch(method)
    for k in range(4):
        tracks = watch.step(scan(0.04 * k, np.zeros((2000, 2))))
        assert 1 <= len(tracks) <= 1 + k


@pytest.mark.parametrize("method", ALL)
def test_a_scattered_heap_starts_few_tracks(method):
    watch, rng = Watch(method), np.random.default_rng(0)
    for k in range(3):
        tracks = watch.step(scan(0.04 * k, 0.5 * rng.normal(size=(10_000, 2))))
        assert 1 <= len(tracks) <= 6 * (1 + k)


def test_measurements_apart_each_start_a_track_in_their_own_run():
    z = np.array([[0.5, 0.5], [0.6, 0.6], [9.5, 0.5], [0.5, 0.5]])
    tracks = vt.Tracker().step(vt.Scan(0.0, z, np.eye(2), run=[0, 0, 0, 1]))
    assert tracks.measurement.tolist() == [0, 2, 3]


@pytest.mark.parametrize("method", ALL)
def test_identical_tracks_gaps_and_repeated_times(method):
    watch = Watch(method, births=False)
    watch.tracker.add(0.0, np.zeros((300, 4)), np.tile(np.eye(4), (300, 1, 1)))
    for t in (0.0, 0.0, 0.04, 3600.0, 3600.0, 3600.04):
        watch.step(scan(t, np.zeros((5, 2))))
    with pytest.raises(vt.ScanError, match="before the last scan"):
        watch.step(scan(3600.0, np.zeros((5, 2))))


@pytest.mark.parametrize("method", ["sn", "psn"])
def test_methods_that_need_a_strength_say_so(method):
    with pytest.raises(vt.ScanError, match="neither amplitudes nor scores") as refused:
        vt.Tracker(associate=ALL[method]()).step(vt.Scan(0.0, np.zeros((1, 2)), np.eye(2)))
    assert refused.value.exit_code == 2


def test_a_lorry_does_not_become_a_car():
    """Two vehicles change places under each other; their classes, seen now and then, keep them apart."""
    tracker = vt.Tracker(vt.ConstantVelocity(dim=2, accel=500.0))
    for k in range(20):
        place = np.array([[3.0 * k, 0.0], [57.0 - 3.0 * k, 0.0]])
        label = [1, 2] if k % 3 else [1, -1]
        tracks = tracker.step(vt.Scan(0.04 * k, place, np.eye(2), label=label))
    np.testing.assert_allclose(tracks.xy[np.argsort(tracks.id)], place, atol=1.0)
    assert tracker.register.label.tolist() == [1, 2]
