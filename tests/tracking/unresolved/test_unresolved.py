"""Two aircraft that share plots stay two tracks, under each kind of association."""

import numpy as np
import pytest

from vidtrack.associate.hard import GNN
from vidtrack.config.load import load
from vidtrack.radar.plots import read_plots
from vidtrack.radar.scans import measurements
from vidtrack.run.radar import build_radar_tracker, track_plots
from vidtrack.scan import Scan
from vidtrack.simulate.radar_scenarios import simulate_radar
from vidtrack.simulate.radar_write import write_radar
from vidtrack.state import gather, read_state, restore, write_state
from vidtrack.tracking.picture.picture import NoPicture
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracking.unresolved.branches import Doubts
from vidtrack.tracking.unresolved.cell import PolarCell
from vidtrack.tracking.unresolved.unresolved import Unresolved
from vidtrack.tracks import MERGED, TENTATIVE

SEED = 404


@pytest.fixture(scope="module")
def parting(tmp_path_factory):
    """Plots of a pair, and the scans in which it gives one plot."""
    folder = tmp_path_factory.mktemp("parting")
    seen = simulate_radar("radar-parting", SEED)
    write_radar(seen, folder)
    return folder / "plots.csv", np.flatnonzero(seen.merged[0]), seen


@pytest.mark.parametrize("method", ["gnn", "jpda", "mht"])
def test_two_tracks_go_through_a_stretch_with_one_plot(parting, method):
    plots, together, seen = parting
    snapshots = [tracks for _, tracks in track_plots(plots, load(assignments=[f"tracker.method={method}"]))]
    early = snapshots[together[0] - 1]
    pair = early.id[(early.status != TENTATIVE)]
    near = [np.linalg.norm(early.xy[early.id == i] - seen.states[:, together[0] - 1, :2], axis=1).min() for i in pair]
    pair = pair[np.array(near) < 1000]
    assert len(pair) == 2
    merged = 0
    for scan in range(together[0], together[-1] + 1):
        tracks = snapshots[scan]
        assert set(pair) <= set(tracks.id), scan
        mine = np.isin(tracks.id, pair)
        merged += (tracks.status[mine] == MERGED).all()
        groups = tracks.group[mine]
        assert (groups >= 0).all() == (tracks.status[mine] == MERGED).all()
        assert groups[0] == groups[1]
    assert merged > 0.8 * len(together)
    last = snapshots[-1]
    assert set(pair) <= set(last.id)
    assert (last.exchange[np.isin(last.id, pair)] > 0.1).all()
    told = [event for tracks in snapshots for event in tracks.events if event.track_id in pair]
    assert {"merge", "split"} <= {event.kind for event in told}
    assert any("exchanged with probability" in event.reason for event in told)


def tracker():
    return Tracker(
        associate=GNN(), picture=NoPicture(), sharing=Unresolved(PolarCell((0.0, 0.0), (150.0, 0.01))),
        clutter_density=1e-9,
    )  # fmt: skip


def scans(count):
    """Two targets on parallel courses 5 km away, 40 m apart in range: one plot of both in each scan."""
    for k in range(1, count):
        yield Scan(float(k), np.array([[10.0 * k, 5000.0]]), 4 * np.eye(2))


def test_the_middle_is_followed_and_the_difference_less_and_less_known():
    run = tracker()
    run.add(0.0, np.array([[0.0, 10, 5020, 0], [0.0, 10, 4980, 0]]), np.tile(np.diag([4.0, 1, 4, 1]), (2, 1, 1)))
    wide = []
    for scan in scans(20):
        tracks = run.step(scan)
        assert len(tracks) == 2
        wide.append(tracks.xy_cov[0, 1, 1])
    assert (tracks.status == MERGED).all()
    np.testing.assert_allclose(tracks.xy.mean(axis=0), [190, 5000], atol=2)
    assert wide[-1] > wide[5] > wide[0]
    assert wide[-1] < 150**2


@pytest.mark.parametrize(
    ("scenario", "seed"),
    [("radar-parting", 709), ("radar-parting", 717), ("radar-parting", 738), ("radar-unresolved", 404)],
    ids=["parted too early", "missed as they part", "parted late", "order in doubt in one scan"],
)
def test_what_later_scans_explain_otherwise_costs_no_track(tmp_path, scenario, seed):
    seen = simulate_radar(scenario, seed)
    write_radar(seen, tmp_path)
    together = np.flatnonzero(seen.merged[0])
    snapshots = [tracks for _, tracks in track_plots(tmp_path / "plots.csv")]
    early = snapshots[together[0] - 2]
    off = np.linalg.norm(early.xy[:, None] - seen.states[:, together[0] - 2, :2], axis=2).min(axis=1)
    pair = early.id[(early.status != TENTATIVE) & (off < 1000)]
    assert len(pair) == 2
    for scan in range(together[0], len(snapshots)):
        assert set(pair) <= set(snapshots[scan].id), scan
    tracks = snapshots[-1]
    off = np.linalg.norm(tracks.xy[np.isin(tracks.id, pair)][:, None] - seen.states[:, -1, :2], axis=2)
    assert (off.min(axis=0) < 500).all()
    assert (off.min(axis=1) < 500).all()


@pytest.mark.parametrize("method", ["gnn", "jpda", "mht"])
def test_a_pair_that_follows_a_branch_reports_its_plots(tmp_path, monkeypatch, method):
    write_radar(simulate_radar("radar-parting", 712), tmp_path)
    follow, followed, count = Doubts._follow, {}, 0

    def noted(self, pair, number, *rest):
        best = self.of_pair[pair].branches[number]
        followed.update(zip(pair, best.plots, strict=True))
        follow(self, pair, number, *rest)

    monkeypatch.setattr(Doubts, "_follow", noted)
    for _, tracks in track_plots(tmp_path / "plots.csv", load(assignments=[f"tracker.method={method}"])):
        reported = dict(zip(tracks.id.tolist(), tracks.measurement.tolist(), strict=True))
        assert {track: reported[track] for track in followed if track in reported}.items() <= followed.items()
        count += len(followed)
        followed.clear()
    assert count


def test_a_pair_that_parts_keeps_its_order_under_mht(tmp_path):
    """Both orders stay about equally probable for some scans: the report does not go to and fro between them."""
    seen = simulate_radar("radar-parting", 428)
    write_radar(seen, tmp_path)
    nearest = []
    for scan, tracks in track_plots(tmp_path / "plots.csv", load(assignments=["tracker.method=mht"])):
        if scan > np.flatnonzero(seen.merged[0])[-1]:
            off = np.linalg.norm(tracks.xy - seen.states[0, scan, :2], axis=1)
            nearest.append(int(tracks.id[off.argmin()]))
    assert len(set(nearest)) == 1


@pytest.mark.parametrize(("north", "branches"), [([5020, 4980], True), ([5020, 4980, 5000], False)])
def test_tracks_near_to_several_others_have_no_branches(north, branches):
    run = tracker()
    run.add(0.0, np.array([[0.0, 10, y, 0] for y in north]), np.tile(np.diag([4.0, 1, 4, 1]), (len(north), 1, 1)))
    had = False
    for scan in scans(20):
        tracks = run.step(scan)
        had |= bool(run.sharing._doubts.of_pair)
    assert had == branches
    assert tracks.id.tolist() == list(range(1, len(north) + 1))
    assert (tracks.status == MERGED).all()


@pytest.mark.parametrize(
    ("method", "stop"),
    [("gnn", "just before one is followed"), ("gnn", "restored twice"), ("mht", "while branches are kept")],
)
def test_branches_go_on_from_a_saved_state(tmp_path, monkeypatch, method, stop):
    """A false plot parts this pair, which a branch keeps together."""
    write_radar(simulate_radar("radar-parting", 709), tmp_path)
    settings = load(assignments=[f"tracker.method={method}"])
    found = measurements(read_plots(tmp_path / "plots.csv", settings.radar), settings.radar)
    follow, followed, saved, expected = Doubts._follow, [], [], []
    monkeypatch.setattr(Doubts, "_follow", lambda *given: (followed.append(len(expected)), follow(*given)))
    straight = build_radar_tracker(settings, found)
    for _, scan in found:
        saved.append(gather(straight))
        expected.append(straight.step(scan))
    branches = [len(state.get("sharing.branches.whose", ())) for state in saved]
    at = followed[0] if stop == "just before one is followed" else np.flatnonzero(branches)[2]
    assert branches[at]
    write_state(tmp_path / "state", saved[at])
    state = read_state(tmp_path / "state")
    for _ in range(1 + (stop == "restored twice")):
        resumed = build_radar_tracker(settings, found)
        restore(resumed, state)
        state = gather(resumed)
    for k, (_, scan) in enumerate(found):
        if k >= at:
            tracks = resumed.step(scan)
            for name in ("x", "P", "id", "exchange", "status"):
                np.testing.assert_array_equal(getattr(tracks, name), getattr(expected[k], name))


def test_a_saved_state_goes_on_as_if_it_had_not_been_saved():
    first, second = tracker(), tracker()
    steps = list(scans(14))
    first.add(0.0, np.array([[0.0, 10, 5020, 0], [0.0, 10, 4980, 0]]), np.tile(np.diag([4.0, 1, 4, 1]), (2, 1, 1)))
    for scan in steps[:8]:
        first.step(scan)
    restore(second, gather(first))
    for scan in steps[8:]:
        ours, theirs = first.step(scan), second.step(scan)
        np.testing.assert_array_equal(ours.x, theirs.x)
        np.testing.assert_array_equal(ours.group, theirs.group)
