"""Trips through the site, broken tracks, and the checks that need no truth."""

import numpy as np
import pytest
from drawn_runs import CALIBRATED, along, site, straight, write_run

from vidtrack.traffic.measures.joins import joined, odds
from vidtrack.traffic.measures.lives import End
from vidtrack.traffic.measures.measure import measured

PLACE = CALIBRATED | {"movements": {"allowed": [["west", "east"]]}}


def test_a_whole_trip_and_three_that_are_not(tmp_path):
    tracks = [
        straight(1, 10.0, 50, 240, 100, 5),  # all the way
        straight(2, 57.0, 50, 200, 100, 2.9),  # still on its way at the end
        straight(3, 0.0, 300, 150, 100, 3),  # was there at the beginning
        straight(4, 20.0, 50, 300, 100, 2),  # is lost
        straight(5, 40.0, 250, 300, 100, 3),  # comes from nowhere
    ]
    found = measured([write_run(tmp_path / "run", tracks, metres=True)], site(PLACE))
    rows = {row["track_id"]: row for row in found.tables["trips"].to_pylist()}
    assert (rows[1]["entry_gate"], rows[1]["exit_gate"], rows[1]["complete"]) == ("west", "east", True)
    assert (rows[1]["begin_s"], rows[1]["end_s"]) == pytest.approx((10.5, 14.5), abs=1e-3)
    assert rows[1]["possible"] is True
    assert {track: row["reason"] for track, row in rows.items()} == {
        1: "",
        2: "was there when watching ended",
        3: "was there when watching began",
        4: "ended between the gates",
        5: "began between the gates",
    }
    assert (found.report["appeared"], found.report["vanished"]) == (1, 1)
    assert found.report["impossible_movements"] == []


def test_at_most_one_trip_a_vehicle(tmp_path):
    t = np.arange(0, 20, 0.04)
    x = np.interp(t, [0, 5, 10, 15, 20], [50, 550, 550, 50, 550])
    found = measured([write_run(tmp_path / "run", [along(1, t, x)], metres=True)], site(PLACE))
    assert len(found.tables["trips"]) == 1


def test_an_impossible_movement_is_told(tmp_path):
    gates = PLACE["gates"] | {"middle": {"line": [[300, 0], [300, 479]], "role": "exit"}}
    place = site(PLACE | {"gates": gates})
    found = measured([write_run(tmp_path / "run", [straight(1, 10.0, 50, 240, 100, 3)], metres=True)], place)
    assert found.report["impossible_movements"] == [{"from": "west", "to": "middle", "trips": 1}]
    assert found.tables["trips"].to_pylist()[0]["possible"] is False


def broken(gap_s, aside_px=0.0):
    """A vehicle whose track is lost for a while before the middle gate, and three others that pass."""
    begin = 10.0 + 2.0 + gap_s
    others = [straight(10 + k, 20.0 + 10 * k, 50, 100, 100, 5) for k in range(3)]
    return [
        straight(1, 10.0, 50, 240, 100, 2),
        straight(2, begin, 50 + 100 * (begin - 10), 240 + aside_px, 100, 15 - begin),
        *others,
    ]


def test_a_broken_track_is_joined_and_its_gate_counted(tmp_path):
    found = measured([write_run(tmp_path / "run", broken(0.8), metres=True)], site(PLACE))
    row = next(row for row in found.tables["trips"].to_pylist() if row["track_id"] == 1)
    assert (row["complete"], row["tracks"], row["exit_gate"]) == (True, 2, "east")
    assert 0.5 < row["join_confidence"] < 1
    middle = [r for r in found.tables["crossings"].to_pylist() if r["gate"] == "middle" and r["track_id"] == 1]
    assert [r["reason"] for r in middle] == ["joined"]
    assert middle[0]["confidence"] == row["join_confidence"]
    assert middle[0]["speed_kmh"] is None


@pytest.mark.parametrize(("gap_s", "aside_px"), [(0.8, 200.0), (-0.5, 0.0)])
def test_tracks_that_do_not_fit_stay_apart(tmp_path, gap_s, aside_px):
    """Too far aside, or at the same time."""
    found = measured([write_run(tmp_path / "run", broken(gap_s, aside_px), metres=True)], site(PLACE))
    assert found.report["joins"] == 0


def ends(t, x):
    n = len(t)
    return End(np.array(t), np.column_stack([x, np.zeros(n)]), np.full(n, 0.3), np.tile([10.0, 0.0], (n, 1)))


def test_of_two_that_fit_alike_neither_is_joined():
    tail, head = ends([1.0, 0, 0], [0.0, 0, 0]), ends([0.0, 1.5, 1.5], [0.0, 5.0, 5.0])
    one, two = np.array([True, False, False]), np.array([False, True, True])
    assert len(joined(tail, head, np.full(3, 4.0), one, two, 3600.0).before) == 0
    alone = joined(tail, head, np.full(3, 4.0), one, np.array([False, True, False]), 3600.0)
    assert (alone.before.tolist(), alone.after.tolist()) == ([0], [1])
    assert alone.probability[0] > 0.9


def test_odds_are_a_density_over_time_and_place():
    """The sum over all places and times is the chance to be found again: a half, less the part after 4 s."""
    gaps, step = np.arange(0.05, 4, 0.1), 0.5
    x, y = np.meshgrid(np.arange(-60, 60, step), np.arange(-60, 60, step))
    total = 0.0
    for gap in gaps:
        n = x.size + 1
        t = np.append(0.0, np.full(x.size, gap))
        xy = np.vstack([[0, 0], np.column_stack([x.ravel(), y.ravel()])])
        end = End(t, xy, np.full(n, 1.0), np.zeros((n, 2)))
        pairs = odds(end, end, np.full(n, 4.0), np.zeros(x.size, int), np.arange(1, n))
        total += pairs.sum() * step**2 * 0.1
    assert total == pytest.approx(0.5 * (1 - np.exp(-4)), rel=0.01)


def test_the_balance_is_of_what_was_lost_and_made(tmp_path):
    tracks = [
        straight(1, 2.0, 50, 240, 100, 5),
        straight(2, 22.0, 50, 300, 100, 2),
        straight(3, 32.0, 250, 100, 100, 3),
    ]
    rows = measured([write_run(tmp_path / "run", tracks, metres=True)], site(PLACE)).tables["checks"].to_pylist()
    assert [row["inflow"] for row in rows] == [1, 0, 1, 0, 0, 0]
    assert [row["outflow"] for row in rows] == [1, 0, 0, 1, 0, 0]
    assert [row["left_over"] for row in rows] == [0, 0, 1, -1, 0, 0]
    assert all(row["inflow"] - row["outflow"] - row["stored"] == row["left_over"] for row in rows)
