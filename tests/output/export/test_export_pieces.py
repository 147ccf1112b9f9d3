"""Ways without a gap."""

import tempfile
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from road_runs import hide, usual_ways, way, write_run

from vidtrack.errors import ConfigError
from vidtrack.output.export import level_x, road_run
from vidtrack.output.export.pieces import pieces
from vidtrack.output.export.road_run import open_road_run

SEEN = st.lists(st.lists(st.booleans(), min_size=12, max_size=12), min_size=1, max_size=4).filter(
    lambda tracks: any(map(any, tracks))
)


@settings(max_examples=60)
@given(SEEN, st.integers(1, 20))
def test_pieces_hold_every_position_once_and_are_as_long_as_can_be(seen, batch):
    before = road_run._BATCH
    road_run._BATCH = batch
    try:
        with tempfile.TemporaryDirectory() as folder:
            ways = [hide(way(k, range(12)), np.flatnonzero(~np.array(shown))) for k, shown in enumerate(seen)]
            found = list(pieces(open_road_run(write_run(Path(folder), *ways))))
    finally:
        road_run._BATCH = before
    frames = {(piece.track, piece.number): piece.rows.frame.tolist() for piece in found}
    assert len(frames) == len(found)
    for track, shown in enumerate(seen):
        own = [frames[key] for key in sorted(key for key in frames if key[0] == track)]
        assert [frame for piece in own for frame in piece] == np.flatnonzero(shown).tolist()
        assert all(piece == list(range(piece[0], piece[-1] + 1)) for piece in own)
        assert all(first[-1] + 1 < second[0] for first, second in pairwise(own))


def test_a_piece_comes_out_before_the_run_is_read_to_its_end(tmp_path, monkeypatch):
    run = open_road_run(write_run(tmp_path, way(1, range(10)), way(2, range(400))))
    monkeypatch.setattr(road_run, "_BATCH", 20)
    read = []
    tables = road_run.RoadRun.tables
    monkeypatch.setattr(road_run.RoadRun, "tables", lambda self: (read.append(len(t)) or t for t in tables(self)))
    assert next(pieces(run)).track == 1
    assert sum(read) < 60


def test_a_guess_that_was_confirmed_stays_and_the_last_one_goes(tmp_path):
    (lorry,) = (piece for piece in pieces(open_road_run(write_run(tmp_path, *usual_ways()))) if piece.track == 9)
    assert lorry.rows.frame.tolist() == list(range(20, 61))


@pytest.mark.parametrize("batch", [3, 1 << 16])
def test_frames_that_nobody_looked_at_are_no_gap(tmp_path, monkeypatch, batch):
    monkeypatch.setattr(road_run, "_BATCH", batch)
    looked_at = [0, 3, 6, 9, 12, 15, 21, 24]  # the vehicle is missing at 18
    found = list(pieces(open_road_run(write_run(tmp_path, way(1, looked_at), max_fps=10))))
    assert [piece.rows.frame.tolist() for piece in found] == [looked_at[:6], looked_at[6:]]


@pytest.mark.parametrize(
    ("frames", "told"),
    [
        ([0, 15, 30, 45, 75], {"max_fps": 5, "every_s": 0.5}),  # every third of the five a second
        ([0, 13, 26, 39, 65], {"every_s": 0.5}),
        ([0, 1, 2, 3, 5], {"max_fps": 12, "began": "2026-06-01T07:00:00Z"}),  # a camera's, numbered as they are tracked
    ],
)
def test_one_row_that_is_missing_is_a_gap_whatever_is_left_out(tmp_path, frames, told):
    rows = way(1, frames)
    rows["time_s"] = rows["time_s"] * (2 if "began" in told else 1)
    found = list(pieces(open_road_run(write_run(tmp_path, rows, **told))))
    assert [piece.rows.frame.tolist() for piece in found] == [frames[:4], frames[4:]]


def test_level_x_which_has_all_frames_refuses_a_run_that_has_not(tmp_path):
    run = open_road_run(write_run(tmp_path, way(1, [0, 3, 6, 9]), max_fps=10))
    with pytest.raises(ConfigError, match=r"rows of one in 0\.12 s: track without source\.max_fps"):
        level_x.write(run, tmp_path)
