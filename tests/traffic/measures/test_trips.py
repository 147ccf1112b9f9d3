"""Trips through the site, broken tracks, and the checks that need no truth."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_runs import CALIBRATED, FPS, along, site, straight, write_run
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from vidtrack.traffic.measures.beyond import INFERRED_SURE
from vidtrack.traffic.measures.joins import LONGEST_S, found_again, joined, marginals
from vidtrack.traffic.measures.measure import measured
from vidtrack.traffic.measures.stretches import End, Lives

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
    assert rows[1]["mean_speed_kmh"] == pytest.approx(36.0, abs=0.01)
    assert rows[1]["mean_speed_sigma_kmh"] == pytest.approx(3.6 * np.hypot(0.05, 0.05) / 4, abs=0.01)
    assert rows[2]["mean_speed_kmh"] is None
    assert {track: row["reason"] for track, row in rows.items()} == {
        1: "",
        2: "was there when watching ended",
        3: "was there when watching began",
        4: "ended between the gates",
        5: "began between the gates",
    }
    assert (found.report["appeared"], found.report["vanished"]) == (1, 1)
    assert found.report["impossible_movements"] == []


def test_who_comes_in_where_a_track_left_is_another_vehicle(tmp_path):
    """The track of one that leaves goes on as one that comes in on the same leg."""
    gates = {name: {"line": [[x, y], [x, y + 100]], "leg": leg, "role": role} for name, x, y, leg, role in (
        ("west_in", 100, 200, "west", "entry"), ("west_out", 100, 300, "west", "exit"),
        ("east_in", 500, 300, "east", "entry"), ("east_out", 500, 200, "east", "exit"),
    )}  # fmt: skip
    t = np.arange(0, 20, 0.04)
    turning = along(1, t, 300 - 250 * np.cos(2 * np.pi * t / 20), np.where(t < 10, 240, 360))
    rows = (
        measured([write_run(tmp_path / "run", [turning])], site({"site": PLACE["site"], "gates": gates}))
        .tables["trips"]
        .to_pylist()
    )
    assert [(row["entry_gate"], row["exit_gate"], row["track_id"]) for row in rows] == [
        ("west_in", "east_out", 1),
        ("east_in", "west_out", 1),
    ]


def test_at_most_one_trip_a_vehicle(tmp_path):
    t = np.arange(0, 25, 0.04)
    to_and_fro = along(1, t, 300 - 250 * np.cos(2 * np.pi * t / 20))
    plane = site({"site": PLACE["site"], "gates": PLACE["gates"]})
    found = measured([write_run(tmp_path / "run", [to_and_fro])], plane)
    assert len(found.tables["trips"]) == 1


def test_an_impossible_movement_is_told(tmp_path):
    gates = PLACE["gates"] | {"middle": {"line": [[300, 0], [300, 479]], "role": "exit"}}
    place = site(PLACE | {"gates": gates})
    found = measured([write_run(tmp_path / "run", [straight(1, 10.0, 50, 240, 100, 3)], metres=True)], place)
    assert found.report["impossible_movements"] == [{"from": "west", "to": "middle", "trips": 1}]
    assert found.tables["trips"].to_pylist()[0]["possible"] is False


@pytest.mark.parametrize(("words", "passed"), [("merged", ["west"]), ("confirmed", ["west", "back"])])
def test_where_no_trip_may_lead_another_vehicle_of_the_blob_has_passed(tmp_path, words, passed):
    """In on a leg, and out on it again: in a blob with one that drives out there, or seen alone all the way."""
    t = np.arange(0, 10, 1 / FPS)
    angle = np.clip(t - 4, 0, np.pi)  # half a circle of 60 px
    ahead = 60 * np.minimum(t, 4) - 60 * np.maximum(t - 4 - np.pi, 0)
    track = along(1, 2 + t, 50 + ahead + 60 * np.sin(angle), 240 + 60 * (1 - np.cos(angle)))
    run = write_run(tmp_path / "run", [track], metres=True, status=np.where(angle > 1, words, "confirmed"))
    gates = {name: PLACE["gates"][name] for name in ("west", "east")}
    gates["back"] = {"line": [[150, 300], [150, 479]], "role": "exit", "leg": "west"}
    tables = measured([run], site(PLACE, gates=gates)).tables
    assert [row["gate"] for row in tables["crossings"].to_pylist()] == passed
    assert [row["complete"] for row in tables["trips"].to_pylist()] == [len(passed) == 2]


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
    assert row["mean_speed_kmh"] == pytest.approx(36.0, abs=0.3)
    middle = [r for r in found.tables["crossings"].to_pylist() if r["gate"] == "middle" and r["track_id"] == 1]
    assert [r["reason"] for r in middle] == ["joined"]
    assert middle[0]["confidence"] == row["join_confidence"]
    assert middle[0]["speed_kmh"] is None


@pytest.mark.parametrize("behind_px", [2.0, 8.0])
def test_a_gate_within_the_overlap_of_two_joined_tracks_is_passed_once(tmp_path, behind_px):
    """For 0.8 s both tracks show the vehicle, the second one a little behind the first."""
    one, two, *others = broken(-0.8)
    two[2][:, 0] -= behind_px
    gates = PLACE["gates"] | {"middle": {"line": [[210, 0], [210, 479]]}}
    found = measured([write_run(tmp_path / "run", [one, two, *others], metres=True)], site(PLACE | {"gates": gates}))
    assert found.report["joins"] == 1
    rows = [row for row in found.tables["crossings"].to_pylist() if row["gate"] == "middle" and row["time_s"] < 20]
    assert [(row["track_id"], row["direction"], row["reason"]) for row in rows] == [(1, "right", "seen")]
    assert rows[0]["time_s"] == pytest.approx(11.6, abs=0.01)


@pytest.mark.parametrize(("gap_s", "aside_px"), [(0.8, 200.0), (-1.5, 0.0)])
def test_tracks_that_do_not_fit_stay_apart(tmp_path, gap_s, aside_px):
    """Too far aside, or for long at the same time."""
    found = measured([write_run(tmp_path / "run", broken(gap_s, aside_px), metres=True)], site(PLACE))
    assert found.report["joins"] == 0


def end(t, x, v):
    n = len(t)
    along = (np.column_stack([values, np.zeros(n)]) for values in (x, v))
    return End(np.array(t), *along, np.tile([0.09, 0.0, 0.25], (n, 1)))


def lives(tail, head):
    n = len(tail.t)
    return Lives(head, tail, np.full(n, 4.0), np.full(n, 0.3), np.arange(n), np.full(n, np.inf))


def anywhere(a, b):
    return np.ones(len(a), bool)


def test_of_two_that_fit_alike_neither_is_joined():
    tail, head = end([1.0, 0, 0], [0.0, 0, 0], [10.0] * 3), end([0.0, 1.5, 1.5], [0.0, 5.0, 5.0], [10.0] * 3)
    one, two = np.array([True, False, False]), np.array([False, True, True])
    assert len(joined(lives(tail, head), one, two, one, 3600.0, anywhere).before) == 0
    alone = joined(lives(tail, head), one, np.array([False, True, False]), one, 3600.0, anywhere)
    assert (alone.before.tolist(), alone.after.tolist()) == ([0], [1])
    assert alone.probability[0] > 0.7


def test_a_join_is_surer_where_one_passed_an_entry_or_an_exit():
    """As sure as it is that both ends are of one vehicle: 0.95, and between the gates 0.65."""
    tail, head = end([1.0, 0], [0.0, 0], [10.0] * 2), end([0.0, 1.5], [0.0, 5.0], [10.0] * 2)
    one, two = np.array([True, False]), np.array([False, True])
    before, after, neither = (
        joined(lives(tail, head), one, two, passes, 3600.0, anywhere).probability.item()
        for passes in (one, two, one & two)
    )
    assert before == after
    assert 0.9 < before < 0.95
    assert neither == pytest.approx(before * 0.65 / 0.95)


def test_one_that_another_has_drawn_along_is_found_near_and_at_any_velocity():
    """At most 4 m from where it was last, in place of 15 m ahead, and it stands."""
    tail, head = end([1.0, 0], [0.0, 0], [30.0] * 2), end([0.0, 1.5], [0.0, 4.0], [0.0] * 2)
    one, two = np.array([True, False]), np.array([False, True])
    assert len(joined(lives(tail, head), one, two, one, 3600.0, anywhere).before) == 1
    head.xy[1] = 40.0
    assert len(joined(lives(tail, head), one, two, one, 3600.0, anywhere).before) == 0


def test_a_track_that_is_broken_goes_on_near_where_it_was_whatever_its_motion():
    """Of one track it is the same vehicle at 10 m/s and, a moment later, as fast the other way; of two it is not."""
    tail, head = end([1.0, 0], [0.0, 0], [10.0] * 2), end([0.0, 1.1], [0.0, 1.0], [-10.0] * 2)
    one, two = np.array([True, False]), np.array([False, True])
    both = replace(lives(tail, head), track=np.zeros(2, int))
    sure = [joined(of, one, two, one, 3600.0, anywhere).probability.sum() for of in (both, lives(tail, head))]
    assert sure[0] > sure[1]


def test_one_that_comes_back_is_another():
    """At the place where the first one was heading for, but with the opposite velocity."""
    tail, head = end([1.0, 0], [0.0, 0], [10.0] * 2), end([0.0, 1.5], [0.0, 5.0], [-10.0] * 2)
    one, two = np.array([True, False]), np.array([False, True])
    assert len(joined(lives(tail, head), one, two, one, 60.0, anywhere).before) == 0


def test_a_movement_that_is_not_allowed_is_not_joined():
    tail, head = end([1.0, 0], [0.0, 0], [10.0] * 2), end([0.0, 1.5], [0.0, 5.0], [10.0] * 2)
    ends, begins = np.array([True, False]), np.array([False, True])
    assert len(joined(lives(tail, head), ends, begins, ends, 60.0, anywhere).before) == 1
    assert len(joined(lives(tail, head), ends, begins, ends, 60.0, lambda a, b: np.zeros(len(a), bool)).before) == 0


@given(st.integers(0, 10_000))
def test_marginals_are_those_of_all_ways_to_join(seed):
    """Of two ends and two beginnings each way can be counted: none, four of one pair, two of two pairs."""
    R = np.exp(np.random.default_rng(seed).normal(0, 1.5, (2, 2)))
    total = 1 + R.sum() + R[0, 0] * R[1, 1] + R[0, 1] * R[1, 0]
    exact = R * (1 + R[::-1, ::-1]) / total
    a, b = np.array([0, 0, 1, 1]), np.array([2, 3, 2, 3])
    found = marginals(R.ravel(), a, b, 4)
    np.testing.assert_allclose(found, exact.ravel(), atol=0.12)
    assert (np.bincount(a, found) <= 1).all()
    assert (np.bincount(b, found) <= 1 + 1e-6).all()


def test_where_one_must_go_elsewhere_the_other_stays():
    """Alone each of two would be found here as likely as there; one of them can be here only."""
    R, a, b = np.array([20.0, 20.0, 20.0]), np.array([0, 0, 1]), np.array([2, 3, 2])
    assert (marginals(R, a, b, 4) > 0.5).tolist() == [False, True, True]


@pytest.mark.parametrize("along", [0.0, 1.0])
def test_who_is_found_again_has_a_density_over_time_place_and_velocity(along):
    """The sum over all states, drawn around the likely ones (Student's t), is the chance to be found again, less what
    is later than LONGEST_S: of vehicles on their course, and of those that another one has drawn along."""
    rng = np.random.default_rng(1)
    n = 200_000
    gap = rng.uniform(0, LONGEST_S, n)
    wide = 3 * np.sqrt([2 + 2 * gap**2 + gap**3, 12 + gap])
    drawn = rng.standard_normal((2, n, 2)) / np.sqrt(rng.exponential(1.0, (2, n, 1)))
    weight = LONGEST_S * np.prod(2 * np.pi * wide**2 * (1 + np.sum(drawn**2, axis=2) / 2) ** 2, axis=0)
    xy, v = (np.vstack([[0, 0], values]) for values in wide[:, :, None] * drawn)
    head = End(np.append(0.0, gap), xy, v, np.tile([1.0, 0.0, 1.0], (n + 1, 1)))
    pairs = found_again(head, head, np.zeros(n, int), np.arange(1, n + 1), np.full(n, along))
    assert np.mean(pairs * weight) == pytest.approx(1 - np.exp(-LONGEST_S / 2), rel=0.06)


def met(tmp_path, swapped):
    """Two vehicles that meet in one blob for 0.6 s; their tracks change vehicles there, or not."""
    t = np.arange(10.0, 15.02, 0.04)
    east = np.column_stack([50 + 100 * (t - 10), np.full(len(t), 220.0)])
    west = np.column_stack([550 - 100 * (t - 10), np.full(len(t), 260.0)])
    later = t > 12.5
    one = np.where(later[:, None] & swapped, west, east)
    other = np.where(later[:, None] & swapped, east, west)
    status = np.where(np.abs(t - 12.5) < 0.3, "merged", "confirmed")
    return write_run(tmp_path / "run", [along(1, t, *one.T), along(2, t, *other.T)], metres=True, status=status)


@pytest.mark.parametrize("swapped", [False, True])
def test_tracks_that_change_vehicles_are_broken_and_joined(tmp_path, swapped):
    gates = PLACE["gates"] | {name: PLACE["gates"][name] | {"role": "both"} for name in ("west", "east")}
    allowed = {"allowed": [["west", "east"], ["east", "west"]]}
    found = measured([met(tmp_path, swapped)], site(PLACE | {"gates": gates, "movements": allowed}))
    rows = found.tables["trips"].to_pylist()
    assert sorted((row["entry_gate"], row["exit_gate"], row["complete"]) for row in rows) == [
        ("east", "west", True),
        ("west", "east", True),
    ]
    assert found.report["joins"] == (2 if swapped else 0)
    assert {row["tracks"] for row in rows} == ({2} if swapped else {1})


def test_who_brakes_hard_is_the_same_vehicle(tmp_path):
    """From 20 m/s by 8 m/s^2, and on by 3 m/s^2."""
    t = np.arange(2.0, 14.0, 0.04)
    slowing, faster = np.clip(t - 3, 0, 2.5), np.clip(t - 8, 0, None)
    x = 50 + 200 * np.minimum(t - 2, 1) + 200 * slowing - 40 * slowing**2 + 15 * faster**2
    found = measured([write_run(tmp_path / "run", [along(1, t, x, 240.0)], metres=True)], site(PLACE))
    assert [(row["complete"], row["tracks"]) for row in found.tables["trips"].to_pylist()] == [(True, 1)]
    assert found.report["joins"] == 0


def test_nobody_is_taken_to_drive_out_over_an_entry(tmp_path):
    """A track that ends a little before the western entry, on its way out."""
    outwards = straight(1, 10.0, 300, 240, -100, 1.8)
    found = measured([write_run(tmp_path / "run", [outwards], metres=True)], site(PLACE))
    assert [row["gate"] for row in found.tables["crossings"].to_pylist() if row["gate"] == "west"] == []


def test_a_gate_just_before_a_track_began_is_inferred(tmp_path):
    late = [straight(k, 10.0 * k, 115 + 70 * (k == 3), 240, 100, 4.8 - 0.8 * (k == 3)) for k in (1, 2, 3)]
    found = measured([write_run(tmp_path / "run", late, metres=True)], site(PLACE))
    rows = [row for row in found.tables["crossings"].to_pylist() if row["gate"] == "west"]
    assert [(row["track_id"], row["reason"]) for row in rows] == [(1, "inferred"), (2, "inferred"), (3, "inferred")]
    assert [row["time_s"] for row in rows] == pytest.approx([9.85, 19.85, 29.15], abs=0.02)
    assert all(0.5 < row["confidence"] <= 1 for row in rows)
    assert rows[2]["confidence"] < rows[1]["confidence"]
    assert [row["complete"] for row in found.tables["trips"].to_pylist()] == [True] * 3


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


def test_who_passes_beside_an_entry_and_leaves_elsewhere_has_entered_there(tmp_path):
    """The western gate reaches from 200 to 300 px, 10 px a metre: 1 m beside it is near enough, 5 m is not."""
    gates = PLACE["gates"] | {"west": {"line": [[100, 200], [100, 300]], "role": "entry"}}
    tracks = [
        along(1, 10 + np.arange(0, 5, 0.04), np.arange(0, 5, 0.04) * 100 + 50, np.linspace(320, 220, 125)),
        along(2, 20 + np.arange(0, 5, 0.04), np.arange(0, 5, 0.04) * 100 + 50, np.linspace(360, 260, 125)),
        straight(3, 30.0, 50, 310, 100, 2),  # never leaves
    ]
    found = measured([write_run(tmp_path / "run", tracks, metres=True)], site(PLACE | {"gates": gates})).tables
    entries = [row for row in found["crossings"].to_pylist() if row["gate"] == "west"]
    assert [(row["track_id"], row["reason"]) for row in entries] == [(1, "inferred")]
    assert entries[0]["along_m"] == pytest.approx(11.0, abs=0.2)
    assert {row["track_id"]: row["complete"] for row in found["trips"].to_pylist()} == {1: True, 2: False}


@pytest.mark.parametrize("lost_s", [13.0, 14.1])
def test_a_joined_vehicle_has_left_where_it_passes_beside_an_exit(tmp_path, lost_s):
    """The eastern gate is 2 m beside its way, which it passes after the gap, or within it."""
    gates = PLACE["gates"] | {"east": {"line": [[500, 460], [500, 260]], "role": "exit"}}
    found_s = lost_s + 0.8
    tracks = [
        straight(1, 10.0, 50, 240, 100, lost_s - 10),
        straight(2, found_s, 50 + 100 * (found_s - 10), 240, 100, 15.8 - found_s),
        *(straight(10 + k, 20.0 + 10 * k, 50, 300, 100, 5) for k in range(3)),
    ]
    found = measured([write_run(tmp_path / "run", tracks, metres=True)], site(PLACE | {"gates": gates})).tables
    row = next(row for row in found["trips"].to_pylist() if row["track_id"] == 1)
    assert (row["complete"], row["tracks"], row["exit_gate"]) == (True, 2, "east")
    exits = [row for row in found["crossings"].to_pylist() if row["gate"] == "east" and row["time_s"] < 16]
    assert [(row["reason"], row["time_s"]) for row in exits] == [("inferred", pytest.approx(14.5, abs=0.05))]


@pytest.mark.parametrize("seen", [[(10.0, 19.0)], [(10.0, 12.8), (13.5, 19.0)]])
def test_a_joined_vehicle_leaves_once_where_it_drives_to_and_fro_beside_an_exit(tmp_path, seen):
    """As one whose track is whole: out, back after 0.6 s, and out again, 2 m beside the eastern gate."""
    gates = PLACE["gates"] | {"east": {"line": [[500, 460], [500, 260]], "role": "exit"}}
    driven = PchipInterpolator([10, 13, 14, 14.8, 15.4, 16, 17, 19], [50, 350, 450, 506, 494, 506, 540, 640])
    times = [np.arange(*span, 0.04) for span in seen]
    tracks = [along(1 + k, t, driven(t), np.full(len(t), 240.0)) for k, t in enumerate(times)]
    others = [straight(10 + k, 20.0 + 10 * k, 50, 300, 100, 5) for k in range(3)]
    found = measured([write_run(tmp_path / "run", tracks + others, metres=True)], site(PLACE | {"gates": gates})).tables
    trip = next(row for row in found["trips"].to_pylist() if row["track_id"] == 1)
    assert (trip["tracks"], trip["complete"]) == (len(seen), True)
    exits = [row for row in found["crossings"].to_pylist() if row["gate"] == "east" and row["time_s"] < 20]
    assert [row["reason"] for row in exits] == ["inferred"]
    assert exits[0]["confidence"] == pytest.approx(INFERRED_SURE * trip["join_confidence"], abs=1e-3)


@pytest.mark.parametrize("seen", [[(10.0, 15.0)], [(10.0, 12.0), (12.8, 15.0)]])
def test_who_passes_beside_two_exits_leaves_by_the_last_one(tmp_path, seen):
    """They are of two legs; the track is whole, or broken before both."""
    exits = {name: {"line": [[x, 460], [x, 260]], "role": "exit"} for name, x in (("middle", 300), ("east", 500))}
    gates = {"west": PLACE["gates"]["west"]} | exits
    tracks = [straight(k, begin, 50 + 100 * (begin - 10), 240, 100, end - begin) for k, (begin, end) in enumerate(seen)]
    others = [straight(10 + k, 20.0 + 10 * k, 50, 300, 100, 5) for k in range(3)]
    place = site(PLACE | {"gates": gates, "movements": {}})
    rows = measured([write_run(tmp_path / "run", tracks + others, metres=True)], place).tables["crossings"].to_pylist()
    assert [row["gate"] for row in rows if row["time_s"] < 20] == ["west", "east"]


def test_a_gate_passed_beside_is_of_its_leg_where_another_gate_of_it_is_nearer(tmp_path):
    """Between the exit, 1.8 m aside, and the entry of the eastern leg, 0.6 m aside."""
    gates = {"west": PLACE["gates"]["west"]} | {
        "east_out": {"line": [[500, 460], [500, 260]], "role": "exit", "leg": "east"},
        "east_in": {"line": [[500, 236], [500, 100]], "role": "entry", "leg": "east"},
    }
    track = straight(1, 10.0, 50, 242, 100, 6)
    found = measured([write_run(tmp_path / "run", [track], metres=True)], site(PLACE | {"gates": gates})).tables
    assert [row["gate"] for row in found["crossings"].to_pylist()] == ["west", "east_out"]
    assert [row["complete"] for row in found["trips"].to_pylist()] == [True]


def test_who_begins_waiting_at_an_entry_has_come_in_there(tmp_path):
    """One stands 2 m behind the western entry when its track begins, and one 12 m behind it."""
    t = np.arange(0, 10, 0.04)
    tracks = [
        along(track, begin + t, x + np.maximum(t - 3, 0) * 80, 240)
        for track, begin, x in ((1, 10.0, 120), (2, 30.0, 220))
    ]
    found = measured([write_run(tmp_path / "run", tracks, metres=True)], site(PLACE)).tables
    entries = [row for row in found["crossings"].to_pylist() if row["gate"] == "west"]
    assert [(row["track_id"], row["reason"]) for row in entries] == [(1, "inferred")]
    assert {row["track_id"]: row["complete"] for row in found["trips"].to_pylist()} == {1: True, 2: False}
