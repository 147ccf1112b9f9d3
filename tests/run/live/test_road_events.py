"""Conflicts that a live camera tells: each once, also on a quiet road, before a gap and at the end."""

from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as pq
import pytest
from drawn_runs import CALIBRATED, FPS, SIZE, along, site, write_run

from vidtrack.run.live import road_events
from vidtrack.run.live.road_events import RoadEvents
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.measures.rows import LiveReader

GAP_S = 0.6
SITE = """[site]
name = "yard"
width = 640
height = 480
[calibration]
picture = {picture}
ground = {ground}
""".format(**CALIBRATED["calibration"])


@pytest.fixture
def events(monkeypatch):
    """Events of a site with a calibration, that look at each step."""
    monkeypatch.setattr(road_events, "_LOOK_S", 0.0)
    road = SimpleNamespace(ground=calibrated(site(CALIBRATED)))
    return RoadEvents(SimpleNamespace(site=SITE, shape=SIZE[::-1], road=road), GAP_S)


@pytest.fixture
def rows(tmp_path):
    """One drives down, another one crosses its way to the right 0.33 s after it has left; nobody else comes."""
    t = np.arange(0, 5, 1 / FPS)
    run = write_run(
        tmp_path / "run", [along(1, t, 100 + 60 * t), along(2, t, 300.0 + 0 * t, 120 + 60 * t)], metres=True
    )
    return pq.read_table(f"{run}/tracks.parquet")


def told_in(events, rows, times):
    """Time of the picture, and content, of each conflict that is told while pictures are taken at these times."""
    told, reader = [], LiveReader(calibrated(site(CALIBRATED)))
    for time_s in times:
        new = reader.read(rows.filter(np.abs(rows["time_s"].to_numpy() - time_s) < 1e-6))
        told += [(time_s, content) for _, content in events.conflicts([SimpleNamespace(time_s=time_s)], new)]
    return told


def pairs(told):
    return [(content["first_track_id"], content["second_track_id"]) for content in told]


def test_on_a_quiet_road_a_conflict_is_told_ten_seconds_after_it(events, rows):
    told = told_in(events, rows, np.arange(20 * FPS) / FPS)
    assert pairs(content for _, content in told) == [(2, 1)]
    assert 11 < told[0][0] < 15


def test_what_is_not_over_is_told_before_a_gap_and_at_the_end_and_once(events, rows):
    assert not told_in(events, rows, np.arange(6 * FPS) / FPS)
    after = told_in(events, rows, [60.0, 60.04])
    assert pairs(content for _, content in after) == [(2, 1)]
    assert not list(events.unfinished())


def test_what_is_not_over_is_told_at_the_end(events, rows):
    assert not told_in(events, rows, np.arange(6 * FPS) / FPS)
    assert pairs(content for _, content in events.unfinished()) == [(2, 1)]
    assert not list(events.unfinished())
