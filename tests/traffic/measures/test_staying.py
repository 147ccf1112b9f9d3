"""Stays in zones, and queues: known answers and brute force."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest
from drawn_runs import CALIBRATED, SITE, SIZE, along, site, straight, write_run
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.traffic.measures.measure import measured
from vidtrack.traffic.measures.queues import queues_of
from vidtrack.traffic.measures.staying import Stays

ZONES = {"zones": {"box": {"polygon": [[200, 100], [400, 100], [400, 400], [200, 400]]}}}


def stopping(track, start_s, stop_px, wait_s, y=240.0):
    """Drives at 100 px/s (10 m/s) to a place, stands, and drives on; brakes and accelerates by 50 px/s^2 (5 m/s^2)."""
    brakes = start_s + (stop_px - 50) / 100 - 1  # 2 s, in which it goes half as far as without
    leave = brakes + 2 + wait_s
    t = np.arange(round(start_s * 25), round((leave + 1 + (580 - stop_px) / 100) * 25)) / 25
    slowing, faster = np.clip(t - brakes, 0, 2), np.clip(t - leave, 0, 2)
    driven = np.where(t < brakes, 100 * (t - start_s), 100 * (brakes - start_s) + 100 * slowing - 25 * slowing**2)
    return along(track, t, 50 + driven + 25 * faster**2 + 100 * np.clip(t - leave - 2, 0, None), y)


def test_a_stay_has_its_times_and_how_long_the_vehicle_stood(tmp_path):
    run = write_run(tmp_path / "run", [stopping(1, 2.0, 300, 5.0)], metres=True)
    rows = measured([run], site(CALIBRATED | ZONES)).tables["stays"].to_pylist()
    assert len(rows) == 1
    assert (rows[0]["zone"], rows[0]["came"], rows[0]["left"]) == ("box", True, True)
    assert rows[0]["begin_s"] == pytest.approx(3.5, abs=0.03)
    assert rows[0]["stay_s"] == pytest.approx(9.0, abs=0.05)
    assert rows[0]["standing_s"] == pytest.approx(5.0 + 2 * 0.278, abs=0.1)  # 0.278 s from 5 km/h to 0


def test_without_a_calibration_standing_is_not_known(tmp_path):
    run = write_run(tmp_path / "run", [stopping(1, 2.0, 300, 5.0)])
    tables = measured([run], site(**ZONES)).tables
    assert tables["stays"].to_pylist()[0]["standing_s"] is None
    assert len(tables["queues"]) == 0


@pytest.mark.parametrize("tree", [CALIBRATED, SITE], ids=["metres", "px"])
def test_a_site_with_zones_alone_has_stays(tmp_path, tree):
    """The same as with gates; of what needs gates there is nothing, and who came and went between them is not known."""
    run = write_run(tmp_path / "run", [stopping(1, 2.0, 300, 5.0), straight(2, 9.0, 50, 300, 100, 5)], metres=True)
    whole = measured([run], site(tree | ZONES)).tables
    alone = measured([run], site({name: tree[name] for name in tree if name != "gates"} | ZONES)).tables
    assert alone.keys() == whole.keys()
    assert alone["stays"].equals(whole["stays"])
    assert len(alone["stays"]) == 2
    for name in ("crossings", "trips", "intervals", "queues"):
        assert len(alone[name]) == 0
        assert alone[name].schema == whole[name].schema
    assert alone["checks"].select(["begin_s", "coverage"]).equals(whole["checks"].select(["begin_s", "coverage"]))
    assert alone["checks"]["appeared"].null_count == len(alone["checks"])
    if "conflicts" in whole:
        assert alone["conflicts"].equals(whole["conflicts"])


def test_who_is_there_at_the_end_has_not_left(tmp_path):
    run = write_run(tmp_path / "run", [straight(1, 0.0, 300, 240, 0, 59)], metres=True)
    row = measured([run], site(CALIBRATED | ZONES)).tables["stays"].to_pylist()[0]
    assert (row["came"], row["left"], row["stay_s"]) == (False, False, pytest.approx(59))


def test_three_wait_one_behind_the_other(tmp_path):
    tracks = [stopping(1, 2.0, 300, 12.0), stopping(2, 4.0, 230, 11.0), stopping(3, 6.0, 160, 10.0)]
    run = write_run(tmp_path / "run", tracks, metres=True)
    rows = measured([run], site(CALIBRATED)).tables["queues"].to_pylist()
    assert len(rows) == 1
    assert (rows[0]["leg"], rows[0]["vehicles"]) == ("west", 3)
    assert rows[0]["begin_s"] == pytest.approx(5.5 - 0.278, abs=0.1)
    assert rows[0]["end_s"] == pytest.approx(18.1 + 0.278, abs=0.1)
    assert rows[0]["length_m"] == pytest.approx(14 + 4, abs=0.2)  # from the front of the first to the rear of the last


def without_metres(run, where, columns=("_m", "_kmh", "_deg")):
    """Leave these columns empty in some rows of a run, a mask or a function of the table."""
    path = Path(run) / "tracks.parquet"
    table = pq.read_table(path)
    empty = where(table) if callable(where) else where
    for number, name in enumerate(table.column_names):
        if name.endswith(columns):
            table = table.set_column(number, name, pc.if_else(empty, None, table[name]))
    pq.write_table(table, path)


def without_metres_before(run, x_px):
    """The calibration's points begin at this place: rows before it have no metres."""
    without_metres(run, lambda table: pc.less(table["x_px"], x_px))


def test_who_waits_outside_the_calibration_s_points_is_in_the_queue_but_not_in_its_length(tmp_path):
    tracks = [stopping(1, 2.0, 300, 12.0), stopping(2, 4.0, 230, 11.0), stopping(3, 6.0, 160, 10.0)]
    run = write_run(tmp_path / "run", tracks, metres=True)
    without_metres_before(run, 250)
    rows = measured([run], site(CALIBRATED)).tables["queues"].to_pylist()
    assert [(row["leg"], row["vehicles"], row["length_m"]) for row in rows] == [("west", 3, pytest.approx(4))]
    assert rows[0]["begin_s"] == pytest.approx(5.5 - 0.278, abs=0.1)
    assert rows[0]["end_s"] == pytest.approx(18.1 + 0.278, abs=1.0)  # stands until it has moved by 1.4 m
    without_metres_before(run, 640)
    rows = measured([run], site(CALIBRATED)).tables["queues"].to_pylist()
    assert [(row["leg"], row["vehicles"], row["length_m"]) for row in rows] == [("west", 3, None)]


def test_who_comes_to_stand_without_a_place_has_it_from_when_it_is_known(tmp_path):
    tracks = [stopping(1, 2.0, 300, 12.0), stopping(2, 6.0, 160, 10.0)]
    run = write_run(tmp_path / "run", tracks, metres=True)
    without_metres(run, lambda table: pc.and_(pc.greater(table["time_s"], 5.0), pc.less(table["time_s"], 9.5)))
    row = measured([run], site(CALIBRATED)).tables["queues"].to_pylist()[0]
    assert (row["vehicles"], row["length_m"]) == (2, pytest.approx(14 + 4, abs=0.2))


def waiting(*ways, seconds=16):
    """Tracks that begin at x px, drive by so many px in 2 s, and stand until the watching ends."""
    t = np.arange(0, seconds, 0.04)
    return [along(n, t, x + way * np.clip(t, 0, 2) / 2) for n, (x, way) in enumerate(ways, start=1)]


def queued(tmp_path, tracks, tree):
    """Leg and vehicles of each queue."""
    rows = measured([write_run(tmp_path / "run", tracks, metres=True)], site(tree)).tables["queues"].to_pylist()
    return [(row["leg"], row["vehicles"]) for row in rows]


def test_who_waits_when_the_watching_ends_is_in_the_queue_of_the_nearest_entry(tmp_path):
    ways = (5, 60), (560, 60), (300, 60)  # before the entry, behind the exit, and between both
    assert queued(tmp_path, waiting(*ways), CALIBRATED) == [("west", 1)]


def test_who_came_from_afar_outside_the_points_waits_where_it_stands(tmp_path):
    """Its track began 61.5 m before the gate."""
    t = np.arange(0, 16, 0.04)
    run = write_run(tmp_path / "run", [along(1, t, 5 + 60 * np.clip(t, 0, 10))], metres=True)
    without_metres_before(run, 640)
    gates = {
        "east": {"line": [[620, 200], [620, 280]], "role": "entry"},
        "out": {"line": [[635, 280], [635, 200]], "role": "exit"},
    }
    rows = measured([run], site(CALIBRATED | {"gates": gates})).tables["queues"].to_pylist()
    assert [(row["leg"], row["vehicles"]) for row in rows] == [("east", 1)]


@pytest.mark.parametrize(("seconds", "found"), [(160, [("west", 1)]), (200, [])])
def test_who_stands_for_longer_than_a_red_light_is_parked(tmp_path, seconds, found):
    assert queued(tmp_path, waiting((65, 0), seconds=seconds), CALIBRATED) == found


@pytest.mark.parametrize(("way", "found"), [((10, 70), [("west", 1)]), ((90, -70), [])])
def test_who_drives_away_from_a_gate_of_both_roles_does_not_wait_before_it(tmp_path, way, found):
    gates = CALIBRATED["gates"] | {"west": {"line": [[100, 0], [100, 479]], "role": "both"}}
    assert queued(tmp_path, waiting(way), CALIBRATED | {"gates": gates}) == found


def test_a_gate_that_only_counts_takes_nobody_out_of_a_queue(tmp_path):
    gates = CALIBRATED["gates"] | {"count": {"line": [[60, 0], [60, 479]]}}
    assert queued(tmp_path, waiting((5, 60)), CALIBRATED | {"gates": gates}) == [("west", 1)]


@pytest.mark.parametrize("line", [[[100, 0], [100, 479]], [[100, 479], [100, 0]]])
def test_nobody_waits_before_a_gate_whose_inner_side_nothing_tells(tmp_path, line):
    gates = {"west": {"line": line, "role": "entry"}}
    assert queued(tmp_path, waiting((5, 60), (200, -60)), CALIBRATED | {"gates": gates}) == []


def test_a_row_that_seems_to_stand_makes_no_queue():
    begin, xy, yes = np.array([0.0, 10.0]), np.zeros((2, 2)), np.ones(2, bool)
    stays = Stays(np.zeros(2, int), np.arange(2), begin, np.array([0.08, 10.3]), begin, yes, yes, xy, xy)
    assert queues_of(stays, np.zeros(2, int), np.full(2, 4.0)).begin.tolist() == [10.0]


def test_who_drives_slowly_outside_the_calibration_s_points_does_not_stand(tmp_path):
    run = write_run(tmp_path / "run", [straight(1, 2.0, 60, 240, 17.0, 30)], metres=True)  # 6 km/h
    without_metres_before(run, 640)
    tables = measured([run], site(CALIBRATED | ZONES)).tables
    assert len(tables["queues"]) == 0
    assert [row["standing_s"] for row in tables["stays"].to_pylist()] == [0]


def test_who_has_not_moved_yet_within_the_points_has_a_place(tmp_path):
    """Their headings are empty, and so their velocities; places and speeds are not."""
    t = np.arange(400) / 25
    tracks = [along(n, t, x + 25 * np.clip(t - 10 - n, 0, None) ** 2) for n, x in ((1, 80), (2, 30))]
    run = write_run(tmp_path / "run", tracks, metres=True)
    without_metres(run, lambda table: pc.less(table["speed_kmh"], 1), "heading_deg")
    row = measured([run], site(CALIBRATED)).tables["queues"].to_pylist()[0]
    assert (row["vehicles"], row["length_m"]) == (2, pytest.approx(5 + 4))


def test_who_stops_and_creeps_outside_the_points_stood_as_long_as_within(tmp_path):
    t = np.arange(1250) / 25
    creeping = along(1, t, 60 + 100 * np.clip(t, 0, 2) + 5 * np.clip(t - 2, 0, 20) + 100 * np.clip(t - 42, 0, 8))
    run = write_run(tmp_path / "run", [creeping], metres=True)  # at 1.8 km/h for 20 s, and stands for 20 s
    within = measured([run], site(CALIBRATED | ZONES)).tables["stays"].to_pylist()[0]["standing_s"]
    without_metres_before(run, 640)
    assert within == pytest.approx(40, abs=0.2)
    outside = measured([run], site(CALIBRATED | ZONES)).tables["stays"].to_pylist()[0]["standing_s"]
    assert outside == pytest.approx(within, abs=1.5)  # once until it has left its place


def cut_below(run, height_px):
    """Boxes 25 px wide and so high, without metres where the lower border of the picture cuts them."""
    path = Path(run) / "tracks.parquet"
    table = pq.read_table(path)
    x, y = (table[name].to_numpy() for name in ("x_px", "y_px"))
    top, bottom = y - height_px / 2, np.minimum(y + height_px / 2, SIZE[1])
    for name, values in (("left", x - 12.5), ("top", top), ("width", 0 * x + 25), ("height", bottom - top)):
        table = table.set_column(table.column_names.index(f"{name}_px"), f"{name}_px", pa.array(values))
    pq.write_table(table, path)
    without_metres(run, pa.array(bottom == SIZE[1]))


def test_a_van_that_drives_in_over_the_border_does_not_stand(tmp_path):
    """The border holds the lower edge of its box for 2 s, and so its place."""
    t = np.arange(350) / 25
    run = write_run(tmp_path / "run", [(1, t, np.column_stack([0 * t + 320, 510 - 30 * t]))], metres=True)  # 11 km/h
    cut_below(run, 60)
    gates = {
        "south": {"line": [[0, 300], [639, 300]], "role": "entry"},
        "north": {"line": [[639, 200], [0, 200]], "role": "exit"},
    }
    tables = measured([run], site(CALIBRATED | {"gates": gates})).tables
    assert [row["from_leg"] for row in tables["trips"].to_pylist()] == ["south"]
    assert len(tables["queues"]) == 0


STANDING = st.tuples(st.integers(0, 200), st.integers(1, 60), st.integers(-1, 1), st.integers(0, 50))


@settings(max_examples=60, deadline=None)
@given(st.lists(STANDING, max_size=12))
def test_queues_are_those_of_brute_force(events):
    events = sorted({(begin, leg): (begin, wait, leg, x) for begin, wait, leg, x in events}.values())
    begin, wait, leg, x = (np.array([event[k] for event in events], int) for k in range(4))
    n, yes = len(events), np.ones(len(events), bool)
    xy = np.column_stack([x, np.zeros(n)]).astype(float)
    stays = Stays(
        np.zeros(n, int), np.arange(n), begin.astype(float), (begin + wait).astype(float), xy[:, 0], yes, yes, xy, xy
    )
    found = queues_of(stays, leg, np.full(n, 4.0))
    got = list(zip(found.leg, found.begin, found.end, found.vehicles, found.length, strict=True))
    expected = []
    for one in (0, 1):
        groups = []
        for event in (event for event in events if event[2] == one):
            if groups and event[0] - max(b + w for b, w, _, _ in groups[-1]) <= 2:
                groups[-1].append(event)
            else:
                groups.append([event])
        for group in groups:
            most = max(sum(b <= when < b + w for b, w, _, _ in group) for when, *_ in group)
            far = max(abs(event[3] - group[0][3]) for event in group) + 4
            expected.append((one, group[0][0], max(b + w for b, w, _, _ in group), most, far))
    assert sorted(got) == sorted(expected)
