"""The oldest parts are deleted, and nothing else is."""

import os
import time
from datetime import datetime

import pytest

from vidtrack.recording.retention import Retention, new_part, parts_of, size_of


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
    retention = Retention(None, 5000)
    retention.roots.append(tmp_path)
    retention.prune()
    assert left(tmp_path) == [6, 7, 8, 9]
    assert size_of(tmp_path) <= 5000


def test_by_age(tmp_path):
    make_parts(tmp_path, [10] * 4, ages_s=[400, 300, 100, 50])
    retention = Retention(200, None)
    retention.roots.append(tmp_path)
    retention.prune()
    assert left(tmp_path) == [2, 3]


def test_the_newest_part_stays_however_large(tmp_path):
    make_parts(tmp_path, [1000, 100_000])
    retention = Retention(None, 5000)
    retention.roots.append(tmp_path)
    retention.prune()
    assert left(tmp_path) == [1]


def test_results_and_recordings_share_the_bound(tmp_path):
    make_parts(tmp_path / "out", [1000] * 5)
    make_parts(tmp_path / "tape", [4000] * 5)
    retention = Retention(None, 12_000)
    retention.roots.extend([tmp_path / "out", tmp_path / "tape"])
    retention.prune()
    assert left(tmp_path / "out") == left(tmp_path / "tape") == [3, 4]


def test_what_is_no_part_is_nobodys_business(tmp_path):
    (tmp_path / "holiday").mkdir()
    (tmp_path / "holiday" / "film").write_bytes(bytes(9000))
    make_parts(tmp_path, [1000] * 3)
    retention = Retention(None, 5000)
    retention.roots.append(tmp_path)
    retention.prune()
    assert (tmp_path / "holiday" / "film").exists()


@pytest.mark.parametrize("bounds", [(None, None), (1e9, 1e12)])
def test_within_the_bounds_nothing_happens(tmp_path, bounds):
    make_parts(tmp_path, [1000] * 3)
    retention = Retention(*bounds)
    retention.roots.append(tmp_path)
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
    retention = Retention(1e9, None)
    retention.roots.append(tmp_path)
    retention.prune()
    assert parts_of(tmp_path)[-1] == made[-1]
