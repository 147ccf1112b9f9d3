"""Plot tables: what is read, and what is refused."""

import logging

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from plot_files import GOOD, HEADER, write

from vidtrack.config.radar import RadarSettings
from vidtrack.errors import FormatError, PlotFormatError, SourceError
from vidtrack.radar.plots import read_plots
from vidtrack.radar.reading import read

SKIP = RadarSettings(skip_bad_rows=True)


def test_range_and_azimuth_in_metres_and_radians(tmp_path):
    plots = read_plots(write(tmp_path / "p.csv", *GOOD))
    assert plots.polar
    assert (plots.dim, plots.doppler, plots.amplitude) == (2, False, None)
    assert plots.scan.tolist() == [0, 1, 2]
    assert plots.z[:, 0].tolist() == [1000, 1010, 1020]
    assert plots.z[:, 1] == pytest.approx(np.radians([10, -10, -20]))
    assert plots.sigma == pytest.approx(np.tile([5, np.radians(0.1)], (3, 1)))


def test_every_optional_column(tmp_path):
    header = "scan,time_s,range_m,azimuth_deg,elevation_deg,doppler_m_s,amplitude,sigma_doppler_m_s,note"
    plots = read_plots(write(tmp_path / "p.csv", "3,1.5,100,0,30,-20,4.5,0.5,7", header=header))
    assert (plots.dim, plots.doppler) == (3, True)
    assert plots.z == pytest.approx(np.array([[100, 0, np.radians(30), -20]]))
    assert plots.sigma[0, 3] == 0.5
    assert plots.amplitude.tolist() == [4.5]


def test_positions_instead_of_ranges(tmp_path):
    plots = read_plots(write(tmp_path / "p.csv", "0,0,1,2,3", header="scan,time_s,x_m,y_m,z_m"))
    assert not plots.polar
    assert plots.z.tolist() == [[1, 2, 3]]


def test_parquet_gives_the_same_as_csv(tmp_path):
    columns = dict(zip(HEADER.split(","), np.array([row.split(",") for row in GOOD], float).T, strict=True))
    columns["scan"] = columns["scan"].astype(int)
    pq.write_table(pa.table(columns), tmp_path / "plots.table")
    found, expected = read_plots(tmp_path / "plots.table"), read_plots(write(tmp_path / "p.csv", *GOOD))
    assert np.array_equal(found.z, expected.z)
    assert np.array_equal(found.scan, expected.scan)


def test_missing_sigmas_come_from_the_settings(tmp_path, caplog):
    path = write(tmp_path / "p.csv", "0,0,100,0", header="scan,time_s,range_m,azimuth_deg")
    plots = read_plots(path, RadarSettings(sigma_range_m=7.0))
    assert plots.sigma[0] == pytest.approx([7, np.radians(0.3)])
    assert "sigma_azimuth_deg" in caplog.text  # assumed, not given
    assert "sigma_range_m" not in caplog.text


def test_rows_in_any_order_are_sorted(tmp_path):
    plots = read_plots(write(tmp_path / "p.csv", GOOD[2], GOOD[0], GOOD[1]))
    assert plots.scan.tolist() == [0, 1, 2]
    assert plots.time_s.tolist() == [0, 1, 2]


def test_plots_of_one_time_are_a_scan_where_no_column_says_which(tmp_path, caplog):
    rows = ("8,100,5", "0,100,5", "0,300,5", "4,100,5", "20,100,5")
    with caplog.at_level(logging.WARNING):
        plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.scan.tolist() == [0, 0, 1, 2, 5]
    assert plots.time_s.tolist() == [0, 0, 4, 8, 20]
    assert "4 scans, 4 s apart" in caplog.text


def test_a_pause_holds_no_empty_scans_where_no_column_says_which(tmp_path):
    rows = ("0,100,5", "4,100,5", "8,100,5", "1000008,100,5", "1000012,100,5")
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.scan.tolist() == [0, 1, 2, 3, 4]


def test_turns_of_the_antenna_are_scans_where_each_plot_has_its_own_time(tmp_path, caplog):
    rng = np.random.default_rng(0)
    turn, azimuth = np.divmod(np.sort(rng.uniform(0, 40, 400)), 1)
    rows = [f"{4 * (k + a):.4f},{rng.uniform(1e3, 5e4):.1f},{360 * a:.3f}" for k, a in zip(turn, azimuth, strict=True)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert (plots.scan == turn).mean() > 0.99
    assert "40 scans, 4" in caplog.text


@pytest.mark.parametrize("header", ["time_s,range_m,azimuth_deg", "time_s,x_m,y_m"])
def test_turns_of_the_antenna_are_scans_where_times_are_in_whole_seconds(tmp_path, caplog, header):
    rng = np.random.default_rng(0)
    turn, part = np.divmod(np.sort(rng.uniform(0, 40, 400)), 1)
    east_north = np.sin(2 * np.pi * part), np.cos(2 * np.pi * part)
    ranges = rng.uniform(5e3, 5e4, 400)
    place = (ranges, 360 * part) if "range_m" in header else tuple(ranges * one for one in east_north)
    rows = [f"{int(t)},{u:.3f},{v:.3f}" for t, u, v in zip(4 * (turn + part), *place, strict=True)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header=header))
    assert (plots.scan == turn).mean() > 0.99
    assert "40 scans, 4" in caplog.text


def test_turns_in_another_order_than_their_times_are_not_taken(tmp_path, caplog):
    rng = np.random.default_rng(24)
    turns = np.sort(rng.uniform(0, 60, 120))
    azimuth, false = 360 * turns % 360, rng.random(120) < 0.1
    azimuth[false] = rng.uniform(0, 360, false.sum())
    rows = [f"{int(4 * t)},{rng.uniform(3e3, 5e4):.1f},{a:.3f}" for t, a in zip(turns, azimuth, strict=True)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.time_s.tolist() == np.floor(4 * turns).tolist()
    assert "antenna" not in caplog.text


@pytest.mark.parametrize(("turn_s", "told"), [(1.5, True), (1.8, True), (4.0, False)])
def test_times_too_coarse_for_the_turns_are_told(tmp_path, caplog, turn_s, told):
    rng = np.random.default_rng(0)
    turns = np.sort(rng.uniform(0, 40, 600))
    ranged = zip(turns, rng.uniform(5e3, 5e4, 600), strict=True)
    rows = [f"{int(turn_s * t)},{r:.1f},{360 * t % 360:.3f}" for t, r in ranged]
    read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert ("too coarse to tell its turns: give a column 'scan'" in caplog.text) is told


@pytest.mark.parametrize(("sector_deg", "step_s"), [((40, 70), 0.5), ((80, 140), 1.0)])
def test_a_pass_over_a_sector_is_one_scan_where_rounded_times_part_it(tmp_path, caplog, sector_deg, step_s):
    rng = np.random.default_rng(0)
    azimuth = np.linspace(*sector_deg, 8)
    passed = [(k, n) for k in range(60) if k % 20 != 7 for n in range(8) if rng.random() < 0.9]
    times = [round((4 * k + 4 * azimuth[n] / 360) / step_s) * step_s for k, n in passed]
    rows = [
        f"{t:.1f},{8e3 + 2e3 * n + k:.0f},{azimuth[n] + rng.normal(0, 0.2):.2f}"
        for t, (k, n) in zip(times, passed, strict=True)
    ]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.scan.tolist() == [k for k, _ in passed]
    assert len(set(times)) > 80  # more than there are passes
    assert "passes over a sector, the plots of one pass are one scan; 57 scans, 4 s apart" in caplog.text


@pytest.mark.parametrize("step_s", [0.0, 0.5])
@pytest.mark.parametrize("targets", [3, 10])
def test_passes_of_an_antenna_back_and_forth_are_scans(tmp_path, caplog, targets, step_s):
    rng = np.random.default_rng(0)
    part = rng.uniform(0.02, 0.98, targets)
    seen = sorted((4 * (k + (a if k % 2 else 1 - a)), k, n) for k in range(80) for n, a in enumerate(part))
    seen = [one for one in seen if rng.random() < 0.9]
    rows = [
        f"{np.floor(t / step_s) * step_s if step_s else t:.4f},{5e3 + 4e3 * n + k:.0f},{90 * part[n] - 30:.2f}"
        for t, k, n in seen
    ]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    number = np.array([k for _, k, _ in seen])
    assert (plots.scan - plots.scan[0] == number - number[0]).mean() > 0.98
    assert "azimuths and times follow an antenna, its passes back and forth are scans" in caplog.text


@pytest.mark.parametrize("step_s", [0.0, 0.5, 1.0])
def test_turns_to_the_left_are_scans(tmp_path, caplog, step_s):
    rng = np.random.default_rng(0)
    turn, part = np.divmod(np.sort(rng.uniform(0, 40, 400)), 1)
    times = 4 * (turn + part)
    told = np.floor(times / step_s) * step_s if step_s else times
    rows = [f"{t:.4f},{rng.uniform(5e3, 5e4):.1f},{360 - 360 * a:.3f}" for t, a in zip(told, part, strict=True)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert (plots.scan == turn).mean() > 0.99
    assert "its turns are scans; 40 scans, 4" in caplog.text


@pytest.mark.parametrize("turn_s", [2.5, 4.0])
def test_turns_of_a_dense_radar_are_scans_where_times_are_in_whole_seconds(tmp_path, turn_s):
    rng = np.random.default_rng(0)
    turn, part = np.divmod(np.sort(rng.uniform(0, 20, 12_000)), 1)
    times = np.floor(turn_s * (turn + part)).astype(int)
    rows = [f"{t},{rng.uniform(5e3, 5e4):.2f},{360 * a:.3f}" for t, a in zip(times, part, strict=True)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert (plots.scan == turn).mean() > 0.99


def test_turns_of_a_harbour_radar_are_scans_though_its_times_are_rounded_and_its_boats_near(tmp_path, caplog):
    rng = np.random.default_rng(0)
    part = np.array([0.02, 0.05, 0.17, 0.21, 0.38, 0.44, 0.59, 0.70, 0.83, 0.93])
    near = rng.uniform(100, 600, 10)
    seen = sorted((round(4 * (k + a), 1), k, n) for k in range(30) for n, a in enumerate(part))
    rows = [f"{t:.1f},{near[n] + 4 * k:.1f},{360 * part[n]:.2f}" for t, k, n in seen]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    number = np.array([k for _, k, _ in seen])
    assert (np.diff(plots.scan) == np.diff(number)).mean() > 0.98
    assert "its turns are scans; 30 scans, 4" in caplog.text or "its turns are scans; 31 scans, 4" in caplog.text


def test_turns_of_an_antenna_whose_rate_drifts_are_scans(tmp_path):
    rng = np.random.default_rng(0)
    turn, part = np.divmod(np.sort(rng.uniform(0, 60, 6000)), 1)
    times = 1.25 * (turn + part) * (1 + 0.08 * (turn + part) / 60)
    rows = [f"{t:.4f},{rng.uniform(5e3, 5e4):.2f},{360 * a:.3f}" for t, a in zip(times, part, strict=True)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert (plots.scan == turn).mean() > 0.98


@pytest.mark.parametrize("first_m", [4e3, 60.0])
def test_targets_that_swing_before_a_radar_that_stares_are_no_antenna(tmp_path, caplog, first_m):
    """Two of them, as seen from a boat that yaws."""
    rows = [
        f"{t},{first_m * (1 + n) + 5 * t},{45 + 3 * n + 20 * np.sin(2 * np.pi * t / 8):.3f}"
        for t in range(200)
        for n in range(2)
    ]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.scan.tolist() == [t for t in range(200) for _ in range(2)]
    assert "antenna" not in caplog.text


@pytest.mark.parametrize("header", ["time_s,range_m,azimuth_deg", "time_s,x_m,y_m"])
@pytest.mark.parametrize("at_random", [False, True])
def test_vehicles_that_pass_a_radar_that_stares_one_after_the_other_are_no_antenna(tmp_path, caplog, header, at_random):
    rng = np.random.default_rng(0)
    begin = np.cumsum(rng.exponential(20, 60) if at_random else np.full(60, 6.0)).round(1)
    seen = {round(t + k / 10, 1): np.radians(-40 + 5.5 * k) for t in begin for k in range(15)}
    rows = [
        f"{t},{20 / np.cos(a):.2f},{np.degrees(a):.2f}" if "range_m" in header else f"{t},{20 * np.tan(a):.2f},20"
        for t, a in seen.items()
    ]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header=header))
    assert len(np.unique(plots.scan)) == len(seen)
    assert "antenna" not in caplog.text


def test_scans_in_bursts_are_no_turns_of_an_antenna(tmp_path, caplog):
    rng = np.random.default_rng(0)
    scans_s = [60 * k + j for k in range(4) for j in range(10)]
    rows = [f"{t},{rng.uniform(3e3, 11e3):.1f},{rng.uniform(70, 110):.3f}" for t in scans_s for _ in range(4)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.scan.tolist() == [t for t in scans_s for _ in range(4)]
    assert "antenna" not in caplog.text


@pytest.mark.parametrize("targets", [1, 3])
@pytest.mark.parametrize("scan_s", [1, 4, 30])
def test_targets_that_stay_in_their_direction_are_no_turning_antenna(tmp_path, caplog, targets, scan_s):
    rows = [f"{scan_s * k},{9000 + 10 * k},{40 + 90 * j}" for k in range(200) for j in range(targets)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.scan.tolist() == [k for k in range(200) for _ in range(targets)]
    assert "antenna" not in caplog.text


@pytest.mark.parametrize("jump_s", [3e5, 1e6])
def test_a_jump_of_the_clock_holds_no_turns_of_the_antenna(tmp_path, caplog, jump_s):
    rng = np.random.default_rng(0)
    times = np.sort(rng.uniform(0, 160, 400))
    rows = [f"{t + jump_s * (t > 80):.4f},{rng.uniform(1e3, 5e4):.1f},{90 * t % 360:.3f}" for t in times]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.scan.tolist() == np.floor(times / 4).astype(int).tolist()
    assert "40 scans, 4" in caplog.text


def _rows_of_scans(count=40, back_s=0.0):
    """Rows of `count` scans of 5 plots, 4 s apart, and half way a clock that is set back."""
    times = [4.0 * k - back_s * (k >= count / 2) for k in range(count) for _ in range(5)]
    return [f"{t},{1000 + 10 * n},{72 * n % 360}" for n, t in enumerate(times)]


def test_a_clock_that_was_set_back_goes_on_where_no_column_says_the_scan(tmp_path, caplog):
    plots = read_plots(write(tmp_path / "p.csv", *_rows_of_scans(back_s=60.0), header="time_s,range_m,azimuth_deg"))
    assert plots.time_s.tolist() == [4.0 * k for k in range(40) for _ in range(5)]
    assert plots.z[:, 0].tolist() == [1000 + 10 * n for n in range(200)]
    assert "time_s goes back from 76 to 20 s at line 102" in caplog.text


def test_a_clock_that_was_set_back_goes_on_where_the_rows_of_a_scan_are_newest_first(tmp_path):
    scans_s = [4 * k - 60 * (k >= 20) for k in range(40)]
    rows = [f"{t + 0.4 * n:.1f},{1000 + 10 * k + n},{36 * n}" for k, t in enumerate(scans_s) for n in range(9, -1, -1)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.time_s == pytest.approx([0.4 * n for n in range(400)])
    assert plots.scan.tolist() == [k for k in range(40) for _ in range(10)]


def test_turns_of_the_antenna_are_found_over_a_clock_that_was_set_back(tmp_path):
    times = np.sort(np.random.default_rng(0).uniform(0, 160, 400))
    rows = [f"{t - 61.3 * (t > 80):.4f},{1e4 + 37 * k},{90 * t % 360:.3f}" for k, t in enumerate(times)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.scan.tolist() == np.floor(times / 4).astype(int).tolist()


@pytest.mark.parametrize(
    "order", ["shuffled", "downwards", "downwards with a missed scan", "by target", "late", "wrong time"]
)
def test_rows_in_another_order_than_that_of_arrival_are_not_taken_for_a_clock(tmp_path, caplog, order):
    rows = [row + ",0" for row in _rows_of_scans()]
    if order == "shuffled":
        rows = [rows[k] for k in np.random.default_rng(0).permutation(len(rows))]
    elif order == "downwards":
        rows = rows[::-1]
    elif order == "downwards with a missed scan":
        rows = (rows[:100] + rows[105:])[::-1]
    elif order == "by target":
        rows = [row[:-1] + str(k) for k in range(5) for row in rows[k::5]]
    elif order == "late":
        rows = rows[:50] + rows[60:100] + rows[50:60] + rows[100:]
    else:
        rows[50] = "9000,1500,0,0"
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg,source"))
    times = [4.0 * k for k in range(40) for _ in range(5)]
    if "missed" in order:
        times[100:105] = []
    elif "wrong" in order:
        times = [*times[:50], *times[51:], 9000]
    assert plots.time_s.tolist() == times
    told = order == "by target"
    assert ("goes back" in caplog.text) is told
    assert ("where column 'source' changes: rows are sorted by time_s" in caplog.text) is told


@pytest.mark.parametrize("column", [",date", ""])
@pytest.mark.parametrize(
    ("scan_s", "begin_s", "days"),
    [(4, 86_320, 2), (300, 0, 2), (300, 0, 3), (900, 0, 2), (900, 0, 9), (900, 30_000, 9)],
)
def test_times_of_day_go_on_after_midnight(tmp_path, caplog, column, scan_s, begin_s, days):
    times = [t for t in range(begin_s, 86_400 * days - begin_s, scan_s) for _ in range(5)]
    day = ["" if not column else f",{t // 86_400}" for t in times]
    rows = [f"{t % 86_400},{1000 + k},{72 * k % 360}{day[k]}" for k, t in enumerate(times)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg" + column))
    assert plots.time_s.tolist() == times
    assert ("days are those of column 'date'" if column else "as if a day ended: time goes on there") in caplog.text


@pytest.mark.parametrize("jitter_s", [0.5, 2.0])
def test_midnight_is_found_where_rows_are_not_strictly_in_order(tmp_path, jitter_s):
    rng = np.random.default_rng(1)
    times = np.sort(rng.uniform(86_300, 86_500, 600)).round(3)
    arrived = times[np.argsort(times + rng.normal(0, jitter_s, 600), kind="stable")]
    rows = [f"{t % 86_400:.3f},{rng.uniform(1e3, 5e4):.1f},{90 * t % 360:.3f}" for t in arrived]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.time_s == pytest.approx(times)


@pytest.mark.parametrize("newest_first", [False, True])
@pytest.mark.parametrize("count", [4, 8, 40])
def test_midnight_is_found_with_few_rows_after_it_or_before(tmp_path, count, newest_first):
    times = [86_400 + 4 * (k - count + 2) for k in range(count)]
    rows = [f"{t % 86_400},{5000 + t},10" for t in (times[::-1] if newest_first else times)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.time_s.tolist() == times


def test_shuffled_rows_about_midnight_are_no_days(tmp_path):
    times = np.random.default_rng(0).permutation(np.arange(86_320, 86_480) % 86_400)
    rows = [f"{t},{5000 + t},10" for t in times]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.time_s.tolist() == sorted(times)


@pytest.mark.parametrize("gap_s", [90, 1200, 20_000])
def test_a_gap_at_midnight_is_kept(tmp_path, caplog, gap_s):
    times = [*range(86_000, 86_400, 4), *range(86_400 + gap_s, 86_800 + gap_s, 4)]
    rows = [f"{t % 86_400},{5000 + k},10" for k, t in enumerate(times)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.time_s.tolist() == times
    assert f"goes back from 86396 to {gap_s} s at line 102, as if a day ended: time goes on there" in caplog.text


def test_gaps_at_many_midnights_are_kept(tmp_path):
    times = [86_400 * d + t for d in range(9) for t in range(30_000 if d == 0 else 900, 85_500, 300)]
    rows = [f"{t % 86_400},{5000 + k},{72 * n}" for k, t in enumerate(times) for n in range(2)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.time_s.tolist() == [t for t in times for _ in range(2)]


@pytest.mark.parametrize(
    ("column", "values"),
    [
        ("date", ["2026-07-30", "2026-08-01", "2026-08-02"]),
        ("began", ["20260730", "20260801", "20260802"]),
        ("Stamp", ["2026-07-30T10:00:00Z", "2026-08-01T10:00:00Z", "2026-08-02 10:00:00"]),
        ("day", ["5", "7", "8"]),
        ("date", ["30/07/2026", "01/08/2026", "02/08/2026"]),
    ],
)
@pytest.mark.parametrize("by_target", [False, True])
def test_a_column_of_dates_tells_the_days(tmp_path, caplog, column, values, by_target):
    given = [0, 1, 2] if "/" in values[0] else [0, 2, 3]
    plots = [(k, d, t) for k in range(2) for d in range(3) for t in range(21_600, 79_200, 900)]
    if not by_target:
        plots.sort(key=lambda one: one[1:])
    rows = [f"{t},{5000 + 1000 * k},{72 * k},{values[d]},{k}" for k, d, t in plots]
    rows[3] = rows[3].replace(str(plots[3][2]), "9000000")  # a wrong time
    found = read_plots(write(tmp_path / "p.csv", *rows, header=f"time_s,range_m,azimuth_deg,{column},id"), SKIP)
    del plots[3]
    assert found.time_s[:-1].tolist() == sorted(86_400 * given[d] + t for _, d, t in plots)
    assert (f"days are those of column {column!r}" in caplog.text) is not by_target
    assert ("where column 'id' changes: rows are sorted by time_s" in caplog.text) is by_target


def test_dates_beside_times_that_go_on_are_not_added(tmp_path):
    times = [4 * k for k in range(40)]
    rows = [f"{t},{5000 + t},10,2026-07-0{1 + (t >= 60)}" for t in [*times[1:3], times[0], *times[3:]]]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg,date"))
    assert plots.time_s.tolist() == times


@pytest.mark.parametrize("column", [",id", ""])
def test_targets_one_after_the_other_over_midnight_are_of_one_night(tmp_path, caplog, column):
    times = range(86_320, 86_480, 4)
    name = ["" if not column else f",{n}" for n in range(4)]
    rows = [f"{(t + n / 10) % 86_400:.1f},{5000 + n},{40 * n}{name[n]}" for n in range(4) for t in times]
    path = write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg" + column)
    if column:
        assert read_plots(path).time_s == pytest.approx(sorted(t + n / 10 for n in range(4) for t in times))
        assert "goes on from 76 to 86320.1 s at line 42, the first of 3 such steps, where column 'id'" in caplog.text
    else:
        with pytest.raises(PlotFormatError, match=r"goes on from 76 to 86320\.1 s at line 42.* where it began before"):
            read_plots(path)


@pytest.mark.parametrize(("column", "apart_s"), [(True, 600), (True, -600), (True, 0), (False, 600), (False, 0)])
def test_targets_that_begin_before_midnight_and_after_it_are_of_one_night(tmp_path, column, apart_s):
    begins_s = [86_400 - 5 * apart_s + 100 + apart_s * j - 300 * (j % 3) - 200 * (j == 0) for j in range(10)]
    seen = [(begin_s + 4 * k, j) for j, begin_s in enumerate(begins_s) for k in range(200)]
    rows = [f"{t % 86_400},{5000 + 100 * j},{9 * j}" + column * f",{j}" for t, j in seen]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg" + column * ",id"))
    assert plots.time_s.tolist() == sorted(t for t, _ in seen)


def test_a_long_gap_on_the_second_day_is_a_gap(tmp_path):
    times = [*range(86_320, 86_480, 4), *range(140_000, 140_400, 4)]
    rows = [f"{t % 86_400},{5000 + t},10" for t in times]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.time_s.tolist() == times


@pytest.mark.parametrize(("begin_s", "name"), [(0, "session"), (20, "file"), (40, "source")])
def test_scans_that_begin_again_where_another_column_changes_are_asked_about(tmp_path, begin_s, name):
    scans_s = [*range(0, 80, 4), *range(begin_s, begin_s + 80, 4)]
    rows = [f"{t},{1000 + 10 * k + n},{72 * n},{'ab'[k >= 20]}" for k, t in enumerate(scans_s) for n in range(5)]
    path = write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg," + name)
    with pytest.raises(PlotFormatError, match=f"at line 102, where column '{name}' changes: .* a table each"):
        read_plots(path)


@pytest.mark.parametrize(
    ("spans_s", "sensors"),
    [
        ([(0, 800), (0, 800)], "AB"),
        ([(0, 8000), (5000, 9000)], "AB"),
        ([(0, 86_400)] * 4, "AABB"),
        ([(80_000, 90_000)] * 2, "AB"),
        ([(80_000, 86_400), (0, 8000)], "AB"),
    ],
)
@pytest.mark.parametrize("name", ["radar", "Sensor_ID"])
def test_radars_one_after_the_other_in_a_table_are_refused(tmp_path, spans_s, sensors, name):
    seen = [(t, one) for (begin, end), one in zip(spans_s, sensors, strict=True) for t in range(begin, end, 40)]
    rows = [f"{t % 86_400},{5000 + k},{k % 360},{one}" for k, (t, one) in enumerate(seen)]
    path = write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg," + name)
    with pytest.raises(
        PlotFormatError, match=f"in order of column '{name}': .* give a table each, with --radars, else"
    ):
        read_plots(path)


@pytest.mark.parametrize("targets", [2, 3, 4, 7])
def test_times_that_begin_again_are_asked_about_where_no_column_tells_why(tmp_path, targets):
    rows = [f"{4 * k + n / 2},{1000 + 10 * k},{50 * n}" for n in range(targets) for k in range(40)]
    path = write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg")
    with pytest.raises(
        PlotFormatError, match=r"goes back from 156 to 0\.5 s at line 42.* where it began before"
    ) as caught:
        read_plots(path)
    assert "give times that go on; if these are several radars, give a table each, with --radars" in str(caught.value)
    by_time = sorted(rows, key=lambda row: float(row.split(",")[0]))
    plots = read_plots(write(path, *by_time, header="time_s,range_m,azimuth_deg"))
    assert plots.time_s.tolist() == sorted(4 * k + n / 2 for n in range(targets) for k in range(40))


def test_a_clock_that_begins_at_zero_again_is_asked_about(tmp_path):
    rows = [f"{4 * k},{1000 + 10 * k + n},{72 * n}" for scans in (20, 60) for k in range(scans) for n in range(5)]
    with pytest.raises(PlotFormatError, match="goes back from 76 to 0 s at line 102, where it began before: if the cl"):
        read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))


DAY = [900 * k for k in range(96)]
"""Times of the scans of a whole day."""


@pytest.mark.parametrize(
    ("header", "of_day", "told"),
    [
        ("head", ["north", "south", "west"], "where column 'head' changes: if a day ended"),
        ("candidate", ["a", "b"], "where column 'candidate' changes: if a day ended"),
        ("serial", ["10010001", "10010002"], "where column 'serial' changes: if a day ended"),
        ("serial", ["10010101", "10010102"], "where column 'serial' changes: if a day ended"),
        ("weekday", ["Mon", "Tue"], "where column 'weekday' changes: .*, or name the column 'date'"),
        ("date", ["1", "2", "1", "2"], "where it began before: if the clock was set"),
        ("began", ["2026-07-01", "2026-07-02"], ""),
        ("day", ["5", "6"], ""),
    ],
)
def test_whole_days_that_may_be_of_several_radars_are_asked_about(tmp_path, header, of_day, told):
    rows = [f"{t},{1000 + t + n},{72 * n},{one}" for one in of_day for t in DAY for n in range(5)]
    path = write(tmp_path / "p.csv", *rows, header=f"time_s,range_m,azimuth_deg,{header}")
    if told:
        with pytest.raises(PlotFormatError, match=f"{told}.* give a table each, with --radars"):
            read_plots(path)
    else:
        assert read_plots(path).time_s[-1] == 86_400 * len(of_day) - 900


def test_a_column_that_changes_at_one_midnight_of_an_unbroken_night_does_no_harm(tmp_path):
    times = range(86_320, 86_480, 4)
    rows = [f"{t % 86_400},{5000 + t},10,{'ab'[t >= 86_400]}" for t in times]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg,file"))
    assert plots.time_s.tolist() == list(times)


def test_days_of_one_target_after_the_other_are_of_one_time(tmp_path, caplog):
    times = [900 * k for k in range(40, 270)]
    rows = [f"{t % 86_400},{1000 * one + t},{72 * one},{one}" for one in (1, 2) for t in times]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg,id"))
    assert plots.time_s.tolist() == sorted([*times, *times])
    assert "where column 'id' changes: rows are sorted by time_s" in caplog.text


@pytest.mark.parametrize(
    ("column", "values", "told"), [("Radar_ID", "ab", True), ("radar", "aa", False), ("to", "ab", False)]
)
def test_a_column_that_tells_several_radars_apart_is_not_ignored_in_silence(tmp_path, caplog, column, values, told):
    rows = [f"{k},{4 * k + j},{1000 + 10 * k},{72 * j},{values[j]}" for k in range(20) for j in range(2)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header=f"scan,time_s,range_m,azimuth_deg,{column}"))
    assert len(plots) == 40
    assert (f"column {column!r} has 2 values, but all plots are taken as of one radar" in caplog.text) is told


@pytest.mark.parametrize(
    ("values", "count"),
    [
        ([[1], [2]], 2),
        ([[1], [1]], 1),
        ([{"id": 1}, {"id": 2}], 2),
        (["a", None], 1),
        ([1.0, float("nan")], 1),
        ([None, None], 0),
        (["a", ""], 1),
    ],
)
def test_values_of_any_kind_tell_several_radars_apart(tmp_path, caplog, values, count):
    columns = {"scan": [0, 1], "time_s": [0.0, 1.0], "range_m": [1e3, 1e3], "azimuth_deg": [5.0, 5.0], "radar": values}
    pq.write_table(pa.table(columns), tmp_path / "p.parquet")
    assert len(read_plots(tmp_path / "p.parquet")) == 2
    assert (f"column 'radar' has {count} values" in caplog.text) is (count > 1)
    assert ("several radars" in caplog.text) is (count > 1)


def test_many_pieces_that_begin_anywhere_are_sorted_and_told(tmp_path, caplog):
    begins = [0, 300, 100, 400, 200, 500, 50, 250, 150]
    rows = [f"{begin + 4 * k},{1000 + 10 * k},{40 * n}" for n, begin in enumerate(begins) for k in range(40)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert plots.time_s.tolist() == sorted(begin + 4 * k for begin in begins for k in range(40))
    assert "goes back from 456 to 100 s at line 82, the first of 4 such steps: rows are sorted by time_s" in caplog.text


@pytest.mark.parametrize("stray", ["1e300", "-1e300", "-1e18"])
def test_a_time_that_cannot_be_one_does_not_hide_the_turns_of_the_antenna(tmp_path, caplog, stray):
    times = np.sort(np.random.default_rng(0).uniform(0, 160, 400))
    rows = [f"{stray if k == 200 else f'{t:.4f}'},{1e4 + 37 * k},{90 * t % 360:.3f}" for k, t in enumerate(times)]
    plots = read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"), SKIP)
    assert plots.scan.tolist() == np.floor(np.delete(times, 200) / 4).astype(int).tolist()
    assert "1 bad row: line 202" in caplog.text


def test_plots_one_by_one_that_follow_no_antenna_are_warned_of(tmp_path, caplog):
    rng = np.random.default_rng(0)
    rows = [f"{t:.4f},{rng.uniform(1e3, 5e4):.1f},{rng.uniform(0, 360):.3f}" for t in np.sort(rng.uniform(0, 160, 400))]
    read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert "nearly every plot its own time" in caplog.text


@pytest.mark.parametrize(("step", "told"), [(4, False), (60, False), (4000, True)])
def test_times_that_seem_to_be_milliseconds_are_asked_about(tmp_path, caplog, step, told):
    rows = [f"{k},{step * k},{1000 + k},5" for k in range(20)]
    read(write(tmp_path / "p.csv", *rows, header="scan,time_s,range_m,azimuth_deg"), RadarSettings())
    assert (f"scans are {step} s apart: is time_s in seconds, not in milliseconds?" in caplog.text) is told


def test_bad_times_without_scans_are_refused_as_bad_times(tmp_path):
    path = write(tmp_path / "p.csv", "0,100,5", "nan,100,5", "4,100,5", header="time_s,range_m,azimuth_deg")
    with pytest.raises(PlotFormatError, match="time_s"):
        read_plots(path)


def test_spaces_after_commas_do_no_harm(tmp_path):
    path = write(tmp_path / "p.csv", "0, 0, 100, 5", header="scan, time_s, range_m, azimuth_deg")
    assert read_plots(path).z[0, 0] == 100


@pytest.mark.parametrize(
    ("header", "named"),
    [
        ("scan,time_s,range,azimuth_deg", ["'range_m'", "'range'"]),
        ("scan,time_s,range_km,azimuth_deg", ["'range_m'", "'range_km'"]),
        ("scan,time,range_m,azimuth_deg", ["'time_s'", "'time'"]),
        ("skan,time_s,range_m,azimuth_deg", ["'scan'", "'skan'"]),
        ("time,nr,range_m,azimuth_deg", ["no column 'time_s'", "'time'", "'scan' may be left out"]),
        ("scan,time_s,x_m,ym", ["'y_m'", "'ym'"]),
        ("scan,time_s,a,b", ["range_m", "azimuth_deg", "x_m", "y_m"]),
    ],
)
def test_a_missing_column_is_named_with_the_nearest(tmp_path, header, named):
    path = write(tmp_path / "p.csv", "0,0,1,1", header=header)
    with pytest.raises(PlotFormatError) as caught:
        read_plots(path)
    assert all(name in str(caught.value) for name in named)


@pytest.mark.parametrize(
    ("given", "meant"),
    [("Elevation", "elevation_deg"), ("amplitud", "amplitude"), ("sigma_rang_m", "sigma_range_m")],
)
def test_an_optional_column_that_is_misspelt_is_not_ignored_in_silence(tmp_path, caplog, given, meant):
    path = write(tmp_path / "p.csv", "0,0,1,1,5", header=f"scan,time_s,range_m,azimuth_deg,{given}")
    with caplog.at_level(logging.WARNING):
        assert read_plots(path).dim == 2
    assert f"column {given!r} is not used; is it {meant!r}?" in caplog.text


def test_other_columns_are_ignored(tmp_path, caplog):
    path = write(tmp_path / "p.csv", "0,0,1,1,5,a", header="scan,time_s,x_m,y_m,sigma_total,beam")
    assert len(read_plots(path, RadarSettings(sigma_position_m=5.0))) == 1
    assert not caplog.text


BAD = [
    ("3,3.0,nan,10,5,0.1", "range_m"),
    ("3,3.0,,10,5,0.1", "range_m"),
    ("3,3.0,far,10,5,0.1", "'far'"),
    ("3,3.0,1000,inf,5,0.1", "azimuth_deg"),
    ("3,3.0,2000000,10,5,0.1", "wrong units suspected"),
    ("3,3.0,-5,10,5,0.1", "range_m is -5"),
    ("3,3.0,1000,361,5,0.1", "azimuth_deg is 361"),
    ("3,3.0,1000,-360.5,5,0.1", "azimuth_deg"),
    ("3,3.0,1000,10,-5,0.1", "sigma_range_m is -5"),
    ("3,3.0,1000,10,0,0.1", "sigma_range_m is 0"),
    ("3,3.0,1000,10,5,90", "sigma_azimuth_deg"),
    ("3.5,3.0,1000,10,5,0.1", "scan is 3.5"),
    ("-1,3.0,1000,10,5,0.1", "scan is -1"),
    ("3,soon,1000,10,5,0.1", "'soon'"),
    ("3,1e300,1000,10,5,0.1", "time_s is 1e+300; over 100,000,000,000 s: wrong units suspected"),
    ("3,1700000000000,1000,10,5,0.1", "time_s is 1.7e+12; over"),
    ("3,3.0,1000,10,5", "5 cells"),
    ("3,3.0,1000,10,5,0.1,7", "7 cells"),
    ("1,1.0,1010,350,5,0.1", "the plot of line 3 again"),
    ("3,0.5,1000,10,5,0.1", "scan 3"),
    ("999999999,4.0,1000,10,5,0.1", "a gap"),
]


@pytest.mark.parametrize(("row", "named"), BAD)
def test_a_bad_row_is_named_by_line_value_and_rule(tmp_path, row, named):
    path = write(tmp_path / "p.csv", *GOOD, row)
    with pytest.raises(PlotFormatError) as caught:
        read_plots(path)
    assert isinstance(caught.value, FormatError)
    assert "line 5" in str(caught.value)
    assert named in str(caught.value)
    assert "--skip-bad-rows" in str(caught.value)


@pytest.mark.parametrize(("row", "named"), BAD)
def test_good_rows_are_not_lost_when_bad_ones_are_skipped(tmp_path, caplog, row, named):
    plots = read_plots(write(tmp_path / "p.csv", GOOD[0], *GOOD[1:], row), SKIP)
    assert plots.scan.tolist() == [0, 1, 2]
    assert plots.bad_rows == 1
    assert named in caplog.text


def test_rows_of_parquet_are_counted_from_one(tmp_path):
    columns = {"scan": [0, 1, 2], "time_s": [0.0, 1.0, 2.0], "x_m": [1.0, None, 3.0], "y_m": [0.0, 0.0, 2e6]}
    pq.write_table(pa.table(columns), tmp_path / "p.parquet")
    with pytest.raises(PlotFormatError, match=r"row 2: x_m is nan.*row 3: y_m .*wrong units suspected"):
        read_plots(tmp_path / "p.parquet")


def test_many_bad_rows_are_counted_and_the_first_are_shown(tmp_path):
    path = write(tmp_path / "p.csv", *[f"{k},{k},-1,0,5,0.1" for k in range(9)])
    with pytest.raises(PlotFormatError, match=r"9 bad rows: line 2: .* line 6: .*and 4 more"):
        read_plots(path)


def test_a_row_before_an_uneven_one_and_after_it_keep_their_lines(tmp_path):
    path = write(tmp_path / "p.csv", GOOD[0], "1,2", GOOD[1], "2,2.0,-1,0,5,0.1")
    with pytest.raises(PlotFormatError, match=r"line 3: 2 cells.*line 5: range_m is -1"):
        read_plots(path)


@pytest.mark.parametrize("settings", [RadarSettings(), SKIP])
def test_a_file_of_bad_rows_only_is_refused(tmp_path, settings):
    with pytest.raises(PlotFormatError, match="range_m"):
        read_plots(write(tmp_path / "p.csv", "0,0,-1,0,5,0.1"), settings)


@pytest.mark.parametrize("text", ["", "\n\n", HEADER, HEADER + "\n", "\x00\x01\x02", "no table at all"])
def test_a_file_without_plots_is_refused(tmp_path, text):
    path = tmp_path / "p.csv"
    path.write_text(text)
    with pytest.raises(PlotFormatError, match=r"p\.csv"):
        read_plots(path)


def test_binary_rubbish_and_damaged_parquet_are_refused(tmp_path):
    for content in (bytes(range(256)), b"PAR1 but no more"):
        path = tmp_path / "p.parquet"
        path.write_bytes(content)
        with pytest.raises(PlotFormatError):
            read_plots(path)


@pytest.mark.parametrize(
    ("feeds_s", "share", "told"),
    [
        ((0.2,), 1, "40 of 80 plots come once more, 0.2 s later"),
        ((0.2, 0.4), 1, "80 of 120 plots come once more, 0.4 s later"),
        ((0.2,), 0.3, " plots come once more, 0.2 s later"),
        ((40.0,), 1, None),
    ],
)
def test_plots_that_come_over_several_feeds_are_told(tmp_path, caplog, feeds_s, share, told):
    rng = np.random.default_rng(0)
    plots = [(4 * k, f"{range_m:.1f},10") for k, range_m in enumerate(rng.uniform(1e3, 5e4, 40))]
    copies = [(t + late, plot) for late in feeds_s for t, plot in plots if rng.random() < share]
    rows = [f"{t},{plot}" for t, plot in sorted(plots + copies)]
    read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert ("come once more" in caplog.text) == (told is not None)
    assert (told or "") in caplog.text


def test_copies_are_told_where_plots_come_back_after_a_time(tmp_path, caplog):
    """As of an object that circles: every 40 s it is where it was."""
    range_m = np.tile(np.random.default_rng(0).uniform(1e3, 5e4, 10), 4)
    rows = [f"{4 * k + late},{r:.1f},10" for k, r in enumerate(range_m) for late in (0, 0.2)]
    read_plots(write(tmp_path / "p.csv", *rows, header="time_s,range_m,azimuth_deg"))
    assert "40 of 80 plots come once more, 0.2 s later" in caplog.text


@pytest.mark.parametrize("scans", [2, 5, 30])
@pytest.mark.parametrize("error_m", [0, 15])
def test_objects_that_stand_still_are_no_second_feed(tmp_path, caplog, scans, error_m):
    rng = np.random.default_rng(scans)
    range_m = 1000.0 * np.arange(1, 11)
    rows = [
        f"{k},{4 * k},{30 * round((r + rng.normal(0, error_m)) / 30)},10"
        for k in range(scans)
        for r in range_m[rng.random(10) < 0.9]
    ]
    read_plots(write(tmp_path / "p.csv", *rows, header="scan,time_s,range_m,azimuth_deg"))
    assert "come once more" not in caplog.text


@pytest.mark.parametrize(
    "damage",
    [lambda content: content.replace(b"scan", b"\xe1can"), lambda content: content[:4] + bytes(40) + content[44:]],
    ids=["name", "page"],
)
def test_parquet_that_is_damaged_within_is_refused(tmp_path, damage):
    path = tmp_path / "p.parquet"
    pq.write_table(pa.table({"scan": np.arange(50), "x_m": np.arange(50.0)}), path)
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(PlotFormatError, match="is not a readable Parquet file"):
        read_plots(path)


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("", "is empty"),
        ("\n\n", "is empty"),
        ("\ufeff", "is empty"),
        ("scan;time_s;x_m\n0;0,5;1\n", "semicolons"),
        ("scan\tx_m\n0\t1\n", "tabs"),
        ("scan;time_s;x_m;y_m,note\n0;0;1;2,here\n", "semicolons"),
        ("scan|time_s|x_m\n0|0|1\n", "bars"),
    ],
)
def test_an_empty_file_and_other_separators_are_named(tmp_path, content, named):
    path = tmp_path / "plots.csv"
    path.write_text(content)
    with pytest.raises(PlotFormatError, match=named):
        read_plots(path)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-be"])
@pytest.mark.parametrize("text", ["\n".join([HEADER, *GOOD]), "$RATTM,01,2.00,90.0,T,0,0,T,0,0,N,,T,,120000,A\n" * 40])
def test_text_in_another_encoding_is_named(tmp_path, encoding, text):
    path = tmp_path / "p.csv"
    path.write_bytes(text.encode(encoding))
    with pytest.raises(PlotFormatError, match=rf"p\.csv is text in {encoding[:6].upper()}; save it in UTF-8"):
        read_plots(path)


def test_a_missing_file_is_an_input_error(tmp_path):
    with pytest.raises(SourceError, match=r"none\.csv"):
        read_plots(tmp_path / "none.csv")
    with pytest.raises(SourceError):
        read_plots(tmp_path)


def test_two_columns_of_one_name_are_refused(tmp_path):
    path = write(tmp_path / "p.csv", "0,0,1,1,2", header="scan,time_s,range_m,azimuth_deg,range_m")
    with pytest.raises(PlotFormatError, match="two columns 'range_m'"):
        read_plots(path)
