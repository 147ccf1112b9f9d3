"""What `vidtrack measure` reads of a run's table of tracks."""

import json

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from drawn_runs import CALIBRATED, SIZE, site, straight, write_run

from vidtrack.errors import FormatError
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.measures.rows import Reader, Rows
from vidtrack.traffic.measures.runs import open_day


def read(run):
    return Rows.together(list(Reader(open_day([run], None), {SIZE: calibrated(site(CALIBRATED))})))


def test_metres_are_computed_without_the_rim_that_the_run_tells(tmp_path):
    """Boxes of 40 x 20 px at 10 px/m; a run of an earlier version does not tell its rim, and it stays."""
    run = write_run(tmp_path / "run", [straight(1, 0.0, 100, 240, 100, 4)], covariances=True)
    earlier = read(run)
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    (tmp_path / "run" / "summary.json").write_text(json.dumps(summary | {"rim_px": 3.0}))
    now = read(run)
    assert (earlier.length[-1], now.length[-1]) == (pytest.approx(4.0), pytest.approx(3.4))
    assert (now.xy[:, 1] > earlier.xy[:, 1] + 0.1).all()


@pytest.mark.parametrize(
    ("row", "time_s", "words"), [(-1, None, "no time_s"), (0, None, "no time_s"), (3, 2.0, "order")]
)
@pytest.mark.parametrize("metres", [True, False])
def test_rows_without_a_time_or_out_of_order_are_refused(tmp_path, row, time_s, words, metres):
    run = write_run(tmp_path / "run", [straight(1, 0.0, 100, 240, 100, 1)], metres=metres, covariances=True)
    table = pq.read_table(f"{run}/tracks.parquet")
    times = table["time_s"].to_pylist()
    times[row] = time_s
    pq.write_table(table.set_column(1, "time_s", pa.array(times, pa.float64())), f"{run}/tracks.parquet")
    with pytest.raises(FormatError, match=rf"tracks\.parquet is damaged: .*{words}"):
        read(run)
