"""The page's counts are those of `measure`, however its gates were drawn before."""

import numpy as np
import pytest
from drawn_runs import CALIBRATED, SITE, site, straight, write_run

from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.measures.measure import measured
from vidtrack.traffic.measures.recount import Recount

ZONE = {"zones": {"box": {"polygon": [[200, 100], [420, 100], [420, 400], [200, 400]]}}}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Vehicles at all angles, and some that are lost between the gates and found again."""
    rng = np.random.default_rng(5)
    tracks = []
    for track in range(60):
        start, angle = rng.uniform(0, 50), rng.uniform(-0.3, 0.3)
        number, t, xy = straight(track, start, rng.uniform(20, 300), 0, 90 * np.cos(angle), rng.uniform(2, 6))
        xy[:, 1] = rng.uniform(60, 420) + 90 * np.sin(angle) * (t - start)
        tracks.append((number, t, xy))
        if track % 3 == 0:
            tracks.append((100 + track, t + t[-1] - start + 0.6, xy + (xy[-1] - xy[0]) + 0.6 * 90 * np.array([1, 0])))
    kept = [(one, t[inside], xy[inside]) for one, t, xy in tracks for inside in [(xy[:, 0] < 620) & (t < 59.9)]]
    folder = tmp_path_factory.mktemp("recount") / "run"
    return write_run(folder, [track for track in kept if len(track[1]) > 3], metres=True, covariances=True)


def tallied(run, place):
    """Counts, stays and movements by `measure`."""
    found = measured([run], place)
    counts = {}
    for row in found.tables["intervals"].to_pylist():
        counts.setdefault(row["gate"], {}).setdefault(row["direction"], 0)
    for row in found.tables["crossings"].to_pylist():
        counts[row["gate"]][row["direction"]] += 1
    moved = [(one["from"], one["to"], one["trips"]) for one in found.report["movements"]]
    return counts, {"box": len(found.tables["stays"])}, moved, found.report


@pytest.mark.parametrize("tree", [SITE | ZONE, CALIBRATED | ZONE], ids=["picture", "metres"])
def test_counts_while_a_gate_is_moved_are_those_of_measure(run, tree):
    recount, joined = Recount([run]), 0
    for x in (300, 310, 260, 300):
        bent = {"line": [[x, 0], [x + 20, 200], [x, 479]]}
        place = site(tree, gates=tree["gates"] | {"middle": bent}, zones=ZONE["zones"])
        tally = recount.of(place, calibrated(place) if place.calibration else None)
        counts, stays, moved, report = tallied(run, place)
        assert (tally.counts, tally.stays, tally.movements) == (counts, stays, moved)
        assert tally.trips == report["trips"]
        assert not tally.faults
        joined += report["joins"]
    assert (joined > 0) == bool(place.calibration)


def test_without_a_road_a_calibration_counts_for_nothing(run):
    """As while its points are drawn and are not right yet."""
    recount = Recount([run])
    assert recount.of(site(CALIBRATED), None) == recount.of(site(SITE), None)


def test_what_lies_above_the_horizon_counts_nothing_and_the_rest_goes_on(run):
    tilted = {"picture": [[290, 150], [350, 150], [639, 479], [0, 479]], "ground": [[0, 50], [10, 50], [10, 0], [0, 0]]}
    low = {name: {"line": [[x, 200], [x, 479]]} for name, x in (("west", 200), ("east", 400))}
    sky = {"zones": {"clouds": {"polygon": [[0, 0], [9, 0], [9, 9]]}}}
    place = site(SITE | sky, calibration=tilted, gates=low | {"sky": {"line": [[10, 1], [600, 1]]}})
    tally = Recount([run]).of(place, calibrated(place))
    assert [fault.key for fault in tally.faults] == [("gates", "sky"), ("zones", "clouds")]
    assert all("above the horizon" in fault.words for fault in tally.faults)
    sky["zones"]["clouds"]["tracked"] = False
    masked = site(SITE | sky, calibration=tilted, gates=low)
    assert not Recount([run]).of(masked, calibrated(masked)).faults
    alone = site(SITE, calibration=tilted, gates=low)
    assert tally.counts == tallied(run, alone)[0]
    assert sum(tally.counts["west"].values()) > 0


def test_of_a_long_run_the_beginning_is_counted(run, monkeypatch):
    monkeypatch.setattr("vidtrack.traffic.measures.blocks.BLOCK", 100)
    recount = Recount([run], most=1000)
    assert 0 < recount.until_s < 30
    seen = sum(recount.of(site(), None).counts["middle"].values())
    assert 0 < seen < sum(tallied(run, site())[0]["middle"].values())
    assert Recount([run], most=100_000).until_s is None


def test_paths_lie_where_vehicles_are_counted(run):
    recount = Recount([run])
    fine, xy = recount.paths(site(), None)
    assert fine.sum() == len(xy)
    assert fine.min() >= 2
    place = site(CALIBRATED)
    on_road, there = recount.paths(place, calibrated(place))
    assert len(on_road) == len(fine)
    np.testing.assert_allclose(there[0], xy[0], atol=1.0)  # seen from above, at the same place


def test_paths_of_a_run_without_tracks_are_none(tmp_path):
    recount = Recount([write_run(tmp_path / "run", [])])
    lengths, xy = recount.paths(site(), None)
    assert (len(lengths), len(xy)) == (0, 0)
    assert recount.of(site(), None).movements == []
