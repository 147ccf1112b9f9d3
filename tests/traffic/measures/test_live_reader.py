"""Vehicles that are still tracked stand where `vidtrack measure` has them, also beyond where places are known."""

import itertools

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from drawn_runs import CALIBRATED, FPS, SIZE, along, site, write_run

from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.measures.blocks import whole_pictures
from vidtrack.traffic.measures.rows import LiveReader, Reader, Rows
from vidtrack.traffic.measures.runs import open_day

RIM_PX = 560.0
"""px; to the right of it nobody knows a place, and boxes end there"""


def written(tmp_path):
    """Two drive out to the right, one 3 s after the other; a third one's blob is shared from the rim on."""
    t = np.arange(0, 4.8, 1 / FPS)
    ways = [along(k, t + late, 300 + 90 * t, 100 + 90 * k) for k, late in ((1, 0.0), (2, 3.0), (3, 1.0))]
    path = f"{write_run(tmp_path / 'run', ways, metres=True)}/tracks.parquet"
    rows = pq.read_table(path)
    column = {name: rows[name].to_numpy() for name in rows.column_names}
    beyond = column["x_px"] > RIM_PX
    for name in ("x_m", "y_m", "sigma_x_m", "sigma_y_m", "corr_xy_m", "length_m", "length_sigma_m", "width_m"):
        column[name] = np.where(beyond, np.nan, column[name])
    column["left_px"] = np.minimum(column["left_px"], RIM_PX)
    column["width_px"] = np.where(beyond, RIM_PX + 20 - column["left_px"], column["width_px"])
    column["class"] = np.where(beyond, "", "car")
    column["status"] = np.where(beyond & (column["track_id"] == 3), "merged", "confirmed")
    pq.write_table(pa.table(column), path)
    return tmp_path / "run", column


def test_the_live_reader_carries_vehicles_without_a_place_as_measure_does(tmp_path):
    run, column = written(tmp_path)
    ground = calibrated(site(CALIBRATED))
    whole = Rows.together(list(Reader(open_day([str(run)], None), {SIZE: ground})))
    reader, table = LiveReader(ground), pq.read_table(run / "tracks.parquet")  # whole, as a live run hands it on
    live = Rows.together([reader.read(table.slice(first, 7)) for first in range(0, len(table), 7)])
    np.testing.assert_allclose(live.xy, whole.xy)
    alone = column["track_id"] != 3
    np.testing.assert_allclose(live.xy[alone, 0], column["x_px"][alone] / 10, atol=1e-6)
    assert live.xy[~alone, 0].max() < RIM_PX / 10 + 2  # a shared blob carries nobody


def test_blocks_end_between_pictures(tmp_path):
    """However many rows a block has, with three vehicles in most pictures."""
    run, _ = written(tmp_path)
    table = pq.read_table(run / "tracks.parquet", columns=["time_s", "track_id", "status"])
    for size in (1, 2, 7, 1000):
        parts = list(whole_pictures((table.slice(first, size) for first in range(0, len(table), size)), run))
        assert pa.concat_tables(parts).equals(table)
        ends = [(part["time_s"][0].as_py(), part["time_s"][-1].as_py()) for part in parts]
        assert all(before < begin for (_, before), (begin, _) in itertools.pairwise(ends))
    assert len(list(whole_pictures([table], run))) == 1  # the last picture is no block of its own
    assert list(whole_pictures([], run)) == list(whole_pictures([table.slice(0, 0)], run)) == []
