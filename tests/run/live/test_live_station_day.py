"""Some minutes of the day in fast motion: every crossing once, or in a time that was not watched."""

import sys
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[3] / "tools"
SECONDS = 300.0


@pytest.fixture
def day(monkeypatch):
    """The tool."""
    monkeypatch.setattr(sys, "path", [str(TOOLS), *sys.path])
    import station_day

    station_day.load_kernels()
    return station_day


def test_every_crossing_is_there_once_or_in_a_stated_gap(day, tmp_path):
    """A camera that is lost, an end, two kills, a full disk, and a clock that is set ahead and back."""
    traffic = day.Traffic(7, 0, SECONDS)
    faults = day.Faults(
        lost=[(40.0, 55.0), (200.0, 201.5)],
        full=[(150.0, 165.0)],
        ends=[(80.0, 2.0, True), (130.0, 1.0, False), (230.0, 15.0, True)],
        steps=[(0.0, 0.0), (100.0, 900.0), (180.0, -600.0)],
        begin_s=1_792_890_000.0 - 120.0,  # two minutes before Berlin's clocks are set back an hour
    )
    found = day.camera_day(tmp_path, traffic, faults, SECONDS, 7)
    assert (found["kills"], found["ends"], found["refused starts"]) == (2, 2, 0)
    assert found["missed"] == found["invented"] == 0
    assert found["once"] + found["in a stated gap"] == found["reference"]
    assert found["once"] > 0.6 * found["reference"] > 60
    assert found["in a stated gap"] > 0
