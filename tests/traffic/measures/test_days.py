"""Several runs are one day: splitting, shifting, what was watched, and input that cannot be used."""

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from drawn_runs import CALIBRATED, FPS, SITE, site, straight, write_run
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.errors import ConfigError, FormatError, SourceError
from vidtrack.traffic.measures.blocks import blocks
from vidtrack.traffic.measures.intervals import coverage, edges_of, figures
from vidtrack.traffic.measures.measure import measured
from vidtrack.traffic.measures.passing import Passed

BEGAN = "2026-06-01T05:00:00.000+00:00"
TABLES = {"crossings", "trips", "intervals", "stays", "queues", "checks", "conflicts"}
ZONES = {"zones": {"box": {"polygon": [[200, 100], [400, 100], [400, 400], [200, 400]]}}}


def parts_of(run, cut_s):
    """The run as two parts of it, as a live run that rolls writes them."""
    table = pq.read_table(Path(run) / "tracks.parquet")
    early = table["time_s"].to_numpy() < cut_s
    summary = json.loads((Path(run) / "summary.json").read_text())
    for name, rows, seconds, length in (("first", early, cut_s, cut_s), ("second", ~early, 60, 60 - cut_s)):
        part = Path(run).with_name(name)
        part.mkdir()
        pq.write_table(table.filter(rows), part / "tracks.parquet")
        new = summary | {"frames": round(length * FPS), "media_s": seconds - 1 / FPS}
        new["began"] = BEGAN if name == "first" else BEGAN.replace("00.000", "00.007")  # the clock was set
        (part / "summary.json").write_text(json.dumps(new))
        yield str(part)


def drawn(count, seed):
    rng = np.random.default_rng(seed)
    return [
        straight(k, *rng.uniform([0, 20, 60, 80], [50, 90, 400, 200]), rng.uniform(2, 6)) for k in range(1, count + 1)
    ]


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 100), st.integers(10, 50))
def test_a_run_in_two_parts_gives_the_same_tables(tmp_path_factory, seed, cut_s):
    folder = tmp_path_factory.mktemp("runs")
    tracks = drawn(6, seed)
    place = site(CALIBRATED | ZONES)
    whole = write_run(folder / "whole", tracks, metres=True, began=BEGAN)
    one, two = measured([whole], place).tables, measured(list(parts_of(whole, cut_s)), place).tables
    assert set(one) == TABLES
    assert all(one[name].equals(two[name]) for name in TABLES)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 100), st.integers(1, 5))
def test_shifting_time_shifts_times(tmp_path_factory, seed, intervals):
    folder = tmp_path_factory.mktemp("runs")
    run = write_run(folder / "run", drawn(5, seed), metres=True)
    place, shift = site(CALIBRATED | ZONES), 10.0 * intervals
    early = measured([f"{run}@2026-06-01T07:00:00Z"], place).tables
    late = measured([f"{run}@2026-06-01T07:00:{shift:02.0f}Z"], place).tables
    for name, table in early.items():
        for row, other in zip(table.to_pylist(), late[name].to_pylist(), strict=True):
            for column, value in row.items():
                if column.endswith("utc") and value is not None:
                    assert (other[column] - value).total_seconds() == pytest.approx(shift, abs=2e-3)
                else:
                    assert other[column] == value


def test_zeros_are_written_and_what_nobody_watched_is_empty(tmp_path):
    runs = [
        write_run(tmp_path / "a", [straight(1, 2.0, 50, 240, 100, 5)], seconds=20) + "@2026-06-01T07:00:00+02:00",
        write_run(tmp_path / "b", [straight(1, 2.0, 50, 240, 100, 5)], seconds=15) + "@2026-06-01T07:00:40+02:00",
    ]
    rows = measured(runs, site()).tables["intervals"].to_pylist()
    west = [row for row in rows if row["gate"] == "west" and row["direction"] == "right"]
    assert [row["count"] for row in west] == [1, 0, None, None, 1, 0]
    assert [row["coverage"] for row in west] == pytest.approx([1, 1, 0, 0, 1, 0.5])
    assert [row["flow_per_h"] for row in west] == [360, 0, None, None, 360, 0]
    assert [row["count_high"] for row in west][:2] == [1, 0]
    assert west[5]["count_high"] > 0  # half of it was not watched
    back = [row for row in rows if row["gate"] == "west" and row["direction"] == "left"]
    assert [row["count"] for row in back] == [0, 0, None, None, 0, 0]


def bounds(found, gate, direction):
    rows = found.tables["intervals"].to_pylist()
    row = next(row for row in rows if row["gate"] == gate and row["direction"] == direction and row["begin_s"] <= 0)
    return row["count_low"], row["count"], row["count_high"]


@pytest.mark.parametrize(("words", "step", "sure"), [("confirmed", -100, 0.99 * 0.04), ("merged", 100, 0.8)])
def test_passings_out_over_an_entry_or_in_a_blob_are_doubtful(tmp_path, words, step, sure):
    """Perhaps it was none, or another vehicle: the bounds hold 0, too."""
    track = straight(1, 2.0, 300 - 2.5 * step, 240, step, 5)
    found = measured(
        [write_run(tmp_path / "run", [track], metres=True, status=np.full(len(track[1]), words))], site(CALIBRATED)
    )
    rows = [row for row in found.tables["crossings"].to_pylist() if row["gate"] == "west"]
    assert [row["confidence"] for row in rows] == pytest.approx([sure], rel=0.01)
    assert bounds(found, "west", rows[0]["direction"]) == (0, 1, 1)


def test_a_passing_that_the_picture_does_not_show_is_no_surer_than_one_in_a_blob(tmp_path):
    track = straight(1, 2.0, 50, 240, 100, 5)
    status = np.where(np.abs(track[1] - 2.5) < 0.2, "coasting", "confirmed")
    found = measured([write_run(tmp_path / "run", [track], metres=True, status=status)], site(CALIBRATED))
    row = next(row for row in found.tables["crossings"].to_pylist() if row["gate"] == "west")
    assert row["reason"] == "coasted"
    assert 0.7 < row["confidence"] <= 0.8


def test_files_follow_each_other_and_a_vehicle_of_one_is_none_of_the_other(tmp_path):
    runs = [write_run(tmp_path / name, [straight(1, 2.0, 50, 240, 100, 5)], seconds=10) for name in "ab"]
    found = measured(runs, site())
    rows = [row for row in found.tables["crossings"].to_pylist() if row["gate"] == "west"]
    assert [(row["time_s"], row["run"], row["track_id"]) for row in rows] == [(2.5, 0, 1), (12.5, 1, 1)]
    assert rows[1]["headway_s"] is None  # of two recordings
    assert found.report["watched_s"] == 20


def test_intervals_begin_at_multiples_after_the_site_s_midnight():
    place = site(site=SITE["site"] | {"start": "2026-06-01T07:07:00+02:00"})
    edges = edges_of(np.array([[0.0, 1200.0]]), 900.0, place.camera.start, place.camera.start.tzinfo)
    assert edges.tolist() == [-420, 480, 1380]
    assert coverage(np.array([[0.0, 1200.0]]), edges).tolist() == pytest.approx([480 / 900, 720 / 900])


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.floats(0, 39.9), st.integers(0, 3), st.floats(1, 30)), max_size=25))
def test_figures_are_those_of_their_definitions(events):
    events = sorted(events)
    t, way, v = (np.array([event[k] for event in events], dtype=kind) for k, kind in enumerate((float, int, float)))
    n = len(t)
    yes = np.ones(n, bool)
    passed = Passed(
        t, way // 2, np.arange(n), way % 2, *(np.ones((4, n))), yes, ~yes,
        v, 0.3 * np.ones(n), 0.2 * np.ones(n), 0 * t, ~yes,
    )  # fmt: skip
    edges, watched = np.arange(5) * 10.0, np.array([1.0, 1.0, 0.5, 0.0])
    found = figures(passed, np.full(n, 0.9), np.full(n, 4.0), edges, watched, ways=4)
    for w in range(4):
        for k in range(3):
            mine = (way == w) & (t >= edges[k]) & (t < edges[k + 1])
            count = mine.sum()
            assert found.count[w, k] == count
            assert found.low[w, k] <= count <= found.high[w, k]
            assert found.flow[w, k] == pytest.approx(count * 360 / watched[k])
            if count:
                assert found.time_mean[w, k] == pytest.approx(v[mine].mean())
                assert found.space_mean[w, k] == pytest.approx(1 / np.mean(1 / v[mine]))
                assert found.own[w, k] == pytest.approx(0.3 / np.sqrt(count))  # averages away
                assert found.shared[w, k] == pytest.approx(0.2)  # does not
                steps = np.arange(-10, 60, 0.005)
                on = (np.abs(steps[:, None] - t[mine]) < 2 / v[mine]).any(axis=1)
                assert found.occupancy[w, k] == pytest.approx(on.sum() * 0.005 / (10 * watched[k]), abs=0.02)
            else:
                assert np.isnan(found.time_mean[w, k])
                assert found.occupancy[w, k] == 0
        assert np.isnan(found.count[w, 3])


@pytest.mark.parametrize(
    ("n", "sure", "watched", "low", "high"),
    [
        (1, 0.99, 1.0, 1, 1),
        (1, 0.8, 1.0, 0, 1),
        (5, 0.99, 1.0, 4, 6),
        (100, 0.99, 1.0, 97, 106),
        (3, 1.0, 1.0, 3, 4),
        (0, 1.0, 1.0, 0, 0),
        (10, 1.0, 0.5, 10, 31),  # 10 + 2 + ceil(10 + 1.96 sqrt(10 / 0.5))
        (0, 1.0, 0.5, 0, 4),  # ceil(1 + 1.96 sqrt(1 / 0.5))
    ],
)
def test_bounds_of_a_count_hold_passings_that_were_none_missed_or_not_watched(n, sure, watched, low, high):
    """Poisson numbers of means n (1 - sure) and 0.025 n sure, each below its bound with 97.5 %."""
    yes = np.ones(n, bool)
    passed = Passed(
        np.zeros(n), np.zeros(n, int), np.arange(n), np.zeros(n, int), *np.ones((4, n)), yes, ~yes,
        np.ones(n), *np.ones((2, n)), np.zeros(n), ~yes,
    )  # fmt: skip
    share = np.array([watched])
    found = figures(passed, np.full(n, sure), np.full(n, 4.0), np.array([0.0, 900.0]), share, ways=1)
    assert (found.low[0, 0], found.count[0, 0], found.high[0, 0]) == (low, n, high)


def test_an_interval_has_a_v85_from_as_many_speeds_as_bound_it():
    """Both ways of one gate: the fewest of 23 vehicles, whose fastest bounds the percentile, and one fewer."""
    way = np.append(np.zeros(23, int), np.ones(22, int))
    n, yes = len(way), np.ones(45, bool)
    speed = np.linspace(5, 20, n)
    passed = Passed(
        np.zeros(n), way // 2, np.arange(n), way, *np.ones((4, n)), yes, ~yes,
        speed, *np.ones((2, n)), np.zeros(n), ~yes,
    )  # fmt: skip
    found = figures(passed, np.ones(n), np.full(n, 4.0), np.array([0.0, 900.0]), np.ones(1), ways=2)
    assert found.v85[0, 0] == pytest.approx(np.quantile(speed[:23], 0.85))
    assert np.isnan(found.v85[1, 0])
    assert np.isfinite(found.time_mean).all()


def test_metres_are_computed_where_the_run_has_none(tmp_path):
    """The footprint's middle of a box that drives over the gates, and no metres of a picture without covariances."""
    run = Path(write_run(tmp_path / "run", [straight(1, 2.0, 50, 240, 100, 5)]))
    with pytest.raises(ConfigError, match="no metres of this site"):
        measured([str(run)], site(CALIBRATED))
    table = pq.read_table(run / "tracks.parquet")
    some = {"sigma_vx_px_s": 1.0, "sigma_vy_px_s": 1.0, "corr_xy": 0.0, "corr_vxy": 0.0}
    some |= {f"corr_{pair}": 0.0 for pair in ("x_vx", "x_vy", "y_vx", "y_vy")}
    for name, value in some.items():
        table = table.append_column(name, pa.array(np.full(len(table), value)))
    pq.write_table(table, run / "tracks.parquet")
    rows = measured([str(run)], site(CALIBRATED)).tables["crossings"].to_pylist()
    assert [row["gate"] for row in rows] == ["west", "middle", "east"]
    assert [row["speed_kmh"] for row in rows] == pytest.approx([36, 36, 36], rel=0.1)


def test_metres_of_another_site_are_not_used(tmp_path):
    run = write_run(tmp_path / "run", [straight(1, 2.0, 50, 240, 100, 5)], metres=True)
    moved = CALIBRATED["calibration"] | {"ground": [[x + 90, y] for x, y in CALIBRATED["calibration"]["ground"]]}
    with pytest.raises(ConfigError, match="no metres of this site"):
        measured([run], site(CALIBRATED | {"calibration": moved}))


def test_a_live_run_that_was_started_again_has_other_vehicles(tmp_path):
    track = straight(1, 2.0, 50, 240, 100, 5)
    first = write_run(tmp_path / "a", [track], seconds=20, began=BEGAN)
    again = write_run(tmp_path / "b", [track], seconds=20, began=BEGAN.replace("05:00:00", "05:01:00"))
    found = measured([first, again], site())
    assert found.tables["trips"]["run"].to_pylist() == [0, 1]
    assert found.tables["trips"]["begin_s"].to_pylist() == [2.5, 62.5]
    assert found.report["watched_s"] == 40


@pytest.mark.parametrize(
    ("suffixes", "error", "words"),
    [
        (["@yesterday", ""], ConfigError, "is no time"),
        (["@2026-06-01T07:00:00", ""], ConfigError, "has no zone"),
        (["@2026-06-01T07:00:00Z", "@2026-06-01T07:00:30Z"], ConfigError, "begins 30.0 s before"),
    ],
)
def test_times_that_cannot_be(tmp_path, suffixes, error, words):
    runs = [write_run(tmp_path / name, [straight(1, 2.0, 50, 240, 100, 5)]) for name in "ab"]
    with pytest.raises(error, match=words):
        measured([run + suffix for run, suffix in zip(runs, suffixes, strict=True)], site())


def test_a_run_that_is_given_twice_is_not_counted_twice(tmp_path):
    run = write_run(tmp_path / "a", [straight(1, 2.0, 50, 240, 100, 5)])
    with pytest.raises(ConfigError, match="a is given twice"):
        measured([run, f"{tmp_path}/./a/"], site())
    with pytest.raises(ConfigError, match="a is given twice"):
        measured([f"{run}@2026-06-01T07:00:00Z", f"{run}@2026-06-01T08:00:00Z"], site())
    (tmp_path / "link").symlink_to(run)
    with pytest.raises(ConfigError, match="link is given twice"):
        measured([run, f"{tmp_path / 'link'}@2026-06-01T08:00:00Z"], site())


def told(run, **more):
    """The same run, whose summary.json says more."""
    path = Path(run) / "summary.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | more))
    return run


@pytest.mark.parametrize(
    ("why", "words"), [("interrupted", "a was interrupted"), ("truncated", "a is of a video that is cut short")]
)
def test_after_a_run_that_ended_early_the_time_of_the_next_one_is_asked_for(tmp_path, why, words):
    a, b = (write_run(tmp_path / name, [straight(1, 2.0, 50, 240, 100, 5)], seconds=10) for name in "ab")
    told(a, **{why: True})
    with pytest.raises(ConfigError, match=rf"{words}, so nobody knows when .*b begins; write .*b@TIME") as refused:
        measured([a, b], site())
    assert refused.value.exit_code == 2
    assert "\n" not in str(refused.value)
    rows = measured([a, f"{b}@2026-06-01T07:01:00+02:00"], site()).tables["crossings"].to_pylist()
    assert [row["time_s"] for row in rows if row["gate"] == "west"] == [2.5, 62.5]
    rows = measured([b, a], site()).tables["crossings"].to_pylist()  # nothing follows
    assert [row["time_s"] for row in rows if row["gate"] == "west"] == [2.5, 12.5]


def test_parts_of_a_live_run_that_was_interrupted_know_their_times(tmp_path):
    whole = write_run(tmp_path / "whole", [straight(1, 2.0, 50, 240, 100, 5)], began=BEGAN)
    parts = [told(part, interrupted=True) for part in parts_of(whole, 30)]
    assert measured(parts, site()).report["watched_s"] == 60


def test_runs_of_sites_of_several_names_are_told_of(tmp_path, vidtrack):
    """--site stands for all of them, and may be another place's."""
    runs = [write_run(tmp_path / name, [], seconds=10) for name in "abc"]
    for run, name in zip(runs, ("mill", "mill", "bridge"), strict=True):
        told(run, settings={"source": {}, "output": {"site": "site.toml"}})
        (Path(run) / "site.toml").write_text(TOML.format(name=name, gate=Path(run).name))
    (tmp_path / "site.toml").write_text(TOML.format(name="yard", gate="g"))
    code, _, err = vidtrack("measure", "a", "b", "c", "--site", "site.toml", "-o", "out")
    assert code == 0, err
    (warning,) = [line for line in err.splitlines() if "warning" in line]
    assert "sites of several names, a at mill and c at bridge; here they are taken for one place" in warning
    code, _, err = vidtrack("measure", "a", "b", "--site", "site.toml", "-o", "other")
    assert code == 0, err
    assert "warning" not in err


@pytest.mark.parametrize("run", ["cam", "cam/2026-06-01T05-00-30Z", "./cam@2026-06-01T07:00:00Z"])
def test_measures_are_not_written_into_a_run_that_is_read(tmp_path, run, vidtrack):
    """Its site.toml says what its metres are by."""
    whole = write_run(tmp_path / "whole", [straight(1, 2.0, 50, 240, 100, 5)], began=BEGAN)
    (tmp_path / "cam").mkdir()
    for part, name in zip(parts_of(whole, 30), ("2026-06-01T05-00-00Z", "2026-06-01T05-00-30Z"), strict=True):
        Path(part).rename(tmp_path / "cam" / name)
    folder = run.removeprefix("./").partition("@")[0]
    (tmp_path / folder / "site.toml").write_text("as it was")
    (tmp_path / "site.toml").write_text(TOML.format(name="a", gate="g"))
    read = run if "@" in run else "cam"
    code, out, err = vidtrack("measure", read, "--site", "site.toml", "-o", folder, "--force")
    assert (code, out) == (2, "")
    assert err == f"vidtrack: {folder} is what is to be read; choose another place for the results\n"
    assert (tmp_path / folder / "site.toml").read_text() == "as it was"


def test_the_folder_above_the_parts_stands_for_them(tmp_path, vidtrack):
    whole = write_run(tmp_path / "whole", [straight(1, 2.0, 50, 240, 100, 5)], began=BEGAN)
    (tmp_path / "cam").mkdir()
    for part, name in zip(parts_of(whole, 30), ("2026-06-01T05-00-00Z", "2026-06-01T05-00-30Z"), strict=True):
        Path(part).rename(tmp_path / "cam" / name)
    (tmp_path / "site.toml").write_text(TOML.format(name="a", gate="g"))
    code, out, err = vidtrack("measure", "cam", "--site", "site.toml", "-o", "out", "--json", "-")
    assert code == 0, err
    report = json.loads(out)
    assert [Path(run["folder"]).parent.name for run in report["runs"]] == ["cam", "cam"]
    assert (report["watched_s"], report["crossings"]) == (60, 1)


@pytest.mark.parametrize("csv", [True, False])
def test_an_empty_road_is_counted_as_zero(tmp_path, csv):
    tables = measured([write_run(tmp_path / "run", [], seconds=10, csv=csv)], site(ZONES | SITE)).tables
    assert [row["count"] for row in tables["intervals"].to_pylist()] == [0] * 6
    assert all(len(tables[name]) == 0 for name in ("crossings", "trips", "stays", "queues"))


@pytest.mark.parametrize("began", [BEGAN, None], ids=["live", "file"])
def test_an_outage_within_a_run_was_not_watched(tmp_path, began):
    """The camera is gone from 12 s to 31 s; the track of the one vehicle ends there, and nobody saw it vanish."""
    last = 60 - 1 / FPS
    tracks = [straight(1, 9.0, 50, 240, 60, 3 - 1 / FPS), straight(2, 40.0, 50, 240, 100, 5)]
    run = write_run(tmp_path / "run", tracks, began=began, watched=[[0.0, 12 - 1 / FPS], [31.0, last]])
    found = measured([run], site())
    rows = [
        row for row in found.tables["intervals"].to_pylist() if (row["gate"], row["direction"]) == ("west", "right")
    ]
    assert [row["coverage"] for row in rows] == pytest.approx([1, 0.2, 0, 0.9, 1, 1])
    assert [row["count"] for row in rows] == [1, 0, None, 0, 1, 0]
    assert found.report["watched_s"] == pytest.approx(41)
    assert found.report["vanished"] == 0


def test_a_part_begins_with_its_first_picture(tmp_path):
    """Frames were dropped: fewer of them than the nominal rate has."""
    run = Path(write_run(tmp_path / "run", [], seconds=20, began=BEGAN, watched=[[2.0, 20 - 1 / FPS]]))
    summary = json.loads((run / "summary.json").read_text())
    (run / "summary.json").write_text(json.dumps(summary | {"frames": 7}))
    assert measured([str(run)], site()).report["watched_s"] == pytest.approx(18)


def test_a_run_of_radar_is_refused(tmp_path):
    run = Path(write_run(tmp_path / "run", []))
    (run / "summary.json").write_text('{"source": "plots.csv", "scans": 5, "media_s": 1.0}')
    with pytest.raises(ConfigError, match="not a run over video"):
        measured([str(run)], site())


def test_a_damaged_table_is_told(tmp_path):
    run = Path(write_run(tmp_path / "run", [straight(1, 2.0, 50, 240, 100, 5)]))
    (run / "tracks.parquet").write_bytes(b"PAR1 and then nothing")
    with pytest.raises(FormatError, match=r"tracks\.parquet is damaged: .*; copy it again, or make the run again$"):
        measured([str(run)], site())
    (run / "tracks.csv").touch()
    with pytest.raises(
        FormatError, match=r"tracks\.parquet is damaged: .*; vidtrack repair .* makes it from tracks\.csv"
    ):
        measured([str(run)], site())
    (run / "tracks.parquet").unlink()
    (run / "tracks.csv").write_bytes(b"\xff\x00,\r,\xfe\n1,2\r")
    summary = json.loads((run / "summary.json").read_text())
    (run / "summary.json").write_text(json.dumps(summary | {"interrupted": False}))
    with pytest.raises(FormatError, match=r"tracks\.csv is damaged: .*; vidtrack repair .* may help"):
        measured([str(run)], site())


def test_a_table_whose_footer_is_lost_is_told_in_one_line(tmp_path):
    run = Path(write_run(tmp_path / "run", [straight(1, 2.0, 50, 240, 100, 5)]))
    whole = (run / "tracks.parquet").read_bytes()
    footer = int.from_bytes(whole[-8:-4], "little")
    (run / "tracks.parquet").write_bytes(whole[: -8 - footer] + bytes(footer) + whole[-8:])
    with pytest.raises(FormatError, match=r"^[^\n]*tracks\.parquet is damaged: [^\n]*; copy it again[^\n]*$"):
        measured([str(run)], site())


def test_a_table_of_a_run_that_ended_is_whole(tmp_path):
    """What is missing would be taken for a time in which nobody came."""
    run = Path(write_run(tmp_path / "run", [straight(1, 2.0, 50, 240, 100, 5)]))
    table = pq.read_table(run / "tracks.parquet")
    (run / "tracks.parquet").unlink()
    rows = zip(*table.to_pydict().values(), strict=True)
    lines = [",".join(map(str, row)) for row in (table.column_names, *rows)]
    (run / "tracks.csv").write_text("\n".join(lines) + "\n")
    summary = json.loads((run / "summary.json").read_text())
    (run / "summary.json").write_text(json.dumps(summary | {"interrupted": False}))
    assert measured([str(run)], site()).report["tracks"] == 1
    whole = "\n".join(lines)
    (run / "tracks.csv").write_text(whole)  # as some editors leave it
    assert measured([str(run)], site()).report["tracks"] == 1
    (run / "tracks.csv").write_text(whole[: whole.rindex(",")])
    with pytest.raises(FormatError, match="cut off in its last line, though the run ended"):
        measured([str(run)], site())
    (run / "summary.json").write_text(json.dumps(summary | {"interrupted": True}))
    assert measured([str(run)], site()).report["tracks"] == 1  # it was killed, or goes on


def test_a_line_that_is_being_written_is_not_read(tmp_path):
    text = "time_s,status,track_id\n"
    for rows in ("", "0.0,confirmed,1\n", "0.0,confirmed,1\n0.04,confirmed,12\n"):
        for rest in ("", "0.08", "0.08,confirmed,3"):
            (tmp_path / "tracks.csv").write_text(text + rows + rest)
            read = [row for table in blocks(tmp_path, ("time_s", "track_id")) for row in table["track_id"].to_pylist()]
            assert read == [1, 12][: rows.count("\n")]


def test_the_last_row_of_a_run_that_ended_needs_no_line_end(tmp_path):
    """Some editors leave none."""
    (tmp_path / "summary.json").write_text('{"interrupted": false}')
    (tmp_path / "tracks.csv").write_text("time_s,status,track_id\n0.0,confirmed,1\n0.04,confirmed,12")
    read = [row for table in blocks(tmp_path, ("time_s", "track_id")) for row in table["track_id"].to_pylist()]
    assert read == [1, 12]


def test_a_run_without_a_summary_or_tables(tmp_path):
    with pytest.raises(SourceError, match="not a finished run"):
        measured([str(tmp_path)], site())
    run = Path(write_run(tmp_path / "run", [straight(1, 2.0, 50, 240, 100, 5)]))
    (run / "summary.json").unlink()
    with pytest.raises(SourceError, match=r"no summary\.json"):
        measured([str(run)], site())


TOML = '[site]\nname = "{name}"\nwidth = 640\nheight = 480\n[gates."{gate}"]\nline = [[100, 0], [100, 479]]\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (TOML.format(name="a", gate="<b>x,y</b>"), "letters, digits, spaces"),
        (TOML.format(name="=1+1", gate="g"), "letters, digits, spaces"),
        ('[site]\nname = "a"\nwidth = 640\nheight = 480\n', "has no gates and no zones; draw at least one"),
        (TOML.format(name="a", gate="g").replace("640", "650"), "not the same shape"),
    ],
    ids=["a tag", "a formula", "no gates", "another picture"],
)
def test_the_command_refuses_in_one_line_and_keeps_the_run(tmp_path, text, words, vidtrack):
    run = Path(write_run(tmp_path / "run", [straight(1, 2.0, 50, 240, 100, 5)]))
    before = {path.name: path.read_bytes() for path in run.iterdir()}
    (tmp_path / "site.toml").write_text(text)
    code, out, err = vidtrack("measure", "run", "--site", "site.toml", "-o", "out")
    assert code == 2
    assert words in err
    assert err.count("\n") == 1
    assert not out
    assert not (tmp_path / "out").exists()
    assert {path.name: path.read_bytes() for path in run.iterdir()} == before


def test_the_command_writes_each_table_twice(tmp_path, vidtrack):
    write_run(tmp_path / "run", [straight(1, 2.0, 50, 240, 100, 5)])
    (tmp_path / "site.toml").write_text(TOML.format(name="a", gate="g"))
    code, out, err = vidtrack("measure", "run", "--site", "site.toml", "-o", "out", "--json", "report.json")
    assert code == 0, err
    assert out == "out\n"
    assert "1 crossings" in err
    assert "no conflicts without a calibration" in err
    for name in TABLES - {"conflicts"}:
        table = pq.read_table(tmp_path / "out" / f"{name}.parquet")
        lines = (tmp_path / "out" / f"{name}.csv").read_text().splitlines()
        assert lines[0] == ",".join(table.column_names)
        assert len(lines) == len(table) + 1
    assert not (tmp_path / "out" / "conflicts.csv").exists()
    assert pq.read_schema(tmp_path / "out" / "crossings.parquet").field("speed_kmh").metadata == {b"unit": b"km/h"}
    assert json.loads((tmp_path / "report.json").read_text())["crossings"] == 1
