"""What a live run writes, without a camera: parts, counts, and which of them a full disk leaves out."""

import csv
import errno
import gc
import itertools
import json
import os
import shutil
import time
from collections import Counter
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pytest
from drawn_runs import CALIBRATED, site
from synthetic_steps import make_step

from vidtrack.config.load import load
from vidtrack.errors import StoppedEarly
from vidtrack.output.intervals.book import totals
from vidtrack.output.intervals.day import day_folders, read_day
from vidtrack.output.plot import TrajectoryPlot
from vidtrack.output.summary import Summary
from vidtrack.recording.reserve import Reserve
from vidtrack.recording.retention import Limits, Retention, parts_of
from vidtrack.run.live.counting import RoadReadings, counter_of, counting_of
from vidtrack.run.live.part import Part
from vidtrack.run.live.parts import Parts
from vidtrack.run.sinks import Subject, line_counter
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.measures.measure import measured
from vidtrack.traffic.measures.rows import ROAD_COLUMNS, LiveReader, Rows, off_road
from vidtrack.traffic.metres import used_site
from vidtrack.traffic.site import read_site

BEGAN_S = 1_800_000_000.0  # a full hour
FPS = 25.0
FOUND_S = 3.0
"""s after a gap, in which vehicles are found: tracker.hidden_s and 1 s"""


class Clock:
    """The wall clock of a run; `now` is the media time."""

    def __init__(self, monkeypatch):
        self.now, self.set_by = 0.0, 0.0
        monkeypatch.setattr(time, "time", lambda: BEGAN_S + self.set_by + self.now)

    def began_s(self):
        return BEGAN_S + self.set_by


@pytest.fixture
def clock(monkeypatch):
    return Clock(monkeypatch)


class Station:
    """Parts of 10 s with a line at x = 100; one vehicle drives over it each second, to the right."""

    def __init__(self, folder, clock, *assignments):
        given = ["live.roll_s=10", "live.zone=UTC", ("output.lines", ["gate:100,0,100,200"]), *assignments]
        self.settings = load(assignments=given)
        counter = line_counter(self.settings, 320, 240)
        self.subject = Subject("cam", self.settings, (240, 320), FPS, None, dict, counter, None)
        self.counting = counting_of(self.subject, folder / "intervals", clock.began_s)
        live = self.settings.live
        retention = Retention(Limits(live.keep_s, live.keep_bytes))
        retention.results.append(folder)
        self.parts = Parts(
            folder, self.subject, False, live.roll_s, retention, self.counting, Reserve(live.reserve_bytes)
        )
        self.clock = clock

    def drive(self, begin_s, end_s, coasting=lambda time_s, number: False):
        """Write the steps of this time, five at once; returns how many vehicles crossed."""
        for first in range(round(begin_s * FPS), round(end_s * FPS), 5):
            steps = []
            for frame in range(first, min(first + 5, round(end_s * FPS))):
                time_s = frame / FPS
                rows = []
                for number in range(
                    int(time_s) - 1, int(time_s) + 1
                ):  # each is seen for 2 s, and crosses in the middle
                    if number >= 0:
                        word = "o" if coasting(time_s, number) else "c"
                        rows.append((number + 1, word, 50 + 50 * (time_s - number), 100))
                steps.append(make_step(frame, rows))
            self.clock.now = steps[-1].time_s + 0.1
            self.parts.write(steps)


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def mot_rows(folder):
    return [tuple(map(float, line.split(",")[:2])) for line in (folder / "mot.txt").read_text().splitlines()]


def test_every_crossing_is_in_one_part_and_in_one_interval(tmp_path, clock):
    station = Station(tmp_path, clock)
    station.drive(0, 25)
    station.parts.finish()
    parts = parts_of(tmp_path)
    assert len(parts) == 3
    crossings = [row for part in parts for row in rows_of(part / "counts.csv")]
    assert len({row["track_id"] for row in crossings}) == len(crossings) == 24
    assert totals(tmp_path / "intervals") == {"gate": {"left": 0, "right": 24}}
    for part in parts:  # a part tells what is in it
        summary = json.loads((part / "summary.json").read_text())
        assert summary["counts"]["gate"]["right"] == len(rows_of(part / "counts.csv"))
    assert json.loads((tmp_path / "summary.json").read_text())["counts"]["gate"]["right"] == 24


def test_counts_go_on_after_a_kill_and_after_an_end(tmp_path, clock):
    """Four runs: what the page, the summary and the files say is the same, and the rest of each is a stated gap."""
    for run in range(4):
        station = Station(tmp_path, clock)
        station.subject.counter.totals()
        station.drive(20 * run, 20 * run + 8)
        if run % 2:
            station.parts.finish()
    station = Station(tmp_path, clock)
    found = sum(totals(tmp_path / "intervals")["gate"].values())
    assert station.subject.counter.totals()["gate"]["right"] == found
    assert 4 * 7 <= found <= 4 * 8  # the one that is on the line when a run ends
    assert json.loads((tmp_path / "summary.json").read_text())["counts"]["gate"]["right"] == found
    (day,) = day_folders(tmp_path / "intervals")
    spans = read_day(day).watched - BEGAN_S
    for run, (begin, end) in enumerate(spans.tolist()):
        assert begin == pytest.approx(20 * run + FOUND_S, abs=0.002)
        assert end == pytest.approx(20 * run + 7.96, abs=0.002) if run % 2 else 20 * run + 3 < end < 20 * run + 7


def test_a_gap_in_the_frames_is_a_gap_in_what_was_watched(tmp_path, clock):
    """A pause of 0.4 s is one too at this rate: tracks that coast for 0.6 s are not surely found again."""
    station = Station(tmp_path, clock)
    for begin_s in (0, 30, 60.2, 65.56, 70.68):
        station.drive(begin_s, begin_s + 5)
    station.parts.finish()
    (day,) = day_folders(tmp_path / "intervals")
    spans = [[3, 4.96], [33, 34.96], [63.2, 65.16], [68.56, 75.64]]
    assert (read_day(day).watched - BEGAN_S).round(2).tolist() == spans


def test_frames_that_are_rare_are_watched(tmp_path, clock):
    """Two in a second are as far apart as tracks coast, almost; one that is missing is a gap."""
    station = Station(tmp_path, clock)
    for frame in [*range(30), *range(31, 60)]:
        clock.now = frame / 2
        station.counting.step([make_step(frame, [(1, "c", 20, 100)], time_s=frame / 2)], None)
    station.counting.end()
    station.counting.close()
    (day,) = day_folders(tmp_path / "intervals")
    assert (read_day(day).watched - BEGAN_S).round(2).tolist() == [[3, 14.5], [18.5, 29.5]]


def on_road(track, t, length=4.0, hidden=False):
    """Rows of vehicles of 36 km/h."""
    one = np.ones(len(track))
    nothing = Rows(
        np.array(track), t * one, one > 0, one < 0, hidden * one > 0, *4 * [np.nan * one], *off_road(len(one))
    )
    v = np.column_stack([10 * one, 0 * one])
    return replace(
        nothing, v=v, speed=10 * one, speed_sigma=one, speed_shared=one, length=length * one, length_sigma=0.1 * one
    )


def test_who_is_partly_hidden_adds_nothing_to_a_length():
    readings = RoadReadings()
    for t, length, hidden in ((0.0, 4.0, False), (0.1, 4.2, False), (0.2, 9.0, True)):
        readings.add(on_road([1], t, length, hidden))
    assert readings.of(1)[0] == pytest.approx(4.1)


def test_a_speed_is_known_without_a_heading():
    ground = calibrated(site(CALIBRATED))
    columns = {name: [1.0] for name in ROAD_COLUMNS} | {"track_id": [1], "status": ["confirmed"]}
    table = pa.table(columns | {"speed_kmh": [36.0], "heading_deg": [np.nan], "length_m": [np.nan]})
    readings = RoadReadings()
    readings.add(LiveReader(ground).read(table))
    assert readings.of(1)[1:] == pytest.approx((10.0, 1 / 3.6, 1 / 3.6))


def test_what_is_known_of_a_vehicle_lasts_until_its_crossing_is_decided(tmp_path, clock):
    """It is measured until just beyond the line, and then hidden for 20 s, while another one drives."""
    station = Station(tmp_path, clock, "tracker.hidden_s=20", "tracker.coast_s=20")
    for frame in range(round(24 * FPS)):
        t = frame / FPS
        rows = [(2, "c", 10 + t, 20)]
        if t <= 1:
            rows.append((1, "c", 52 + 50 * t, 100))
        elif t < 21:
            rows.append((1, "o", 102, 100))
        seen = [number for number, word, *_ in rows if word == "c"]
        station.counting.step([make_step(frame, rows)], on_road(seen, t))
    station.counting.close()
    (day,) = day_folders(tmp_path / "intervals")
    (crossing,) = read_day(day).crossings.to_pylist()
    assert (crossing["track_id"], crossing["length_m"], crossing["speed_kmh"]) == (1, 4.0, 36.0)


@pytest.mark.parametrize("step_s", [3600.0, -3600.0])
def test_a_step_of_the_wall_clock_neither_loses_nor_doubles(tmp_path, clock, step_s):
    station = Station(tmp_path, clock)
    station.drive(0, 10)
    clock.set_by = step_s
    station.drive(10, 20)
    station.parts.finish()
    assert totals(tmp_path / "intervals")["gate"]["right"] == 19
    (day,) = day_folders(tmp_path / "intervals")
    watched = read_day(day).watched
    assert (watched[:, 1] - watched[:, 0]).sum() == pytest.approx(19.96 - FOUND_S, abs=0.01)
    assert len(watched) == 2


def test_a_track_found_again_after_the_border_of_a_part_has_its_rows(tmp_path, clock):
    """Vehicle 10 is hidden from 9.6 s to 10.4 s, over the border at 10 s."""
    station = Station(tmp_path, clock)
    station.drive(0, 13, coasting=lambda time_s, number: number == 9 and 9.6 < time_s < 10.4)
    station.parts.finish()
    first, second = parts_of(tmp_path)
    for part in (first, second):
        tracks = {(float(row["frame"]) + 1, float(row["track_id"])) for row in rows_of(part / "tracks.csv")}
        assert set(mot_rows(part)) == tracks
        assert mot_rows(part) == sorted(mot_rows(part))
    assert not set(mot_rows(first)) & set(mot_rows(second))


def test_a_track_that_is_not_found_again_has_none_of_its_gap(tmp_path, clock):
    station = Station(tmp_path, clock)
    station.drive(0, 13, coasting=lambda time_s, number: number == 9 and time_s > 9.6)
    station.parts.finish()
    rows = [row for part in parts_of(tmp_path) for row in mot_rows(part) if row[1] == 10]
    assert max(frame for frame, _ in rows) == 9.6 * FPS + 1


def test_counts_are_written_where_tracks_have_no_room(tmp_path, clock, monkeypatch):
    station = Station(tmp_path, clock, "live.reserve_bytes=1e6")
    station.drive(0, 5)
    disk = SimpleNamespace(total=10**9, free=150_000)  # less than the fifth that tracks leave
    monkeypatch.setattr(shutil, "disk_usage", lambda _: disk)
    for begin_s in itertools.takewhile(lambda t: t < 9, itertools.count(5, 0.2)):
        with pytest.raises(StoppedEarly, match=r"its last 0\.2 MB are kept for counts"):
            station.drive(begin_s, begin_s + 0.2)
    (part,) = parts_of(tmp_path)
    assert float(rows_of(part / "tracks.csv")[-1]["time_s"]) < 5
    assert len(rows_of(part / "counts.csv")) == totals(tmp_path / "intervals")["gate"]["right"] >= 7
    disk.free = 10**8
    station.drive(9, 10)
    assert float(rows_of(part / "tracks.csv")[-1]["time_s"]) > 9


def test_crossings_of_a_disk_without_any_room_are_written_later(tmp_path, clock, monkeypatch):
    station = Station(tmp_path, clock)
    station.drive(0, 5)
    with monkeypatch.context() as patch:
        full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        def append(file, block):
            if block:
                raise full

        patch.setattr("vidtrack.output.linefile.append", append)
        patch.setattr("vidtrack.output.intervals.book.append", append)
        for begin_s in (5, 6, 7):
            with pytest.raises(StoppedEarly, match="No space left"):
                station.drive(begin_s, begin_s + 0.2)
            clock.now = begin_s + 1
    station.drive(8, 9)
    station.parts.finish()
    (part,) = parts_of(tmp_path)
    assert len(rows_of(part / "counts.csv")) == totals(tmp_path / "intervals")["gate"]["right"]


def test_crossings_of_a_part_that_cannot_begin_are_in_the_next_one(tmp_path, clock, monkeypatch):
    """Even where the next one begins at the end of the run, for them alone."""
    station = Station(tmp_path, clock)
    station.drive(0, 9.8)

    def full(*_):
        raise StoppedEarly("No space left")

    with monkeypatch.context() as patch:
        patch.setattr("vidtrack.run.live.parts.Part", full)
        for begin_s in (10, 11, 12):
            with pytest.raises(StoppedEarly, match="No space left"):
                station.drive(begin_s, begin_s + 0.2)
            clock.now = begin_s + 1
    station.parts.finish()
    crossings = [row for part in parts_of(tmp_path) for row in rows_of(part / "counts.csv")]
    assert len(crossings) == totals(tmp_path / "intervals")["gate"]["right"] == 12


def test_recordings_leave_more_room_than_tracks(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(total=10**9, free=20 * 10**6))
    reserve = Reserve(None)  # 5 % of the disk: 50 MB, and 10 MB
    reserve.check_tracks(tmp_path)
    with pytest.raises(StoppedEarly, match="last 50 MB are kept for results"):
        reserve.check_recordings(tmp_path)
    monkeypatch.undo()
    with pytest.raises(StoppedEarly, match="No such file"):
        reserve.check_tracks(tmp_path / "gone")


def test_finished_parts_leave_nothing_in_memory(tmp_path, clock):
    """Not even until Python looks for cycles, which may be after hundreds of parts with a picture each."""
    gc.collect()
    gc.disable()
    try:
        station = Station(tmp_path, clock)
        station.drive(0, 25)
        station.parts.finish()
        del station
        kept = (Part, TrajectoryPlot, Summary)
        left = [
            one for one in gc.get_objects() if type(one) in kept
        ]  # isinstance would follow a library's dead proxies
    finally:
        gc.enable()
    assert len(parts_of(tmp_path)) == 3
    assert left == []


SITE = """[site]
name = "yard"
width = 320
height = 240
[gates.beside]
line = [[100, 101], [100, 200]]
[gates.below]
line = [[60, 102], [140, 102]]
"""
FROM_ABOVE = """[calibration]
picture = [[0, 0], [319, 0], [319, 239], [0, 239]]
ground = [[0, 0], [31.9, 0], [31.9, -23.9], [0, -23.9]]
"""


@pytest.mark.parametrize(("calibration", "passed"), [("", {"beside": 5, "below": 5}), (FROM_ABOVE, {"below": 5})])
def test_live_gates_and_measure_count_where_vehicles_stand(tmp_path, clock, calibration, passed):
    """The boxes are 20 x 10 px, and their middles pass above the upper end of the gate `beside`."""
    path = tmp_path / "site.toml"
    path.write_text(SITE + calibration)
    settings = load(assignments=["live.zone=UTC", ("output.lines", ["line:100,90,100,100.5"]), f"output.site={path}"])
    site = used_site(path, 320, 240)
    counter = counter_of(settings, 320, 240, site)
    reading = {"fps": FPS, "width": 320, "height": 240}.copy
    subject = Subject("cam", settings, (240, 320), FPS, None, reading, counter, None).at(site)
    folder = tmp_path / "out"
    folder.mkdir()
    counting = counting_of(subject, folder / "intervals", clock.began_s)
    reserve = Reserve(settings.live.reserve_bytes)
    parts = Parts(folder, subject, False, None, Retention(Limits(None, None)), counting, reserve)
    for frame in range(round(14 * FPS)):
        time_s = frame / FPS
        numbers = [number for number in range(5) if 2 * number <= time_s < 2 * number + 4]
        places = [(50 + 25 * (time_s - 2 * number), 100) for number in numbers]
        rows = [(number + 1, "c", x, y + 0.08 * (x - 100)) for number, (x, y) in zip(numbers, places, strict=True)]
        clock.now = time_s
        parts.write([make_step(frame, rows)])
    parts.finish()
    live = [row for row in rows_of(folder / "counts.csv") if row["line"] != "line"]
    assert Counter(row["line"] for row in live) == passed
    assert counter.totals()["line"]["right"] == 5
    crossings = measured([str(folder)], read_site(path)).tables["crossings"].to_pylist()
    assert [(row["gate"], row["direction"], row["track_id"]) for row in crossings] == [
        (row["line"], row["direction"], int(row["track_id"])) for row in live
    ]
    for ours, row in zip(crossings, live, strict=True):
        assert float(row["time_s"]) == pytest.approx(ours["time_s"], abs=0.02)
