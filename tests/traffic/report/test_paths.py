"""Heat and ways over time, from the tracks of a run."""

import json
from datetime import UTC, datetime

import numpy as np
import pytest
from made_up_day import FPS, SPEED, write_day, write_run

from vidtrack.errors import SourceError
from vidtrack.output.report.report import write_report
from vidtrack.traffic.report.findings import read_findings
from vidtrack.traffic.report.paths import paths_of
from vidtrack.traffic.report.sheet import sheet_of
from vidtrack.traffic.report.turns import drawn, turns


def findings(tmp_path, offset_s=0.0):
    """One trip of track 1, which begins in the middle of the only interval; the run began offset_s into the day."""
    write_run(tmp_path / "run", 450.0 - 400 - offset_s)
    run = {"folder": str(tmp_path / "run"), "begin_s": 400.0 + offset_s, "end_s": 460.0 + offset_s, "run": 0}
    return read_findings(write_day(tmp_path / "day", [1], metres=False, runs=[run]))


def paths(found):
    return paths_of(found, sheet_of(found, turns(drawn(found.site))))


@pytest.mark.parametrize("offset_s", [0.0, 20.0])
def test_a_vehicle_drives_straight_from_gate_to_gate(tmp_path, offset_s):
    ways = paths(findings(tmp_path, offset_s)).ways
    assert (ways.movement.start, ways.movement.end, ways.length) == ("north", "south", 360)
    assert ways.begin_s == 450
    np.testing.assert_allclose(ways.t, 450 + np.arange(80) / FPS, atol=1e-9)
    np.testing.assert_allclose(ways.along, SPEED * (ways.t - 450), atol=1e-6)


def test_heat_is_how_long_vehicles_were_where(tmp_path):
    heat = paths(findings(tmp_path)).heat
    assert heat.seconds.sum() == pytest.approx(60 + 10.1)
    row, column = np.searchsorted(heat.y, 300) - 1, np.searchsorted(heat.x, 700) - 1
    assert heat.seconds[row, column] == pytest.approx(60)
    assert heat.seconds.shape == (len(heat.y) - 1, len(heat.x) - 1)


def test_a_run_that_is_gone(tmp_path):
    found = findings(tmp_path)
    (tmp_path / "run" / "summary.json").unlink()
    with pytest.raises(SourceError, match="the tracks of the run run are no longer"):
        paths(found)


def test_both_are_in_the_report(tmp_path):
    (tmp_path / "report").mkdir()
    write_report(tmp_path / "report", findings(tmp_path), None)
    for name in ("heat_map", "time_space"):
        assert (tmp_path / "report" / f"{name}.png").is_file()
        assert (tmp_path / "report" / f"{name}.csv").is_file()


def test_a_live_run_keeps_its_time(tmp_path):
    """A live run tells its own time; its rows are as far into the day as they were when it was measured."""
    found = findings(tmp_path)
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    summary["began"] = datetime(2026, 6, 1, 4, 6, 40, tzinfo=UTC).isoformat()
    (tmp_path / "run" / "summary.json").write_text(json.dumps(summary))
    assert paths(found).ways.t[0] == pytest.approx(450)
