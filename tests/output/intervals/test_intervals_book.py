"""Counts by interval: every crossing once, whatever ends a run, and whatever the clock does."""

import csv
import math
import os
from datetime import UTC, date, datetime

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from vidtrack.errors import FormatError, StoppedEarly
from vidtrack.output.intervals import book as book_module
from vidtrack.output.intervals.book import CountBook, Passage, totals
from vidtrack.output.intervals.day import Plan, read_day
from vidtrack.output.intervals.days import EVERY, by_day, edges_of_day, span_of, zone_of

BERLIN = "Europe/Berlin"
PLAN = Plan({"gate": ("left", "right"), "ramp": ("up", "down")}, {"car": (2.0, 6.0), "lorry": (6.0, 20.0)}, BERLIN)
NOON = datetime(2026, 10, 24, 10, tzinfo=UTC).timestamp()


def passage(unix_s, gate="gate", direction="left", length=math.nan, speed=math.nan):
    return Passage(unix_s, gate, direction, 7, length, speed, 0.5, 0.1)


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def counted(folder, day, name):
    """Sum of all counts in a table of a day."""
    return sum(int(row["count"]) for row in rows_of(folder / day / f"{name}.csv") if row["count"])


def test_the_tables_of_a_day(tmp_path):
    book = CountBook(tmp_path, PLAN)
    speeds = [10.0, 20.0, 30.0]
    book.add(passage(NOON + 10 * k, speed=speed, length=4.0) for k, speed in enumerate(speeds))
    book.add([passage(NOON + 70, "ramp", "down", length=12.0)])
    book.watch(NOON - 30, NOON + 90)
    book.close()
    minutes = rows_of(tmp_path / "2026-10-24" / "1min.csv")
    first = next(
        row for row in minutes if row["begin_utc"] == "2026-10-24 10:00:00.000Z" and row["direction"] == "left"
    )
    assert (first["count"], first["coverage"], first["flow_per_h"]) == ("3", "1", "180")
    assert float(first["time_mean_speed_kmh"]) == pytest.approx(3.6 * 20)
    assert float(first["space_mean_speed_kmh"]) == pytest.approx(3.6 * 3 / sum(1 / v for v in speeds), abs=1e-3)
    assert first["v85_kmh"] == ""  # of three speeds there is none
    assert (first["count_car"], first["count_lorry"]) == ("3", "0")
    assert sorted({row["begin_utc"][11:16] for row in minutes}) == ["09:59", "10:00", "10:01"]
    assert [row["coverage"] for row in minutes[:3]] == ["0.5", "1", "0.5"]
    assert {row["gate"] + row["direction"] for row in minutes} == {"gateleft", "gateright", "rampup", "rampdown"}
    assert [counted(tmp_path, "2026-10-24", name) for name in EVERY] == [4] * 5
    assert totals(tmp_path) == {"gate": {"left": 3, "right": 0}, "ramp": {"up": 0, "down": 1}}


@pytest.mark.parametrize(("day", "hours"), [("2026-10-25", 25), ("2026-03-29", 23), ("2026-06-01", 24)])
def test_days_on_which_the_clock_is_changed(tmp_path, day, hours):
    zone = zone_of(BERLIN)
    begin, end = span_of(date.fromisoformat(day), zone)
    assert end - begin == 3600 * hours
    for every_s in EVERY.values():
        edges = edges_of_day(date.fromisoformat(day), every_s, zone)
        assert (edges[0], edges[-1]) == (begin, end)
        assert len(edges) - 1 == (1 if every_s == 86400 else 3600 * hours / every_s)
    book = CountBook(tmp_path, PLAN)
    book.add(passage(begin + 1800 + 3600 * k) for k in range(-1, hours + 1))
    book.watch(begin - 3600, end + 3600)
    book.close()
    rows = [row for row in rows_of(tmp_path / day / "1h.csv") if (row["gate"], row["direction"]) == ("gate", "left")]
    assert [row["count"] for row in rows] == ["1"] * hours
    assert counted(tmp_path, day, "1d") == hours
    assert sum(totals(tmp_path)["gate"].values()) == hours + 2


def test_pieces_by_day_join_to_the_whole():
    begin = NOON - 3 * 86400.0
    pieces = by_day(begin, begin + 5.5 * 86400, zone_of(BERLIN))
    assert [(a, b) for _, a, b in pieces] == list(
        zip([begin, *(b for _, _, b in pieces[:-1])], [b for *_, b in pieces], strict=True)
    )
    assert len({day for day, _, _ in pieces}) == len(pieces) == 6


@settings(max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    runs=st.lists(
        st.lists(st.tuples(st.floats(0, 3 * 86400), st.sampled_from(["left", "right"])), max_size=6),
        min_size=1,
        max_size=4,
    ),
    killed=st.booleans(),
)
def test_every_crossing_is_there_once(tmp_path_factory, runs, killed):
    """Runs one after the other, at any time of any day, killed or ended, with half a line left behind."""
    folder = tmp_path_factory.mktemp("counts")
    added = []
    for run in runs:
        book = CountBook(folder, PLAN)
        book.add(passage(NOON + after_s, direction=direction) for after_s, direction in run)
        book.watch(NOON, NOON + 3 * 86400 if run else NOON + 1)
        added += run
        if killed:
            book.save()
            for path in folder.glob("*/crossings.csv"):
                with path.open("a") as file:
                    file.write("2026-10-24 10:0")
        else:
            book.close()
    CountBook(folder, PLAN).close()
    days = [entry for entry in folder.iterdir() if entry.is_dir()]
    for name in EVERY:
        assert sum(counted(folder, day.name, name) for day in days) == len(added)
    found = totals(folder).get("gate", {})
    assert [found.get(way, 0) for way in ("left", "right")] == [
        sum(direction == way for _, direction in added) for way in ("left", "right")
    ]


def test_a_full_disk_delays_counts_and_loses_none(tmp_path, monkeypatch):
    book = CountBook(tmp_path, PLAN)
    write = book_module.append

    def full(file, block):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(book_module, "append", full)
    for k in range(3):
        book.add([passage(NOON + k)])
        with pytest.raises(StoppedEarly, match="No space left"):
            book.save()
    monkeypatch.setattr(book_module, "append", write)
    book.watch(NOON, NOON + 3)
    book.save()
    book.close()
    assert counted(tmp_path, "2026-10-24", "1d") == 3
    assert book.lost == 0


def test_what_waits_is_bounded_and_what_is_dropped_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(book_module, "_MOST", 10)
    book = CountBook(tmp_path, PLAN)
    book.add(passage(NOON + k) for k in range(14))
    assert book.lost == 4
    book.close()
    assert counted(tmp_path, "2026-10-24", "1d") == 10


def test_the_clock_set_back_counts_both_times(tmp_path):
    """The hour is watched twice: its vehicles are those of both times, and its flow is that of one."""
    book = CountBook(tmp_path, PLAN)
    for _ in range(2):
        book.add(passage(NOON + 60 * k) for k in range(60))
        book.watch(NOON, NOON + 3600)
    book.close()
    (row,) = (row for row in rows_of(tmp_path / "2026-10-24" / "1h.csv") if (row["gate"], row["direction"]) == WAY)
    assert (row["count"], row["coverage"], row["flow_per_h"]) == ("120", "2", "60")


WAY = ("gate", "left")


def test_spans_that_follow_each_other_become_one_row(tmp_path):
    book = CountBook(tmp_path, PLAN)
    for k in range(20):
        book.watch(NOON + k, NOON + k + 1)
        book._write_watched()
    book.watch(NOON + 100, NOON + 101)
    book.close()
    assert read_day(tmp_path / "2026-10-24").watched.tolist() == [[NOON, NOON + 20], [NOON + 100, NOON + 101]]


def test_a_damaged_file_is_set_aside_and_ends_no_run(tmp_path, caplog):
    book = CountBook(tmp_path, PLAN)
    book.add([passage(NOON)])
    book.save()
    path = tmp_path / "2026-10-24" / "crossings.csv"
    path.write_bytes(path.read_bytes() + b"\x00\xff,,,,,\n")
    with pytest.raises(FormatError, match="damaged"):
        read_day(path.parent)
    again = CountBook(tmp_path, PLAN)
    again.add([passage(NOON + 5)])
    again.close()
    assert counted(tmp_path, "2026-10-24", "1d") == 1
    assert "set aside" in caplog.text
    assert list(path.parent.glob("crossings.csv.damaged-*"))


def test_a_damaged_day_is_told_by_none_of_its_old_tables(tmp_path):
    book = CountBook(tmp_path, PLAN)
    book.add([passage(NOON), passage(NOON + 1)])
    book.close()
    path = tmp_path / "2026-10-24" / "crossings.csv"
    path.write_bytes(path.read_bytes() + b"\x00\xff,,,,,\n")
    os.utime(path, ns=(2**62, 2**62))
    CountBook(tmp_path, PLAN)
    assert totals(tmp_path) == {}


def test_a_damaged_table_is_made_up_for_by_the_crossings(tmp_path):
    book = CountBook(tmp_path, PLAN)
    book.add([passage(NOON), passage(NOON + 1)])
    book.watch(NOON - 1, NOON + 2)
    book.close()
    (tmp_path / "2026-10-24" / "1d.csv").write_bytes(b"gate,direction\n1,2,3\n")
    assert totals(tmp_path) == {"gate": {"left": 2}}


def test_days_older_than_the_limit_are_deleted(tmp_path, monkeypatch):
    now_s = NOON + 10 * 86400
    monkeypatch.setattr(book_module.time, "time", lambda: now_s)
    book = CountBook(tmp_path, PLAN)
    book.add(passage(NOON + 86400 * k) for k in range(10))
    book.save(keep_s=3 * 86400)
    now_s += 900
    book.add([passage(now_s)])
    book.save(keep_s=3 * 86400)
    assert sorted(entry.name for entry in tmp_path.iterdir() if entry.is_dir()) == [
        "2026-10-31", "2026-11-01", "2026-11-02", "2026-11-03",
    ]  # fmt: skip


def test_a_gate_that_was_removed_keeps_its_counts(tmp_path):
    book = CountBook(tmp_path, PLAN)
    book.add([passage(NOON), passage(NOON + 1, "ramp", "up")])
    book.watch(NOON - 1, NOON + 2)
    book.close()
    other = CountBook(tmp_path, Plan({"gate": ("left", "right")}, {}, BERLIN))
    other.add([passage(NOON + 3)])
    other.close()
    assert counted(tmp_path, "2026-10-24", "1h") == 3
    assert totals(tmp_path) == {"gate": {"left": 2, "right": 0}, "ramp": {"up": 1}}


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"gates": {"a": 3}, "classes": {}, "zone": null}', "\x00"])
def test_a_plan_that_cannot_be_read(tmp_path, content):
    (tmp_path / "plan.json").write_text(content)
    with pytest.raises(FormatError, match=r"plan\.json"):
        Plan.read(tmp_path)


def test_a_plan_is_what_was_written(tmp_path):
    CountBook(tmp_path, PLAN)
    assert Plan.read(tmp_path) == PLAN


def test_a_gate_that_is_drawn_during_the_day_was_not_watched_before(tmp_path):
    """`ramp` comes at 10:20, `gate` goes at 10:40; the next run has both again at 10:50, with a fake clock."""
    ways = dict(PLAN.gates)
    book = CountBook(tmp_path, Plan({"gate": ways["gate"]}, {}, BERLIN))
    book.watch(NOON, NOON + 1200)
    book.use(ways, {}, NOON + 1200)
    book.add([passage(NOON + 1500, "ramp", "up")])
    book.use({"ramp": ways["ramp"]}, {}, NOON + 2400)
    book.watch(NOON + 1200, NOON + 3600)
    book.close()
    book.save()
    plan = Plan(ways, {}, BERLIN).after(Plan.read(tmp_path), NOON + 3000)
    quarters = read_day(tmp_path / "2026-10-24").intervals(900, plan).to_pylist()
    covered = {gate: [round(row["coverage"], 3) for row in quarters if row["gate"] == gate][:4] for gate in ways}
    assert covered == {"gate": [1, 1, 0.667, 0.667], "ramp": [0, 0.667, 1, 1]}
    counts = [row["count"] for row in quarters if (row["gate"], row["direction"]) == ("ramp", "up")]
    assert counts == [None, 1, 0, 0]


def test_a_gate_that_was_turned_was_not_watched_in_its_new_directions():
    turned = Plan({"gate": ("up", "down")}, {}, BERLIN).after(Plan({"gate": ("left", "right")}, {}, BERLIN), NOON)
    assert turned.spans == {"gate": ((None, NOON), (NOON, None))}
    day = np.array([[NOON - 60.0, NOON + 60.0]])
    assert turned.after(turned, NOON + 9).spans == turned.spans
    assert turned.watched("gate", day).tolist() == [[NOON - 60, NOON], [NOON, NOON + 60]]
