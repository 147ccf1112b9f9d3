"""The oldest parts are deleted, and nothing else is."""

import os
import time
from datetime import datetime
from pathlib import Path

import pytest

from vidtrack.errors import ConfigError
from vidtrack.recording.retention import Limits, Retention, new_part, parts_of, size_of


def make_parts(root, sizes, ages_s=None):
    parts = []
    for k, size in enumerate(sizes):
        part = root / f"2026-01-01T00-00-{k:02d}Z"
        part.mkdir(parents=True)
        (part / "tracks.csv").write_bytes(bytes(size))
        if ages_s:
            os.utime(part, (time.time() - ages_s[k],) * 2)
        parts.append(part)
    return parts


def left(root):
    return [int(part.name[17:19]) for part in parts_of(root)]


def test_by_size(tmp_path):
    make_parts(tmp_path, [1000] * 10)
    retention = Retention(Limits(None, 5400))
    retention.results.append(tmp_path)
    retention.prune()
    assert left(tmp_path) == [6, 7, 8, 9]
    assert size_of(tmp_path) <= 5400


def test_by_age(tmp_path):
    make_parts(tmp_path, [10] * 4, ages_s=[400, 300, 100, 50])
    retention = Retention(Limits(200, None))
    retention.results.append(tmp_path)
    retention.prune()
    assert left(tmp_path) == [2, 3]


def test_the_newest_part_stays_however_large(tmp_path):
    make_parts(tmp_path, [1000, 100_000])
    retention = Retention(Limits(None, 5000))
    retention.results.append(tmp_path)
    retention.prune()
    assert left(tmp_path) == [1]


def test_results_and_recordings_share_the_bound(tmp_path):
    make_parts(tmp_path / "out", [1000] * 5)
    make_parts(tmp_path / "tape", [4000] * 5)
    retention = Retention(Limits(None, 13_500))
    retention.results.append(tmp_path / "out")
    retention.recorded.append(tmp_path / "tape")
    retention.prune()
    assert left(tmp_path / "out") == left(tmp_path / "tape") == [3, 4]


def test_what_is_no_part_is_nobodys_business(tmp_path):
    (tmp_path / "holiday").mkdir()
    (tmp_path / "holiday" / "film").write_bytes(bytes(9000))
    make_parts(tmp_path, [1000] * 3)
    retention = Retention(Limits(None, 5400))
    retention.results.append(tmp_path)
    retention.prune()
    assert (tmp_path / "holiday" / "film").exists()


@pytest.mark.parametrize("bounds", [(None, None), (1e9, 1e12)])
def test_within_the_bounds_nothing_happens(tmp_path, bounds):
    make_parts(tmp_path, [1000] * 3)
    retention = Retention(Limits(*bounds))
    retention.results.append(tmp_path)
    retention.prune()
    assert left(tmp_path) == [0, 1, 2]


def test_parts_of_the_same_second_have_different_names(tmp_path):
    parts = [new_part(tmp_path) for _ in range(3)]
    assert len(set(parts)) == 3
    assert parts_of(tmp_path) == sorted(parts)


def test_names_stay_in_order_when_the_clock_is_set_back(tmp_path, monkeypatch):
    class Clock(datetime):
        hour_now = 12

        @classmethod
        def now(cls, tz=None):
            return datetime(2026, 1, 1, cls.hour_now, tzinfo=tz)

    monkeypatch.setattr("vidtrack.recording.retention.datetime", Clock)
    made = [new_part(tmp_path)]
    Clock.hour_now = 11
    made += [new_part(tmp_path) for _ in range(11)]
    Clock.hour_now = 13
    made += [new_part(tmp_path)]
    assert parts_of(tmp_path) == made
    retention = Retention(Limits(1e9, None))
    retention.results.append(tmp_path)
    retention.prune()
    assert parts_of(tmp_path)[-1] == made[-1]


def counted_parts(root, number, ages_s=None):
    parts = make_parts(root, [1000] * number)
    for k, part in enumerate(parts):
        (part / "counts.csv").write_text("time_s,frame,line,direction,track_id\n1.0,25,gate,left,7\n")
        (part / "summary.json").write_text("{}")
        (part / "tracks.parquet.parts").mkdir()
        if ages_s:
            os.utime(part / "counts.csv", (time.time() - ages_s[k],) * 2)
            os.utime(part, (time.time() - ages_s[k],) * 2)
    return parts


def files_of(part):
    return sorted(path.name for path in part.iterdir())


def test_counts_outlive_their_tracks(tmp_path):
    parts = counted_parts(tmp_path, 4, [400, 300, 100, 50])
    retention = Retention(Limits(200))
    retention.results.append(tmp_path)
    retention.prune()
    assert [files_of(part) for part in parts[:2]] == [["counts.csv", "summary.json"]] * 2
    assert all("tracks.csv" in files_of(part) for part in parts[2:])


def test_parts_left_with_counts_only_do_not_stop_a_later_run(tmp_path):
    """Their folders were changed just now, and those after them are older."""
    parts = counted_parts(tmp_path, 4, [400, 300, 100, 50])
    for limit_s in (350, 200):
        retention = Retention(Limits(limit_s))
        retention.results.append(tmp_path)
        retention.prune()
    assert ["tracks.csv" in files_of(part) for part in parts] == [False, False, True, True]


def test_counts_go_when_they_are_told_to(tmp_path):
    counted_parts(tmp_path, 4, [400, 300, 100, 50])
    retention = Retention(Limits(200), counts_s=350)
    retention.results.append(tmp_path)
    retention.prune()
    assert left(tmp_path) == [1, 2, 3]


def test_folders_that_are_deleted_while_they_are_measured_count_as_nothing(tmp_path, monkeypatch):
    for name in ("kept", "gone"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_bytes(bytes(100))
    scan = os.scandir

    def scandir(path):
        if Path(path).name == "gone":
            raise FileNotFoundError(path)
        return scan(path)

    monkeypatch.setattr(os, "scandir", scandir)
    assert size_of(tmp_path) == 100


def test_a_size_limit_counts_what_it_may_delete(tmp_path):
    parts = counted_parts(tmp_path, 10)
    for part in parts:
        (part / "counts.csv").write_bytes(bytes(9000))
    retention = Retention(Limits(None, 5400))
    retention.results.append(tmp_path)
    retention.prune()
    assert [("tracks.csv" in files_of(part)) for part in parts] == [False] * 6 + [True] * 4


def test_each_kind_has_a_limit_of_its_own(tmp_path):
    ages_s = [400, 300, 100, 50]
    make_parts(tmp_path / "out", [10] * 4, ages_s)
    make_parts(tmp_path / "tape", [1000] * 4, ages_s)
    retention = Retention(Limits(350), tracks=Limits(1e9), recordings=Limits(None, 2700))
    retention.results.append(tmp_path / "out")
    retention.recorded.append(tmp_path / "tape")
    retention.prune()
    assert left(tmp_path / "out") == [0, 1, 2, 3]
    assert left(tmp_path / "tape") == [2, 3]
    assert (retention.tracks_part, retention.recordings_part) == (None, 2700 / 8)


@pytest.mark.parametrize(
    ("limits", "kind"),
    [
        ({"both": Limits(None, 1e6)}, "live.keep_bytes = 1 MB"),
        ({"both": Limits(), "tracks": Limits(None, 3e6)}, "live.keep_tracks_bytes = 3 MB"),
        ({"both": Limits(), "recordings": Limits(None, 50e6)}, "live.keep_recordings_bytes = 50 MB"),
    ],
)
def test_limits_that_cannot_be_held_are_refused(limits, kind):
    """A part of the recording holds a state of 4 MB, one of the results a picture of 230 kB."""
    with pytest.raises(ConfigError, match=f"{kind} cannot be held.*give at least"):
        Retention(**limits).refuse_small(230e3, 4e6)
    Retention(Limits(None, 64e6), Limits(None, 4e6), Limits(None, 64e6)).refuse_small(230e3, 4e6)
