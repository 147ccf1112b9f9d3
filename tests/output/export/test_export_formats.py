"""What is in the files, read back without vidtrack."""

import csv
import json
import struct
from datetime import UTC, datetime, timedelta
from xml.etree import ElementTree

import numpy as np
import pyarrow.parquet as pq
import pyproj
import pytest
from road_runs import EAST, FPS, NORTH, SITE, hide, usual_ways, way, write_run

from vidtrack.errors import ConfigError
from vidtrack.output.export import road_run
from vidtrack.output.export.registry import FORMATS, export
from vidtrack.output.export.road_run import open_road_run

START = datetime(2026, 6, 1, 5, tzinfo=UTC)
TO_METRES = pyproj.Transformer.from_crs(4326, 25832, always_xy=True)


@pytest.fixture
def run(tmp_path):
    return open_road_run(write_run(tmp_path, *usual_ways()))


@pytest.fixture
def expected():
    """{(track, frame): row} of all positions that are to be exported."""
    rows = {}
    for vehicle in usual_ways():
        for i, frame in enumerate(vehicle["frame"].tolist()):
            row = {name: values[i] for name, values in vehicle.items()}
            guessed_for_good = row["track_id"] == 9 and frame > 60
            if np.isfinite(row["x_m"]) and not guessed_for_good:
                rows[row["track_id"], frame] = row
    return rows


def metres(lonlat):
    return np.column_stack(TO_METRES.transform(*np.array(lonlat).T))


def test_geojson_has_a_line_for_each_piece(run, tmp_path, expected):
    export(run, "geojson", tmp_path)
    features = json.loads((tmp_path / "tracks.geojson").read_text())["features"]
    assert {feature["id"] for feature in features} == {"7", "7.2", "9"}  # 11 was seen once: no line
    found = {}
    for feature in features:
        assert feature["geometry"]["type"] == "LineString"
        about = feature["properties"]
        assert datetime.fromisoformat(about["start"]) == START
        for xy, t, speed in zip(
            metres(feature["geometry"]["coordinates"]), about["time_s"], about["speed_kmh"], strict=True
        ):
            found[about["track_id"], round(FPS * t)] = (*xy, t, speed)
    assert found.keys() == {key for key in expected if key[0] != 11}
    for key, values in found.items():
        row = expected[key]
        assert values[:2] == pytest.approx((row["x_m"], row["y_m"]), abs=2e-3)
        assert values[2:] == pytest.approx((row["time_s"], row["speed_kmh"]), rel=1e-6)


def test_moving_features_have_dates(run, tmp_path, expected):
    export(run, "mf-json", tmp_path)
    collection = json.loads((tmp_path / "tracks.mf.json").read_text())
    assert collection["type"] == "FeatureCollection"
    found = set()
    for feature in collection["features"]:
        path = feature["temporalGeometry"]
        assert path["type"] == "MovingPoint"
        (group,) = feature["temporalProperties"]
        assert group["datetimes"] == path["datetimes"]
        assert len(group["speed_kmh"]["values"]) == len(path["datetimes"])
        for text, xy in zip(path["datetimes"], metres(path["coordinates"]), strict=True):
            frame = round(FPS * ((datetime.fromisoformat(text) - START) / timedelta(seconds=1)))
            row = expected[feature["properties"]["track_id"], frame]
            assert xy == pytest.approx((row["x_m"], row["y_m"]), abs=2e-3)
            found.add((row["track_id"], frame))
    assert found == {key for key in expected if key[0] != 11}


def test_geoparquet_has_every_column_and_points(run, tmp_path, expected):
    export(run, "geoparquet", tmp_path)
    table = pq.read_table(tmp_path / "tracks.geo.parquet")
    about = json.loads(table.schema.metadata[b"geo"])
    assert about["version"] == "1.1.0"
    column = about["columns"][about["primary_column"]]
    assert column["encoding"] == "WKB"
    assert pyproj.CRS.from_json_dict(column["crs"]).to_epsg() == 25832
    rows = table.to_pylist()
    assert {(row["track_id"], row["frame"]) for row in rows} == expected.keys()
    for row in rows:
        order, kind, x, y = struct.unpack("<BIdd", row["geometry"])
        assert (order, kind) == (1, 1)
        truth = expected[row["track_id"], row["frame"]]
        assert (x, y) == (row["x_m"], row["y_m"]) == (truth["x_m"], truth["y_m"])
        assert row["class"] == ("truck" if row["track_id"] == 9 else "car")
        assert row["time_utc"] == START + timedelta(microseconds=round(1e6 * row["time_s"]))
    assert table.schema.field("x_m").metadata[b"unit"] == b"m"


def test_geoparquet_without_a_map_says_that_it_has_none(tmp_path):
    run = open_road_run(write_run(tmp_path, way(1, range(5)), site=SITE.replace("epsg = 25832", "")))
    export(run, "geoparquet", tmp_path)
    about = json.loads(pq.read_schema(tmp_path / "tracks.geo.parquet").metadata[b"geo"])
    assert about["columns"]["geometry"]["crs"] is None  # not absent: that would mean WGS84


def read_csv(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_level_x_counts_angles_from_east_and_frames_without_a_gap(run, tmp_path, expected):
    export(run, "level-x", tmp_path)
    tracks, meta, (recording,) = (
        read_csv(tmp_path / f"00_{name}.csv") for name in ("tracks", "tracksMeta", "recordingMeta")
    )
    assert float(recording["frameRate"]) == FPS
    assert int(recording["numTracks"]) == len(meta) == 4
    assert (recording["weekday"], recording["startTime"]) == ("monday", "07:00")
    assert float(recording["lonLocation"]) == pytest.approx(
        TO_METRES.transform(EAST, NORTH, direction="INVERSE")[0], abs=1e-3
    )
    names = {row["trackId"]: (int(row["vidtrackId"]), int(row["vidtrackPiece"])) for row in meta}
    assert sorted(names.values()) == [(7, 1), (7, 2), (9, 1), (11, 1)]
    assert {row["class"] for row in meta} == {"car", "truck"}
    found = set()
    for about in meta:
        rows = [row for row in tracks if row["trackId"] == about["trackId"]]
        first = int(about["initialFrame"])
        assert [int(row["frame"]) for row in rows] == list(range(first, int(about["finalFrame"]) + 1))
        assert [int(row["trackLifetime"]) for row in rows] == list(range(int(about["numFrames"])))
        for row in rows:
            key = names[row["trackId"]][0], int(row["frame"])
            truth = expected[key]
            found.add(key)
            assert float(row["xCenter"]) == pytest.approx(truth["x_m"], rel=1e-9)
            assert float(row["yCenter"]) == pytest.approx(truth["y_m"], rel=1e-9)
            if np.isnan(truth["heading_deg"]):
                assert row["heading"] == row["xVelocity"] == row["length"] == ""
                continue
            assert float(row["heading"]) == pytest.approx((90 - truth["heading_deg"]) % 360, abs=1e-4)
            toward = np.radians(float(row["heading"]))
            velocity = float(row["xVelocity"]), float(row["yVelocity"])
            assert velocity == pytest.approx((10 * np.cos(toward), 10 * np.sin(toward)), abs=1e-4)
            assert row["xAcceleration"] == ""
    assert found == expected.keys()


def level_x_meta(folder, *ways, **more):
    """The second table of level-X by vidtrack's number of the track."""
    run = open_road_run(write_run(folder, *ways, **more))
    export(run, "level-x", folder)
    return {int(row["vidtrackId"]): row for row in read_csv(folder / "00_tracksMeta.csv")}


def test_level_x_has_the_words_of_its_readers_and_vidtrack_s_beside(tmp_path):
    """Tactics2D ends at another word."""
    site = SITE[: SITE.index("[classes]")] + "[classes]\nlorry = [9, 12]\nCar = [4, 5]\nPkw = [5, 6.5]\n"
    ways = [way(k, range(5), length=length) for k, length in enumerate([10.5, 4.5, 5.7, 4.05, 2.1, 0.6, 14.0])]
    meta = level_x_meta(tmp_path, *ways, site=site)
    assert [meta[k]["vidtrackClass"] for k in range(7)] == ["lorry", "Car", "Pkw", *["unknown"] * 4]
    assert [meta[k]["class"] for k in range(7)] == ["truck", "car", "car", "car", "bicycle", "pedestrian", "truck_bus"]


def test_level_x_has_the_words_of_its_readers_without_classes_of_the_site(tmp_path):
    ways = way(1, range(5), length=16.0), way(2, range(5), length=2.0), way(3, range(5), length=0.4)
    meta = level_x_meta(tmp_path, *ways, site=SITE[: SITE.index("[classes]")])
    assert [meta[k]["class"] for k in (1, 2, 3)] == ["truck_bus", "bicycle", "pedestrian"]


def test_level_x_has_a_usual_size_where_a_track_shows_none(tmp_path):
    """Tactics2D cannot make a vehicle without a size."""
    hidden = hide(way(1, range(5)), range(5), "length_m", "length_sigma_m", "width_m")
    about = level_x_meta(tmp_path, hidden)[1]
    assert (about["class"], about["vidtrackClass"]) == ("car", "unknown")
    assert (float(about["length"]), float(about["width"])) == (4.3, 1.75)
    assert {row["length"] for row in read_csv(tmp_path / "00_tracks.csv")} == {""}


def test_sumo_has_front_bumpers_by_time(run, tmp_path, expected):
    export(run, "sumo", tmp_path)
    root = ElementTree.parse(tmp_path / "fcd.xml").getroot()
    assert root.tag == "fcd-export"
    times = [float(step.get("time")) for step in root]
    assert times == sorted(set(times))
    found = set()
    for step in root:
        assert len(step) > 0
        for vehicle in step:
            key = int(vehicle.get("id")), round(FPS * float(step.get("time")))
            truth = expected[key]
            found.add(key)
            angle = np.radians(float(vehicle.get("angle")))
            front = np.array([float(vehicle.get("x")), float(vehicle.get("y"))])
            middle = front - truth["length_m"] / 2 * np.array([np.sin(angle), np.cos(angle)])
            assert middle == pytest.approx((truth["x_m"], truth["y_m"]), abs=2e-3)
            assert float(vehicle.get("angle")) == pytest.approx(truth["heading_deg"], abs=0.01)
            assert float(vehicle.get("speed")) == pytest.approx(10, abs=1e-3)
            assert vehicle.get("type") == ("truck" if key[0] == 9 else "car")
    assert found == {key for key, row in expected.items() if np.isfinite(row["length_m"])}


def read_trj(path):
    """The records of a .trj as SSAM 3 reads them: byte by byte, heights only in later versions than 1.04."""
    data, at = path.read_bytes(), 0

    def take(form):
        nonlocal at
        values = struct.unpack_from("<" + form, data, at)
        at += struct.calcsize("<" + form)
        return values if len(values) > 1 else values[0]

    assert (take("b"), take("c")) == (0, b"L")
    version = take("f")
    assert version == np.float32(1.04) <= 1.04  # SSAM compares it with 1.04 in double precision
    assert take("b") == 1
    units, scale, low_x, low_y, high_x, high_y = take("bfiiii")
    assert (units, scale) == (1, 1.0)
    assert low_x < high_x
    assert low_y < high_y
    vehicles, now = [], None
    while at < len(data):
        kind = take("b")
        if kind == 2:
            later = take("f")
            assert now is None or later > now
            now = later
        else:
            assert kind == 3
            record = take("iib8f")
            middle = (np.array(record[3:5]) + np.array(record[5:7])) / 2
            assert low_x <= middle[0] <= high_x  # others are skipped by SSAM
            assert low_y <= middle[1] <= high_y
            vehicles.append((now, *record))
    return vehicles


def test_ssam_has_fronts_and_rears_from_a_near_origin(run, tmp_path, expected):
    export(run, "ssam", tmp_path)
    origin = json.loads((tmp_path / "origin.json").read_text())
    found = set()
    for time, vehicle, link, lane, fx, fy, rx, ry, length, width, speed, acceleration in read_trj(
        tmp_path / "tracks.trj"
    ):
        key = vehicle, round(FPS * time)
        truth = expected[key]
        found.add(key)
        assert (link, lane, acceleration) == (0, 0, 0)  # not known
        middle = ((fx + rx) / 2 + origin["x_m"], (fy + ry) / 2 + origin["y_m"])
        assert middle == pytest.approx((truth["x_m"], truth["y_m"]), abs=1e-3)  # 5,800 km north of the equator
        assert np.hypot(fx - rx, fy - ry) == pytest.approx(length, rel=1e-5)
        assert length == pytest.approx(truth["length_m"])
        assert width == pytest.approx(truth["width_m"])
        assert speed == pytest.approx(10)
        assert np.degrees(np.arctan2(fx - rx, fy - ry)) % 360 == pytest.approx(truth["heading_deg"], abs=1e-3)
    assert found == {key for key, row in expected.items() if np.isfinite(row["length_m"])}


@pytest.mark.parametrize("name", [name for name, form in FORMATS.items() if not (form.measures or form.radar)])
@pytest.mark.parametrize("rows", [1, 7])
def test_the_size_of_a_batch_changes_nothing(run, tmp_path, monkeypatch, name, rows):
    for folder, size in (("whole", road_run._BATCH), ("small", rows)):
        monkeypatch.setattr(road_run, "_BATCH", size)
        (tmp_path / folder).mkdir()
        export(open_road_run(run.folder), name, tmp_path / folder)
    files = sorted(path.name for path in (tmp_path / "whole").iterdir())
    assert files
    for file in files:
        whole, small = (tmp_path / folder / file for folder in ("whole", "small"))
        if file.endswith(".parquet"):
            assert pq.read_table(whole).equals(pq.read_table(small))
        elif name in ("geojson", "mf-json", "level-x") and "recording" not in file:
            assert contents(whole) == contents(small)  # vehicles come in the order in which their ends are noticed
        else:
            assert whole.read_bytes() == small.read_bytes()


def contents(path):
    if path.suffix == ".json" or path.suffix == ".geojson":
        return sorted(json.loads(path.read_text())["features"], key=lambda feature: feature["id"])
    rows = [{key: value for key, value in row.items() if key != "trackId"} for row in read_csv(path)]
    return sorted(rows, key=str)


@pytest.mark.parametrize(
    ("name", "site", "words"),
    [
        ("geojson", SITE.replace("epsg = 25832", ""), "needs places on the globe"),
        ("mf-json", SITE.replace("epsg = 25832", ""), "needs places on the globe"),
        ("mf-json", SITE.replace("start = 2026-06-01T07:00:00+02:00", ""), "needs dates"),
    ],
)
def test_what_a_format_needs_is_asked_for(tmp_path, name, site, words):
    run = open_road_run(write_run(tmp_path, way(1, range(5)), site=site))
    with pytest.raises(ConfigError, match=words):
        export(run, name, tmp_path)
    assert not list(tmp_path.glob("*.new"))


def test_level_x_needs_a_frame_rate(tmp_path):
    run = open_road_run(write_run(tmp_path, way(1, range(5)), fps=None))
    with pytest.raises(ConfigError, match="frame rate"):
        export(run, "level-x", tmp_path)


def test_a_length_in_no_class_is_unknown(tmp_path):
    ways = way(1, range(3), length=2.0), way(2, range(3), length=6.5), way(3, range(3), length=20.0)
    assert open_road_run(write_run(tmp_path / "a", *ways)).vehicles.kind.tolist() == ["unknown", "truck", "unknown"]
    without = SITE[: SITE.index("[classes]")]
    edge = way(1, range(3), length=5.5)  # 0.1 m from the bounds, known to 0.3 m
    assert open_road_run(write_run(tmp_path / "c", edge)).vehicles.kind.tolist() == ["unknown"]
    assert open_road_run(write_run(tmp_path / "b", *ways, site=without)).vehicles.kind.tolist() == ["unknown"] * 3


def test_a_length_is_a_mean_by_certainty(tmp_path):
    rows = way(1, range(2))
    rows["length_m"][:], rows["length_sigma_m"][:] = [4, 8], [0.5, 1.0]
    (length,) = open_road_run(write_run(tmp_path, rows)).vehicles.length
    assert length == pytest.approx((4 * 4 + 8) / 5)


@pytest.mark.parametrize("moved", [0, 5800000])
def test_metres_of_a_point_of_ones_own_are_told(tmp_path, caplog, moved):
    text = SITE
    for north in (5800000, 5800060):
        text = text.replace(str(north), str(north - moved))
    export(open_road_run(write_run(tmp_path, *usual_ways(), site=text)), "geojson", tmp_path)
    assert ("latitude 0.00" in caplog.text) == (moved > 0)
