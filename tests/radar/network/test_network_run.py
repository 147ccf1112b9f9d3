"""Runs over several radars: one picture, its files, and its errors."""

import csv
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from asterix_records import block, mark, plot, track
from click.testing import CliRunner

import vidtrack as vt
from vidtrack.cli import cli
from vidtrack.config.load import load
from vidtrack.formats import read, read_states
from vidtrack.radar.network.feed import read_feeds, warn_if_apart
from vidtrack.radar.network.network import Network
from vidtrack.radar.network.radars import read_radars
from vidtrack.run.fuse import common_plane, run_fusion
from vidtrack.run.network import AHEAD_S, build_network_tracker, learn_ahead, run_network
from vidtrack.score import evaluate
from vidtrack.simulate.radar_network import NORTH, simulate_network, write_network


def finished(folder, names, out, toml="radars.toml", origin=None):
    paths = [str(folder / f"{name}.csv") for name in names]
    settings = load()
    settings = settings.model_copy(update={"radar": settings.radar.model_copy(update={"geodetic": origin})})
    with run_network(paths, folder / toml, settings, folder / out) as run:
        for _ in run:
            pass
    return folder / out


@pytest.fixture(scope="module")
def biased(tmp_path_factory):
    folder = tmp_path_factory.mktemp("biased")
    write_network(simulate_network(500), folder)
    finished(folder, ["north", "south"], "run")
    return folder


def distances(folder, run):
    """Distances of true positions to the nearest tracks, by scan (K, targets)."""
    result, truth = read(run), read(folder / "truth.csv")
    found = []
    for scan in range(30, truth.frame.max() + 1):
        at, there = result.xy[result.frame == scan], truth.xy[truth.frame == scan][:, :2]
        found.append(np.linalg.norm(there[:, None] - at[None], axis=-1).min(axis=1))
    return np.array(found)


def test_one_degree_of_bias_leaves_one_track_a_target(biased):
    assert len(np.unique(read(biased / "run").id)) == 2
    assert np.sqrt((distances(biased, biased / "run") ** 2).mean()) < 120
    found = json.loads((biased / "run" / "summary.json").read_text())["radars"]
    off = found["south"]["bias_azimuth_deg"] - 1.0
    assert abs(off) < 3.5 * found["south"]["bias_azimuth_sigma_deg"]
    assert found["south"]["bias_azimuth_sigma_deg"] < 0.15
    assert found["south"]["bias_azimuth_observed"] is True
    rows = list(csv.DictReader((biased / "run" / "registration.csv").open()))
    assert len(rows) == 2 * 120
    assert float(rows[0]["bias_azimuth_sigma_deg"]) < 0.2  # learnt ahead of the first scan
    sigma = [float(row["bias_azimuth_sigma_deg"]) for row in rows if row["radar"] == "south"]
    assert sigma[0] == sigma[29] > sigma[-1]  # what was learnt ahead is not learnt again


@pytest.mark.parametrize(("south_y_m", "told"), [(-15000.0, False), (15000.0, True)])
def test_radars_at_wrong_places_learn_no_bias_and_this_is_said(biased, caplog, south_y_m, told):
    text = (biased / "radars.toml").read_text()
    (biased / "moved.toml").write_text(text.replace("y_m = -15000.0", f"y_m = {south_y_m}"))
    finished(biased, ["north", "south"], f"moved-{told}", "moved.toml")
    assert ("hardly any target of two radars told their biases" in caplog.text) is told


def test_only_the_first_minute_is_learnt_ahead(biased):
    paths = [str(biased / "north.csv"), str(biased / "south.csv")]
    network = Network(read_feeds(paths, read_radars(biased / "radars.toml"), load().radar))
    assert network.registration.observed()[:, 1].sum() == 0
    learn_ahead(load(), network)
    bias, used = network.registration.bias.copy(), network.registration.used
    assert used > 0
    turns = list(network)
    first = turns[0].span.t
    tracker = build_network_tracker(load(), network)
    for turn in turns:
        network.learn(turn, tracker.step(network.scan(turn)))
        if turn.span.t <= first + AHEAD_S:
            np.testing.assert_array_equal(network.registration.bias, bias)
    assert network.registration.used > used


def test_a_known_bias_of_none_is_not_estimated(biased):
    text = (biased / "radars.toml").read_text().replace("scan_s", "bias_range_m = 0\nbias_azimuth_deg = 0\nscan_s")
    (biased / "known.toml").write_text(text)
    network = Network(read_feeds([str(biased / "north.csv"), str(biased / "south.csv")],
                                 read_radars(biased / "known.toml"), load().radar))  # fmt: skip
    turns = list(network)
    assert [turn.station for turn in turns[:4]] == [0, 1, 0, 1]
    assert np.all(np.diff([turn.span.t for turn in turns]) > 0)
    assert len(turns) == network.count == 120
    feed = network.feeds[1]
    np.testing.assert_array_equal(network.scan(turns[1]).z, feed.found.z[turns[1].span.rows])


def test_a_clock_that_is_not_expected_to_be_off_is_not_estimated(biased):
    rows = list(csv.DictReader((biased / "run" / "registration.csv").open()))
    assert {(row["bias_time_s"], row["bias_time_sigma_s"]) for row in rows} == {("0", "0")}


def test_a_clock_that_is_off_unexpectedly_is_named(biased, tmp_path, caplog):
    for name in ("north.csv", "south.csv", "radars.toml"):
        (tmp_path / name).write_text((biased / name).read_text())
    changed(tmp_path / "south.csv", lambda row: {"time_s": float(row["time_s"]) + 1.0})
    finished(tmp_path, ["north", "south"], "late")
    off_s, of = re.search(r"the clock of south seems to be (.*) s ahead of that of (\w+)", caplog.text).groups()
    assert (float(off_s), of) == (pytest.approx(1.0, abs=0.3), "north")
    south = json.loads((tmp_path / "late" / "summary.json").read_text())["radars"]["south"]
    for name, true in (("time_s", 1.0), ("azimuth_deg", 1.0), ("range_m", 0.0)):
        assert abs(south[f"bias_{name}"] - true) < 3.5 * south[f"bias_{name.replace('_', '_sigma_')}"]
    assert abs(south["bias_time_s"] - 1.0) < 0.2


def test_of_one_radar_no_bias_is_told(biased):
    alone = finished(biased, ["north"], "only-north")
    assert not [name for name in json.loads((alone / "summary.json").read_text())["radars"]["north"] if "bias" in name]
    header, *rows = csv.reader((alone / "registration.csv").open())
    assert header == ["scan", "time_s", "radar"]
    assert {(len(row), row[2]) for row in rows} == {(3, "north")}


def test_what_nothing_tells_of_biases_is_in_the_errors_of_tracks(biased, monkeypatch):
    """Both radars measure one degree too much; at one place they cannot tell each other."""
    monkeypatch.setattr(
        "vidtrack.simulate.radar_network.RADARS", {"north": NORTH, "south": replace(NORTH, start_s=1.7)}
    )
    there = biased / "one-place"
    there.mkdir()
    write_network(simulate_network(501, bias=(0.0, 0.0, 0.0)), there)
    for name in ("north", "south"):
        changed(there / f"{name}.csv", lambda row: {"azimuth_deg": (float(row["azimuth_deg"]) + 1.0) % 360})
    run = finished(there, ["north", "south"], "run")
    assert (
        0.3 < evaluate(read(run), read(there / "truth.csv"), max_distance=3000.0, states=read_states(run))["nees"] < 4
    )
    radars = json.loads((run / "summary.json").read_text())["radars"]
    assert not any(own["bias_azimuth_observed"] for own in radars.values())


def changed(table, change):
    """Write a table of plots again, with `change` of each row."""
    rows = list(csv.DictReader(table.open()))
    with table.open("w") as file:
        written = csv.DictWriter(file, rows[0])
        written.writeheader()
        written.writerows(row | change(row) for row in rows)


def test_tracks_that_a_bias_keeps_apart_are_told_of(biased, tmp_path, caplog):
    """One degree at 15 to 30 km; test_runs_of_two_radars_are_fused has none."""
    runs = [finished(biased, [name], f"alone-{name}") for name in ("north", "south")]
    with run_fusion(runs, tmp_path / "both") as run:
        for _ in run:
            pass
    assert "move as one target does" in caplog.text


def test_runs_of_two_radars_are_fused(tmp_path, caplog):
    write_network(simulate_network(500, bias=(0.0, 0.0, 0.0)), tmp_path)
    origin = (50.0, 8.0, 100.0)
    runs = [finished(tmp_path, [name], f"run-{name}", origin=origin) for name in ("north", "south")]
    with run_fusion(runs, tmp_path / "both") as run:
        for _ in run:
            pass
    result = read(tmp_path / "both")
    assert json.loads((tmp_path / "both" / "summary.json").read_text())["origin"] == [50.0, 8.0, 100.0]
    assert len(np.unique(result.id)) == 2
    assert "as one target does" not in caplog.text
    alone = [np.sqrt(np.median(distances_at(tmp_path, run) ** 2)) for run in runs]
    assert np.sqrt(np.median(distances_at(tmp_path, tmp_path / "both") ** 2)) < max(alone)


def distances_at(folder, run):
    """Distances of tracks to the nearest true position at their time, after a minute."""
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    rows = np.genfromtxt(run / "tracks.csv", delimiter=",", names=True, dtype=None, encoding=None)
    found = []
    for row in rows[rows["time_s"] > 60]:
        now = truth[np.abs(truth["time_s"] - row["time_s"]) < 1e-3]
        found.append(np.hypot(now["x_m"] - row["x_m"], now["y_m"] - row["y_m"]).min())
    return np.array(found)


@pytest.mark.parametrize(
    ("origins", "message"),
    [
        (([50.0, 8.0, 0.0], [50.1, 8.0, 0.0]), "north has its origin at 50.000000,8.000000, .*south at 50.100000,8.00"),
        (([50.0, 8.0, 0.0], None), "south at an unknown place"),
    ],
)
def test_runs_with_different_origins_are_not_fused(tmp_path, origins, message):
    folders = [tmp_path / "north", tmp_path / "south"]
    for folder, origin in zip(folders, origins, strict=True):
        folder.mkdir()
        (folder / "summary.json").write_text(json.dumps({} if origin is None else {"origin": origin}))
    with pytest.raises(vt.ConfigError, match=message):
        common_plane(folders)
    assert common_plane(folders[:1] * 2).latitude == 50.0


@pytest.mark.parametrize(
    ("arguments", "message", "code"),
    [
        (["radar", "north.csv", "south.csv"], "2 tables of plots need --radars", 2),
        (["radar", "nowhere.csv", "--radars", "radars.toml"], "no radar 'nowhere'", 2),
        (["radar", "north.csv", "north.csv", "--radars", "radars.toml"], "two files have plots of radar 'north'", 2),
        (["radar", "north.csv", "south.csv", "--radars", "radars.toml", "--estimator", "alpha-beta"], "one gain", 2),
        (["radar", "north.csv", "--radars", "earth.toml", "--radar-position", "50,8"], "leave one of them out", 2),
        (["fuse", "run"], "two runs or more", 2),
        (["fuse", "run", "nowhere"], "nowhere holds no tracks.parquet", 3),
    ],
)
def test_what_cannot_be_right_is_refused(biased, monkeypatch, arguments, message, code):
    monkeypatch.chdir(biased)
    (biased / "earth.toml").write_text("[radars.north]\nlatitude = 50\nlongitude = 8\n")
    result = CliRunner().invoke(cli, [*arguments, "-o", "refused"])
    said = f"{result.output}{result.exception}"
    assert message in said
    error = result.exception
    assert (error.exit_code if isinstance(error, vt.Error) else error.code) == code
    assert not (biased / "refused").exists()


@pytest.fixture(scope="module")
def sites(tmp_path_factory):
    """A recording of two radars that take turns, the same in a file for each, and radars.toml."""
    folder = tmp_path_factory.mktemp("sites")
    blocks: dict[str, list[bytes]] = {"a": [], "b": []}
    for k in range(8):
        for name, sic in (("a", 201), ("b", 202)):
            radar, begin_s = (("SAC", 25), ("SIC", sic)), 100.0 + 4 * k + (sic - 201)
            blocks[name].append(mark(begin_s, turn_s=4.0, radar=radar))
            blocks[name].append(block(plot(begin_s + 0.5, 20000 + sic + 200 * (sic - 201) + 400 * k, 45.0, radar)))
    (folder / "both.ast").write_bytes(b"".join(one + two for one, two in zip(blocks["a"], blocks["b"], strict=True)))
    for name, own in blocks.items():
        (folder / f"{name}.ast").write_bytes(b"".join(own))
    (folder / "radars.toml").write_text(
        "[radars.b]\nx_m = 900\ny_m = 0\nboresight_deg = 10\nsac = 25\nsic = 202\n"
        "[radars.a]\nx_m = 0\ny_m = 0\nsac = 25\nsic = 201\n"
    )
    return folder


def test_a_recording_of_two_radars_is_split_by_their_codes(sites, caplog):
    radars = read_radars(sites / "radars.toml")
    split = read_feeds([str(sites / "both.ast")], radars, load().radar)
    alone = read_feeds([str(sites / "a.ast"), str(sites / "b.ast")], radars, load().radar)
    assert [feed.placed.name for feed in split] == ["a", "b"]
    for one, other in zip(split, alone, strict=True):
        np.testing.assert_array_equal(one.plots.z, other.plots.z)
        np.testing.assert_array_equal(one.plots.time_s, other.plots.time_s)
        assert one.plots.scan.tolist() == list(range(8))
    np.testing.assert_allclose(np.degrees([split[0].plots.z[0, 1], split[1].plots.z[0, 1]]), [45, 55], atol=0.01)
    assert split[1].found.z[0] == pytest.approx(
        [900 + 20402 * np.sin(np.radians(55)), 20402 * np.cos(np.radians(55))], abs=5
    )
    assert "not" not in "".join(one for one in caplog.messages if "tracked are" in one)


@pytest.mark.parametrize("turns", [1, 2])
def test_a_radar_with_few_plots_in_a_recording_is_one_of_it(sites, turns):
    own = sites / "few.ast"
    radar = [(("SAC", 25), ("SIC", sic)) for sic in (201, 202)]
    blocks = [block(plot(100 + 0.1 * k, 20000 + 40 * k, 9.0 * k % 360, radar[0])) for k in range(400)]
    some = [block(plot(101.0 + 4 * k, 30000, 45.0, radar[1])) for k in range(turns)]
    own.write_bytes(b"".join([mark(100.0, turn_s=4.0, radar=radar[0]), *some, *blocks]))
    feeds = read_feeds([str(own)], read_radars(sites / "radars.toml"), load().radar)
    assert [(feed.placed.name, len(feed.plots)) for feed in feeds] == [("a", 400), ("b", turns)]
    assert [feed.plots.losses["damaged"] for feed in feeds] == [0, 0]


def test_the_plots_of_one_radar_are_not_those_of_two(biased, sites):
    (biased / "copy.csv").write_bytes((biased / "south.csv").read_bytes())
    toml = (biased / "radars.toml").read_text() + "[radars.copy]\nx_m = 100\ny_m = 50\nboresight_deg = 7\n"
    (biased / "copies.toml").write_text(toml)
    paths = [str(biased / f"{name}.csv") for name in ("north", "south", "copy")]
    with pytest.raises(vt.ConfigError, match=r"'south' and 'copy' have the same plots .* one radar; leave one of them"):
        read_feeds(paths, read_radars(biased / "copies.toml"), load().radar)
    (sites / "echo.ast").write_bytes((sites / "a.ast").read_bytes())
    (sites / "echo.toml").write_text("[radars.a]\nx_m = 0\ny_m = 0\n[radars.echo]\nx_m = 0\ny_m = 0\n")
    with pytest.raises(vt.ConfigError, match=r"same plots \(8 of 8\)"):
        read_feeds(
            [str(sites / f"{name}.ast") for name in ("a", "echo")], read_radars(sites / "echo.toml"), load().radar
        )


def south_again(folder, change):
    """A radar `again` at the place of `south`, whose plots are changed by change(time_s, range_m, azimuth_deg)."""
    with (folder / "south.csv").open() as file:
        rows = list(csv.DictReader(file))
    changed = change(*(np.array([float(row[name]) for row in rows]) for name in ("time_s", "range_m", "azimuth_deg")))
    with (folder / "again.csv").open("w") as file:
        file.write("scan,time_s,range_m,azimuth_deg,sigma_range_m,sigma_azimuth_deg\n")
        for row, t, r, a in zip(rows, *map(np.ndarray.tolist, changed), strict=True):
            file.write(f"{row['scan']},{t!r},{r!r},{a!r},40,0.3\n")
    (folder / "again.toml").write_text(
        "".join(f"[radars.{name}]\nx_m = 0\ny_m = -15000\n" for name in ("south", "again"))
    )
    return read_feeds(
        [str(folder / f"{name}.csv") for name in ("south", "again")], read_radars(folder / "again.toml"), load().radar
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t, r, a: (t, r.round(0), a.round(2)), ""),
        (lambda t, r, a: (t, r + 0.01, a), ""),
        (lambda t, r, a: (t + 0.5, r, a), ", 0.5 s later"),
        (lambda t, r, a: (t - 10, r.round(0), a.round(2)), ", 10 s earlier"),
        (lambda t, r, a: (t.round(1), r / 1852 * 256 // 1 / 256 * 1852, a), ""),
    ],
)
def test_a_copy_in_other_digits_or_with_a_delay_is_no_other_radar(biased, change, said):
    with pytest.raises(vt.ConfigError, match=rf"'south' and 'again' have the same plots \(\d+ of \d+{said}\)"):
        south_again(biased, change)


@pytest.mark.parametrize("later_s", [0.0, 0.5])
def test_two_radars_at_one_place_are_two(biased, later_s):
    rng = np.random.default_rng(3)
    both = np.sqrt(2) * rng.normal(size=(2, 100000))

    def independent(t, r, a):
        return t + later_s, np.abs(r + 40 * both[0, : len(r)]), (a + 0.3 * both[1, : len(a)]) % 360

    assert [feed.placed.name for feed in south_again(biased, independent)] == ["south", "again"]


def in_cells(folder, detected, moved_m):
    """Two radars at one place that see one target in cells of 150 m and 1.5 degrees, which moves by so much a scan."""
    rng = np.random.default_rng(4)
    for name in ("one", "other"):
        seen = np.flatnonzero(rng.random(60) < detected)
        rows = [f"{k},{4 * k},{(10000 + moved_m * k) // 150 * 150},45,50,0.5" for k in seen]
        header = "scan,time_s,range_m,azimuth_deg,sigma_range_m,sigma_azimuth_deg"
        (folder / f"{name}.csv").write_text("\n".join([header, *rows]) + "\n")
    (folder / "cells.toml").write_text("".join(f"[radars.{name}]\nx_m = 0\ny_m = 0\n" for name in ("one", "other")))
    paths = [str(folder / f"{name}.csv") for name in ("one", "other")]
    return read_feeds(paths, read_radars(folder / "cells.toml"), load().radar)


@pytest.mark.parametrize("detected", [1.0, 0.9, 0.6])
def test_one_target_that_stands_in_a_cell_does_not_make_two_radars_one(tmp_path, detected):
    assert len(in_cells(tmp_path, detected, 0.0)) == 2


def test_a_target_that_moves_from_cell_to_cell_tells_that_two_radars_are_one(tmp_path):
    with pytest.raises(vt.ConfigError, match="same plots"):
        in_cells(tmp_path, 1.0, 200.0)


def placed(folder, begins_s, places_m):
    """Feeds of radars 'a', 'b', ..., from so many seconds on, at so many metres east, up to 30 km, with 10 plots."""
    names = "abc"[: len(begins_s)]
    for n, (name, begin) in enumerate(zip(names, begins_s, strict=True)):
        rows = [f"{k},{begin + 4 * k},{10000 + 500 * k + n},{30 * k + n},50,0.5" for k in range(10)]
        header = "scan,time_s,range_m,azimuth_deg,sigma_range_m,sigma_azimuth_deg"
        (folder / f"{name}.csv").write_text("\n".join([header, *rows]) + "\n")
    toml = "".join(
        f"[radars.{name}]\nx_m = {x}\ny_m = 0\nfarthest_m = 30000\n" for name, x in zip(names, places_m, strict=True)
    )
    (folder / "placed.toml").write_text(toml)
    return read_feeds([str(folder / f"{n}.csv") for n in names], read_radars(folder / "placed.toml"), load().radar)


@pytest.mark.parametrize(
    ("begins_s", "places_m", "shown", "said"),
    [
        ((0, 10), (0, 20000), (), ""),
        ((0, 30, 60), (0, 0, 0), (), ""),  # each meets the next
        ((0, 0, 0), (0, 35000, 70000), (), ""),
        ((0, 50), (0, 20000), (), ""),  # as near as a track coasts
        ((0, 0), (0, 50000), (), "radars 'a', 'b' with no place in common"),
        ((0, 60), (0, 20000), (), "radars 'a', 'b' with no time in common"),
        ((0, 10), (0, 200000), (0, 1), ""),  # a camera may join them
        ((0, 10), (0, 200000), (0,), "radar 'b' with no place in common"),
        ((0, 5000), (0, 20000), (), "radars 'a', 'b' with no time in common with another radar (a has 0 to 36 s; b"),
        ((0, 5000, 10), (0, 20000, 0), (), "radar 'b' with no time in common"),
        ((0, 10), (0, 200000), (), "radars 'a', 'b' with no place in common"),
        ((0, 10, 0), (0, 0, 200000), (), "radar 'c' with no place in common"),
    ],
)
def test_radars_that_never_meet_are_named(tmp_path, caplog, begins_s, places_m, shown, said):
    warn_if_apart(placed(tmp_path, begins_s, places_m), shown)
    assert len(caplog.messages) == (said != "")
    assert said in caplog.text


@pytest.mark.parametrize(("nearest_m", "told"), [(10, False), (900, False), (3000, True)])
def test_radars_back_to_back_meet_where_a_track_coasts_from_one_to_the_other(tmp_path, caplog, nearest_m, told):
    header = "scan,time_s,range_m,azimuth_deg,sigma_range_m,sigma_azimuth_deg"
    for n, name in enumerate("ab"):
        rows = [f"{k},{k},{nearest_m + 40 * k + n},{3 * n},1,0.5" for k in range(10)]
        (tmp_path / f"{name}.csv").write_text("\n".join([header, *rows]) + "\n")
    mast = "[radars.{}]\nx_m = 0\ny_m = 0\nboresight_deg = {}\nsector_deg = 60\n"
    (tmp_path / "mast.toml").write_text(mast.format("a", 0) + mast.format("b", 180))
    paths = [str(tmp_path / f"{name}.csv") for name in "ab"]
    warn_if_apart(read_feeds(paths, read_radars(tmp_path / "mast.toml"), load().radar))
    assert ("no place in common" in caplog.text) is told


def test_a_radar_in_a_recording_that_has_no_table_is_named(sites):
    (sites / "one.toml").write_text("[radars.a]\nx_m = 0\ny_m = 0\nsac = 25\nsic = 201\n")
    with pytest.raises(vt.ConfigError, match="no radar with sac = 25 and sic = 202"):
        read_feeds([str(sites / "both.ast")], read_radars(sites / "one.toml"), load().radar)
    (feed,) = read_feeds([str(sites / "a.ast")], read_radars(sites / "one.toml"), load().radar)
    assert len(feed.plots) == 8


def test_the_time_of_a_scan_needs_a_recording_whose_radar_does_not_have_it(sites, biased):
    radars = read_radars(sites / "radars.toml")
    (feed,) = read_feeds([str(sites / "a.ast")], radars, load(assignments=["radar.scan_s=4"]).radar)
    assert len(feed.plots) == 8
    with pytest.raises(vt.ConfigError, match=r"radar.scan_s has no effect here"):
        read_feeds([str(biased / "north.csv")], read_radars(biased / "radars.toml"),
                   load(assignments=["radar.scan_s=4"]).radar)  # fmt: skip


def test_positions_are_no_plots_of_a_radar(sites):
    (sites / "c.ast").write_bytes(b"".join(track(100.0 + 4 * k, 50.0, 8.0, 1) for k in range(6)))
    (sites / "c.toml").write_text("[radars.c]\nlatitude = 50\nlongitude = 8\n")
    with pytest.raises(vt.ConfigError, match="needs ranges and azimuths"):
        read_feeds([str(sites / "c.ast")], read_radars(sites / "c.toml"), load().radar)
