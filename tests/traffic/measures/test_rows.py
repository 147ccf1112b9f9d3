"""What `vidtrack measure` reads of a run's table of tracks."""

import json

import pytest
from drawn_runs import CALIBRATED, SIZE, site, straight, write_run

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
