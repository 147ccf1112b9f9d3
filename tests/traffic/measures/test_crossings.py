"""Crossings of gates: known answers, and brute force against the compiled look at rows."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from drawn_runs import CALIBRATED, along, site, straight, write_run
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.traffic.measures.crossings import confidence, following
from vidtrack.traffic.measures.gates import gates_of
from vidtrack.traffic.measures.journeys import wrong_way
from vidtrack.traffic.measures.measure import measured
from vidtrack.traffic.measures.passing import Passed, Passing, lasting
from vidtrack.traffic.measures.rows import Rows, off_road
from vidtrack.traffic.measures.stretches import Stretches


def crossings(run, place=None):
    return measured([run], place or site()).tables["crossings"].to_pylist()


def test_a_vehicle_passes_all_gates_at_known_times(tmp_path):
    run = write_run(tmp_path / "run", [straight(7, 2.0, 50, 240, 100, 5)])
    rows = crossings(run)
    assert [(row["gate"], row["direction"], row["track_id"]) for row in rows] == [
        ("west", "right", 7),
        ("middle", "right", 7),
        ("east", "right", 7),
    ]
    bend = 320 - 20 * 40 / 279  # the middle gate at y = 240
    assert [row["time_s"] for row in rows] == pytest.approx([2.5, 2 + (bend - 50) / 100, 6.5], abs=1e-3)
    assert rows[0]["utc"].isoformat() == "2026-06-01T05:00:02.500000+00:00"
    assert all(row["speed_kmh"] is None for row in rows)
    assert all(row["confidence"] > 0.98 and row["reason"] == "seen" for row in rows)


def test_metres_give_speeds_lengths_and_gaps(tmp_path):
    tracks = [straight(1, 1.0, 50, 240, 100, 5), straight(2, 3.0, 50, 241, 100, 5), straight(3, 3.5, 50, 100, 100, 5)]
    run = write_run(tmp_path / "run", tracks, metres=True)
    rows = [row for row in crossings(run, site(CALIBRATED)) if row["gate"] == "west"]
    assert [row["speed_kmh"] for row in rows] == pytest.approx([36, 36, 36])
    assert [row["speed_sigma_kmh"] for row in rows] == pytest.approx([1, 1, 1])
    assert [row["headway_s"] for row in rows] == [None, pytest.approx(2.0, abs=0.01), None]  # 3 is in another lane
    assert rows[1]["gap_s"] == pytest.approx(2.0 - 4.0 / 10, abs=0.01)
    assert [row["along_m"] for row in rows] == pytest.approx([24, 24.1, 10], abs=0.2)


@pytest.mark.parametrize("status", ["confirmed", "merged"])
def test_who_is_cut_by_the_border_keeps_its_velocity_while_it_is_alone(tmp_path, status):
    """From t = 5 on there are no metres, and what is left of the box is a lane beside."""
    run = write_run(tmp_path / "run", [straight(1, 1.0, 50, 240, 100, 5)], metres=True)
    column = pq.read_table(f"{run}/tracks.parquet").to_pydict()
    for row in np.flatnonzero(np.array(column["time_s"]) >= 5):
        column["x_m"][row] = column["y_m"][row] = column["speed_kmh"][row] = column["heading_deg"][row] = None
        column["top_px"][row] -= 100
        column["status"][row] = status
    pq.write_table(pa.table(column), f"{run}/tracks.parquet")
    lanes = {"own": {"line": [[500, 280], [500, 200]]}, "beside": {"line": [[500, 190], [500, 50]]}}
    rows = crossings(run, site(CALIBRATED | {"gates": lanes}))
    assert [row["gate"] for row in rows] == ["own" if status == "confirmed" else "beside"]
    assert rows[0]["time_s"] == pytest.approx(5.5, abs=0.2)


def test_sections_give_speeds_without_a_calibration(tmp_path):
    place = site(sections={"all": {"from": "west", "to": "east", "length_m": 80.0}})
    run = write_run(tmp_path / "run", [straight(1, 1.0, 50, 240, 100, 5)])
    speeds = {row["gate"]: row["speed_kmh"] for row in crossings(run, place)}
    assert speeds == {"west": None, "middle": None, "east": pytest.approx(72, rel=1e-3)}


def test_without_a_calibration_a_tall_vehicle_passes_where_it_stands_on_the_road(tmp_path):
    """A lorry whose blob has its middle 30 px above the middle of its footprint drives up the picture."""
    t = np.arange(125) / 25
    run = write_run(tmp_path / "run", [(1, t, np.column_stack([np.full(125, 300.0), 400 - 50 * t]))])
    column = pq.read_table(f"{run}/tracks.parquet").to_pydict()
    column["top_px"] = [top - 40 for top in column["top_px"]]
    column["height_px"] = [100.0] * len(column["top_px"])
    pq.write_table(pa.table(column), f"{run}/tracks.parquet")
    lower = np.array(column["top_px"]) + 80
    (row,) = crossings(run, site(gates={"across": {"line": [[200, 300], [400, 300]]}}))
    assert row["time_s"] == pytest.approx(np.interp(-300, -lower, column["time_s"]), abs=1e-6)


def test_jitter_on_a_gate_does_not_count(tmp_path):
    t = np.arange(0, 8, 0.04)
    x = np.interp(t, [0, 2, 6, 8], [60, 100, 100, 140]) + np.where((t > 2) & (t < 6), 2 * (-1) ** np.arange(len(t)), 0)
    rows = crossings(write_run(tmp_path / "run", [along(1, t, x)]))
    assert [(row["gate"], row["direction"]) for row in rows] == [("west", "right")]


def test_who_turns_back_on_the_gate_has_not_passed_and_who_turns_beyond_it_has_twice(tmp_path):
    t = np.arange(0, 4, 0.04)
    near, far = (np.interp(t, [0, 2, 4], [60, turn, 60]) for turn in (102, 140))
    assert crossings(write_run(tmp_path / "near", [along(1, t, near)])) == []
    rows = crossings(write_run(tmp_path / "far", [along(1, t, far)]))
    assert [row["direction"] for row in rows] == ["right", "left"]


def test_a_track_counts_once_per_gate_and_direction(tmp_path):
    t = np.arange(0, 8, 0.04)
    x = np.interp(t, [0, 2, 4, 6, 8], [60, 140, 60, 140, 60])
    rows = crossings(write_run(tmp_path / "run", [along(1, t, x)]))
    assert [row["direction"] for row in rows] == ["right", "left"]


def test_last_seen_just_beyond_a_gate_counts_and_coasted_only_does_not(tmp_path):
    t = np.arange(0, 2, 0.04)
    x = np.linspace(60, 101, len(t))
    seen = crossings(write_run(tmp_path / "seen", [along(1, t, x)]))
    assert len(seen) == 1
    assert seen[0]["confidence"] < 0.98
    words = np.where(x > 95, "coasting", "confirmed")
    assert crossings(write_run(tmp_path / "lost", [along(1, t, x)], status=words)) == []


def test_beside_the_end_of_a_gate_is_not_over_it(tmp_path):
    place = site(gates={"short": {"line": [[100, 0], [100, 100]]}})
    assert crossings(write_run(tmp_path / "run", [straight(1, 0, 50, 240, 100, 3)]), place) == []


def test_csv_and_parquet_give_the_same(tmp_path):
    tracks = [straight(1, 1.0, 50, 240, 100, 5), straight(2, 3.0, 50, 250, 90, 5)]
    runs = [write_run(tmp_path / str(csv), tracks, metres=True, csv=csv) for csv in (True, False)]
    first, second = (measured([run], site(CALIBRATED)).tables for run in runs)
    assert all(first[name].equals(second[name]) for name in first)


def test_to_and_fro_within_two_seconds_is_not_passed():
    track, gate = np.array([1, 1, 1, 2, 1]), np.array([0, 0, 0, 0, 5])
    side, t = np.array([1, 0, 1, 0, 0]), np.array([3.0, 3.5, 4.0, 4.1, 4.2])
    assert lasting(track, gate, side, t).tolist() == [False, False, True, True, True]
    assert lasting(track[:2], gate[:2], side[:2], np.array([3.0, 5.5])).tolist() == [True, True]
    assert lasting(track[:2], gate[:2], np.array([1, 1]), t[:2]).tolist() == [True, True]


def in_pixels(number, t, xy, margin=8.0):
    """Rows (N,) without a calibration, of tracks that the picture shows."""
    yes, count = np.ones(len(t), bool), len(t)
    state = xy, np.full(count, np.nan), np.full(count, margin), np.zeros((count, 2))
    return Rows(number, t, yes, ~yes, ~yes, *state, *off_road(count))


def test_what_is_left_of_tracks_stays_as_it_is_when_more_rows_come():
    stretches = Stretches(metres=False)
    stretches.add(in_pixels(np.zeros(2, int), np.array([1.0, 2.0]), np.array([[3.0, 4.0], [5.0, 6.0]])))
    lives = stretches.lives()
    stretches.add(in_pixels(np.arange(5000), np.full(5000, 9.0), np.full((5000, 2), 7.0)))
    assert (lives.track.tolist(), lives.until.tolist()) == ([0], [np.inf])
    assert (lives.head.t.tolist(), lives.head.xy.tolist()) == ([1.0], [[3.0, 4.0]])
    assert (lives.tail.t.tolist(), lives.tail.xy.tolist()) == ([2.0], [[5.0, 6.0]])


POINT = st.tuples(st.floats(0, 640), st.floats(0, 480))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.lists(POINT, min_size=2, max_size=8), min_size=1, max_size=4), st.integers(1, 7))
def test_passings_are_those_of_brute_force(paths, size):
    """Steps that meet the middle gate, pairs of opposite ones within the margin taken away, then the first of each."""
    gates = gates_of(site(gates={"bend": {"line": [[300.3, 0.37], [340.1, 200.7], [300.9, 478.3]]}}), None)
    rows = sorted((k, track) for track, path in enumerate(paths) for k in range(len(path)))
    xy = np.array([paths[track][k] for k, track in rows])
    count, margin = len(rows), 8.0
    t = np.array([1000.0 * k for k, _ in rows])  # nobody is back within 2 s
    whole = in_pixels(np.array([track for _, track in rows]), t, xy, margin)
    passing = Passing(gates, 50.0)
    for first in range(0, count, size):  # blocks of any size give the same
        passing.add(whole.only(np.arange(first, min(first + size, count))))
    found = passing.passed()
    expected = [
        event for track, path in enumerate(paths) for event in brute_force(np.array(path), gates, margin, track)
    ]
    got = zip(found.track.tolist(), found.side.tolist(), (found.t / 1000).round(6).tolist(), strict=True)
    assert sorted(got) == sorted((track, side, round(when, 6)) for track, side, when in expected)


def brute_force(path, gates, margin, track):
    passed = []
    for k in range(1, len(path)):
        met = []
        for x1, y1, x2, y2 in gates.segment:
            a, b = np.array([x1, y1]), np.array([x2, y2])
            sides = [(b - a)[0] * (p - a)[1] - (b - a)[1] * (p - a)[0] for p in path[k - 1 : k + 1]]
            if (sides[0] >= 0) != (sides[1] >= 0):
                share = sides[0] / (sides[0] - sides[1])
                point = path[k - 1] + share * (path[k] - path[k - 1])
                if 0 <= (point - a) @ (b - a) < (b - a) @ (b - a):
                    met.append((int(sides[1] >= 0), share))
        net = sum(1 if side else -1 for side, _ in met)
        if net:
            passed.append([k, int(net > 0), k - 1 + met[-1][1]])
    kept = []
    for k, side, when in passed:
        if kept and kept[-1][1] != side:
            since = [distance(path[i], gates) for i in range(kept[-1][0], k)]
            if max(since) <= margin:
                kept.pop()
                continue
        kept.append([k, side, when])
    first = {}
    for _, side, when in kept:
        first.setdefault(side, when)
    return [(track, side, when) for side, when in first.items()]


def distance(point, gates):
    nearest = []
    for x1, y1, x2, y2 in gates.segment:
        a, b = np.array([x1, y1]), np.array([x2, y2])
        share = np.clip((point - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        nearest.append(np.linalg.norm(point - a - share * (b - a)))
    return min(nearest)


def passed_of(t, gate, side, along, speed):
    n = len(t)
    ones, yes = np.ones(n), np.ones(n, bool)
    return Passed(t, gate, np.arange(n), side, along, ones, ones, ones, yes, ~yes, speed, ones, ones, ones, ~yes)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.floats(0, 100), st.integers(0, 1), st.integers(0, 1), st.floats(0, 9)), max_size=10))
def test_headways_are_those_of_brute_force(events):
    events = sorted(events, key=lambda event: event[0])
    t, gate, side, along_m = (np.array([event[k] for event in events], dtype=kind) for k, kind in enumerate("fiif"))
    passed = passed_of(t.astype(float), gate, side, along_m.astype(float), np.full(len(t), 10.0))
    spans = np.array([[0.0, 50.0], [50.0, 101.0]])
    found = following(passed, np.full(len(t), 5.0), spans, metres=True)
    for i in range(len(t)):
        ahead = [
            passed.t[j]
            for j in range(i)
            if (gate[j], side[j]) == (gate[i], side[i])
            and abs(passed.along[j] - passed.along[i]) < 1.75
            and (passed.t[j] < 50) == (passed.t[i] < 50)
        ]
        if ahead:
            assert found.headway[i] == pytest.approx(passed.t[i] - ahead[-1])
            assert found.gap[i] == pytest.approx(max(passed.t[i] - ahead[-1] - 0.5, 0))
        else:
            assert np.isnan(found.headway[i])


def test_confidence_grows_with_the_distance_on_both_sides():
    passed = passed_of(np.arange(3.0), np.zeros(3, int), np.zeros(3, int), np.zeros(3), np.ones(3))
    object.__setattr__(passed, "before", np.array([0.0, 1.0, 9.0]))
    object.__setattr__(passed, "after", np.array([9.0, 9.0, 9.0]))
    assert confidence(passed) == pytest.approx([0.5, 0.8413, 1.0], abs=1e-4)


def against(gates, passings):
    """Whether passings (gate, side) of gates name: (line, role, leg) are against them."""
    lines = {name: {"line": line, "role": role, "leg": leg} for name, (line, role, leg) in gates.items()}
    gate, side = np.array(passings).T
    passed = passed_of(np.arange(len(gate)), gate, side, np.zeros(len(gate)), np.ones(len(gate)))
    return wrong_way(gates_of(site(gates=lines), None), passed).tolist()


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("role", ["entry", "exit", "both", "neutral"])
def test_out_over_an_entry_and_in_over_an_exit_are_against_the_gate(role, turned):
    """To the right is in over the western gate, which is drawn in either order."""
    line = [[100, 0], [100, 400]][:: -1 if turned else 1]
    gates = {"west": (line, role, "a"), "east": ([[500, 0], [500, 400]], "both", "b")}
    right = int(turned)
    expected = {"entry": [False, True], "exit": [True, False]}.get(role, [False, False])
    assert against(gates, [(0, right), (0, 1 - right)]) == expected


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    "other",
    [
        {},
        {"out": ([[100, 210], [100, 400]], "exit", "b")},
        {"out": ([[103, 210], [103, 400]], "exit", "b")},
        {"out": ([[160, 210], [160, 400]], "exit", "a")},
    ],
    ids=["one gate", "collinear", "at one cross-section", "staggered on one leg"],
)
def test_nobody_is_against_a_gate_whose_inner_side_is_not_known(other, turned):
    line = [[100, 0], [100, 200]][:: -1 if turned else 1]
    gates = {"in": (line, "entry", "a")} | other
    assert not any(against(gates, [(gate, side) for gate in range(len(gates)) for side in (0, 1)]))


def test_a_gate_that_most_pass_against_its_role_was_drawn_wrongly():
    gates = {"west": ([[100, 0], [100, 400]], "entry", "a"), "east": ([[500, 0], [500, 400]], "both", "b")}
    assert against(gates, [(0, 1)]) == [True]
    assert against(gates, [(0, 1), (0, 1), (0, 0)]) == [True, True, False]
    assert not any(against(gates, [(0, 1), (0, 1)]))
