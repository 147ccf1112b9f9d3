"""Folders that are none of `vidtrack measure`: one clear line."""

import json

import pyarrow.parquet as pq
import pytest
from made_up_day import write_day

from vidtrack.errors import FormatError, SourceError
from vidtrack.traffic.report.findings import read_findings


def complaint(folder, kind):
    with pytest.raises(kind) as caught:
        read_findings(folder)
    assert caught.value.exit_code == 3
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_no_folder_and_an_empty_one(tmp_path):
    assert "is not a folder" in complaint(tmp_path / "nothing", SourceError)
    assert "has no measures.json" in complaint(tmp_path, SourceError)


@pytest.mark.parametrize("name", ["site.toml", "trips.parquet", "checks.parquet"])
def test_a_file_is_missing(tmp_path, name):
    folder = write_day(tmp_path / "day", [4])
    (folder / name).unlink()
    assert f"has no {name}" in complaint(folder, SourceError)


def test_tables_of_another_version(tmp_path):
    folder = write_day(tmp_path / "day", [4])
    pq.write_table(pq.read_table(folder / "trips.parquet").drop_columns(["to_leg"]), folder / "trips.parquet")
    assert "another version: it has no column to_leg" in complaint(folder, FormatError)


def test_a_report_of_another_version(tmp_path):
    folder = write_day(tmp_path / "day", [4])
    report = json.loads((folder / "measures.json").read_text())
    del report["watched_s"]
    (folder / "measures.json").write_text(json.dumps(report))
    assert "it has no watched_s" in complaint(folder, FormatError)


@pytest.mark.parametrize("name", ["measures.json", "trips.parquet"])
def test_damaged_files(tmp_path, name):
    folder = write_day(tmp_path / "day", [4])
    (folder / name).write_text("{ half a fi")
    assert f"{name} is damaged" in complaint(folder, FormatError)


def test_no_intervals(tmp_path):
    folder = write_day(tmp_path / "day", [4])
    pq.write_table(pq.read_table(folder / "checks.parquet").slice(0, 0), folder / "checks.parquet")
    assert "no intervals" in complaint(folder, SourceError)


def test_times_are_those_of_the_site(tmp_path):
    found = read_findings(write_day(tmp_path / "day", [4]))
    assert [found.clock.label(t) for t in (0, 900, 961)] == ["06:00", "06:15", "06:16:01"]
    assert (found.clock.date(0), found.clock.zone) == ("2026-06-01", "UTC+02:00")


def test_without_a_known_time_hours_count_from_the_first_picture(tmp_path):
    found = read_findings(write_day(tmp_path / "day", [4], utc_of_time_0=None))
    assert [found.clock.label(t) for t in (0, 900, 3661)] == ["0:00", "0:15", "1:01:01"]
    assert found.clock.date(0) is None
