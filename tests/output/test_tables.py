"""tracks.csv, tracks.parquet and mot.txt."""

import csv
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_steps import make_step

from vidtrack.output.confirmed import Confirmed
from vidtrack.output.mot import MotFile, settle_gaps
from vidtrack.output.parquet import ParquetParts
from vidtrack.output.tables import RADAR_3D, ROAD, VIDEO, TrackTable, layout, schema, track_rows
from vidtrack.scan import Scan

HEADER = (
    "frame,time_s,track_id,status,x_px,y_px,vx_px_s,vy_px_s,sigma_x_px,sigma_y_px,corr_xy,"
    "left_px,top_px,width_px,height_px,group_id,nis,"
    "sigma_vx_px_s,sigma_vy_px_s,corr_vxy,corr_x_vx,corr_x_vy,corr_y_vx,corr_y_vy,"
    "seen_left_px,seen_top_px,seen_right_px,seen_bottom_px"
)


def run(sink, *frames):
    """Frames are lists of rows (id, status letter, x, y)."""
    for index, rows in enumerate(frames):
        sink.step(make_step(index, rows))
    sink.close()


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def mot_rows(path):
    return [tuple(map(float, line.split(",")[:7])) for line in path.read_text().splitlines()]


def test_columns_are_exactly_the_documented_ones(tmp_path):
    run(TrackTable(tmp_path), [(1, "c", 100.0, 50.0)])
    assert (tmp_path / "tracks.csv").read_text().splitlines() == [
        HEADER,
        "0,0,1,confirmed,100,50,50,0,2,1,0.1,90,45,20,10,-1,1.5,3,3,0,0,0,0,0,89.5,44.5,109.5,54.5",
    ]


def test_the_covariance_of_position_and_velocity_can_be_rebuilt():
    rng = np.random.default_rng(0)
    step = make_step(0, [(1, "c", 1, 1), (2, "c", 9, 9)])
    root = rng.normal(size=(2, 4, 4))
    P = root @ np.swapaxes(root, 1, 2)
    row = track_rows([replace(step, tracks=replace(step.tracks, P=P))]).to_pylist()
    for values, wanted in zip(row, P[:, [0, 2, 1, 3]][:, :, [0, 2, 1, 3]], strict=True):
        sigma = np.array([values[f"sigma_{name}"] for name in ("x_px", "y_px", "vx_px_s", "vy_px_s")])
        corr = np.eye(4)
        pairs = {"xy": (0, 1), "vxy": (2, 3), "x_vx": (0, 2), "x_vy": (0, 3), "y_vx": (1, 2), "y_vy": (1, 3)}
        for name, (i, j) in pairs.items():
            corr[i, j] = corr[j, i] = values[f"corr_{name}"]
        assert np.allclose(corr * np.outer(sigma, sigma), wanted, atol=0.01)


@pytest.mark.filterwarnings("error")
def test_without_an_error_there_is_no_correlation():
    step = make_step(0, [(1, "c", 1, 1), (2, "c", 9, 9)])
    P = step.tracks.P.copy()
    P[1] = 0.0
    known, exact = track_rows([replace(step, tracks=replace(step.tracks, P=P))]).to_pylist()
    assert (exact["sigma_x_px"], exact["sigma_vy_px_s"]) == (0.0, 0.0)
    assert {exact[name] for name in exact if name.startswith("corr_")} == {None}
    assert None not in {known[name] for name in known if name.startswith("corr_")}


def test_edges_are_those_of_a_track_s_own_measurement_without_its_rim():
    rows = [(1, "c", 100, 50), (2, "m", 9, 9), (3, "o", 5, 5), (4, "c", 4, 40)]
    box = np.array([[-12.0, -6, 24, 12], [-4, -10, 9, 20]])  # of the tracks 1 and 4
    scan = Scan(0.0, [[100.0, 50], [4, 40]], np.eye(2), box=box, surveyed=np.array([0.0, 0, 200, 100]), rim=2.0)
    table = track_rows([replace(make_step(0, rows), scan=scan)])
    edge = np.column_stack([table[f"seen_{side}_px"].to_numpy() for side in ("left", "top", "right", "bottom")])
    assert edge[0].tolist() == [89.5, 45.5, 109.5, 53.5]
    assert np.isnan(edge[1:3]).all()
    assert np.isnan(edge[3, 0])  # the border cuts it
    assert edge[3, 1:].tolist() == [31.5, 6.5, 47.5]


def test_columns_of_tables_that_earlier_versions_wrote():
    old = HEADER.split(",")[:17]
    assert [column.name for column in layout(old)] == old
    assert [column.name for column in layout(HEADER.split(","))] == HEADER.split(",")
    at_a_site = [column.name for column in (*VIDEO, *ROAD)]
    assert [column.name for column in layout(at_a_site)] == at_a_site
    radar = [column.name for column in RADAR_3D]
    assert [column.name for column in layout(radar)] == radar
    assert [column.name for column in layout(radar[:15])] == radar[:15]


def test_a_run_without_tracks_leaves_tables_with_a_header_only(tmp_path):
    run(TrackTable(tmp_path), [], [])
    assert (tmp_path / "tracks.csv").read_text() == HEADER + "\n"
    assert pq.read_table(tmp_path / "tracks.parquet").num_rows == 0


def test_status_in_words_and_empty_cells_where_nothing_was_measured(tmp_path):
    run(TrackTable(tmp_path), [(1, "c", 1, 1), (2, "o", 2, 2), (3, "m", 3, 3)])
    rows = read(tmp_path / "tracks.csv")
    assert [row["status"] for row in rows] == ["confirmed", "coasting", "merged"]
    assert [row["nis"] for row in rows] == ["1.5", "", ""]
    assert [row["group_id"] for row in rows] == ["-1", "-1", "3"]


def test_parquet_holds_the_same_rows_with_units_and_leaves_no_parts(tmp_path):
    run(TrackTable(tmp_path), [(1, "c", 1, 1)], [(1, "c", 2, 1), (2, "c", 9, 9)])
    table = pq.read_table(tmp_path / "tracks.parquet")
    assert table.column_names == HEADER.split(",")
    assert {f.name: f.metadata[b"unit"].decode() for f in table.schema} == {c.name: c.unit for c in VIDEO}
    assert table.schema.field("vx_px_s").metadata[b"unit"] == b"px/s"
    rows = read(tmp_path / "tracks.csv")
    assert table["x_px"].to_pylist() == [float(row["x_px"]) for row in rows]
    assert table["track_id"].to_pylist() == [1, 1, 2]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["tracks.csv", "tracks.parquet"]


def test_parts_are_readable_before_the_end_and_become_one_file(tmp_path, monkeypatch):
    monkeypatch.setattr("vidtrack.output.parquet._PART_ROWS", 2)
    parts = ParquetParts(tmp_path / "tracks.parquet", schema(VIDEO))
    for index in range(5):
        parts.add(track_rows([make_step(index, [(1, "c", index, 0)])]))
    assert pq.read_table(tmp_path / "tracks.parquet.parts")["frame"].to_pylist() == [0, 1, 2, 3]
    parts.close()
    assert pq.read_table(tmp_path / "tracks.parquet")["frame"].to_pylist() == [0, 1, 2, 3, 4]
    assert not (tmp_path / "tracks.parquet.parts").exists()


def test_the_first_rows_may_come_late(tmp_path, monkeypatch):
    monkeypatch.setattr("vidtrack.output.parquet._PART_S", 0.0)
    parts = ParquetParts(tmp_path / "tracks.parquet", schema(VIDEO))
    for index in range(2):
        parts.add(track_rows([make_step(index, [(1, "c", index, 0)])]))
    parts.close()
    assert pq.read_table(tmp_path / "tracks.parquet")["frame"].to_pylist() == [0, 1]


def test_tentative_rows_appear_once_the_track_is_confirmed(tmp_path):
    run(
        Confirmed(TrackTable(tmp_path)),
        [(1, "t", 1, 0), (2, "t", 5, 5)],
        [(1, "t", 2, 0), (2, "t", 5, 5)],
        [(1, "c", 3, 0)],
        [(1, "o", 4, 0), (3, "t", 7, 7)],
    )
    rows = read(tmp_path / "tracks.csv")
    assert [(row["frame"], row["track_id"], row["status"]) for row in rows] == [
        ("0", "1", "tentative"),
        ("1", "1", "tentative"),
        ("2", "1", "confirmed"),
        ("3", "1", "coasting"),
    ]


class Keep:
    """Sink that remembers."""

    def __init__(self):
        self.steps = []
        self.closed = False

    def step(self, step):
        self.steps.append(step)

    def close(self):
        self.closed = True


def test_an_undecided_track_holds_later_frames_back_but_not_for_ever():
    kept = Keep()
    sink = Confirmed(kept, hold_s=1.0)
    for index in range(100):
        sink.step(make_step(index, [(1, "t", index, 0), (2, "c", 0, 0)], fps=25.0))
        assert index - len(kept.steps) <= 26
    assert [step.tracks.id.tolist() for step in kept.steps] == [[2]] * len(kept.steps)
    sink.close()
    assert len(kept.steps) == 100
    assert kept.closed


def test_pictures_are_not_kept_while_steps_wait():
    kept = Keep()
    run_one = Confirmed(kept)
    run_one.step(make_step(0, [(1, "c", 5, 5)], shape=(20, 30)))
    assert kept.steps[0].frame is None
    assert kept.steps[0].foreground is None


LIVES = st.lists(
    st.tuples(st.integers(0, 15), st.integers(0, 8), st.one_of(st.none(), st.integers(0, 8))), min_size=1, max_size=8
)


@given(LIVES)
@settings(max_examples=60, deadline=None)
def test_rows_are_in_order_and_those_of_confirmed_tracks_only(lives):
    """Each life: first frame, number of tentative frames, then of confirmed ones (None: never confirmed)."""
    frames = [[] for _ in range(40)]
    expected = set()
    for track_id, (start, tentative, confirmed) in enumerate(lives):
        span = range(start, start + tentative + (confirmed or 0))
        for k in span:
            frames[k].append((track_id, "t" if k < start + tentative else "c", k, track_id))
        if confirmed:
            expected |= {(k, track_id) for k in span}
    kept = Keep()
    run(Confirmed(kept), *frames)
    assert [step.index for step in kept.steps] == list(range(40))
    assert {(step.index, int(i)) for step in kept.steps for i in step.tracks.id} == expected


def test_mot_counts_from_one_and_has_ten_columns(tmp_path):
    run(MotFile(tmp_path / "mot.txt"), [(7, "c", 100, 50)])
    assert (tmp_path / "mot.txt").read_text() == "1,7,90,45,20,10,0.9,-1,-1,-1\n"


def test_a_gap_is_written_only_when_the_track_was_found_again(tmp_path):
    lost = [(2, "o", 50, 50)]
    run(
        MotFile(tmp_path / "mot.txt"),
        [(1, "c", 10, 0), (2, "c", 50, 50)],
        [(1, "o", 20, 0), *lost],
        [(1, "o", 30, 0), *lost],
        [(1, "c", 40, 0)],
        [(1, "m", 50, 0)],
        [(1, "o", 60, 0)],
    )
    rows = mot_rows(tmp_path / "mot.txt")
    assert [row[:2] for row in rows] == [(1, 1), (1, 2), (2, 1), (3, 1), (4, 1), (5, 1)]


def test_mot_is_sorted_although_gaps_come_late(tmp_path, monkeypatch):
    clock = iter(range(0, 10_000, 10))
    monkeypatch.setattr("vidtrack.output.linefile.time.monotonic", lambda: next(clock))  # each step is written at once
    run(
        MotFile(tmp_path / "mot.txt"),
        [(1, "c", 10, 0), (2, "c", 0, 0)],
        [(1, "o", 20, 0), (2, "c", 0, 0)],
        [(1, "c", 30, 0), (2, "c", 0, 0)],
    )
    assert [row[:2] for row in mot_rows(tmp_path / "mot.txt")] == [(1, 1), (1, 2), (2, 1), (2, 2), (3, 1), (3, 2)]


def test_mot_holds_later_rows_back_while_a_gap_is_open(tmp_path, monkeypatch):
    clock = iter(range(0, 10_000, 10))
    monkeypatch.setattr("vidtrack.output.linefile.time.monotonic", lambda: next(clock))  # each step is written at once
    sink = MotFile(tmp_path / "mot.txt")
    sink.step(make_step(0, [(1, "c", 10, 0), (2, "c", 0, 0)]))
    sink.step(make_step(1, [(1, "o", 20, 0), (2, "c", 0, 0)]))
    sink.step(make_step(2, [(1, "o", 30, 0), (2, "c", 0, 0)]))
    assert [row[:2] for row in mot_rows(tmp_path / "mot.txt")] == [(1, 1), (1, 2)]
    sink.step(make_step(3, [(2, "c", 0, 0)]))  # 1 is dead
    assert [row[:2] for row in mot_rows(tmp_path / "mot.txt")] == [(1, 1), (1, 2), (2, 2), (3, 2), (4, 2)]
    sink.close()
    assert len(mot_rows(tmp_path / "mot.txt")) == 5


def test_settled_gaps_by_hand():
    rows = np.zeros((5, 8))
    rows[:, 0] = [1, 2, 2, 2, 3]
    rows[:, 1] = [1, 1, 5, 6, 1]
    rows[:, 7] = [1, 0, 0, 0, 1]
    decided, waiting = settle_gaps(rows, alive=np.array([1, 5]))
    assert decided[:, :2].tolist() == [[1, 1]]
    assert waiting[:, :2].tolist() == [[2, 1], [2, 5], [3, 1]]  # 6 is dead, and 5 holds up what comes later
    decided, waiting = settle_gaps(waiting, alive=np.array([1]))
    assert decided[:, :2].tolist() == [[2, 1], [3, 1]]
    assert not len(waiting)


def test_mot_leaves_tracks_without_boxes_out(tmp_path):
    step = make_step(0, [(1, "c", 5, 5), (2, "c", 9, 9)])
    step.tracks.box[0] = np.nan
    sink = MotFile(tmp_path / "mot.txt")
    sink.step(step)
    sink.close()
    assert [row[1] for row in mot_rows(tmp_path / "mot.txt")] == [2]


@pytest.mark.parametrize("status", ["t", "c"])
def test_a_measured_tentative_row_counts_as_measured(tmp_path, status):
    run(MotFile(tmp_path / "mot.txt"), [(1, status, 5, 5)])
    assert len(mot_rows(tmp_path / "mot.txt")) == 1
