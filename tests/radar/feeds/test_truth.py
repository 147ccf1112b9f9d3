"""Truth from what targets say themselves."""

import json
import shutil

import numpy as np
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest
from asterix_records import layout, sweeps, track

from vidtrack import formats, score
from vidtrack.config.settings import Settings
from vidtrack.errors import FormatError
from vidtrack.radar.feeds.truth import read_truth
from vidtrack.radar.plane import Plane
from vidtrack.run.radar import run_plots

PLACE = (52.0, 13.0, 0.0)


def adsb(time_s, latitude, longitude, address):
    items = {
        "010": (("SAC", 1), ("SIC", 1)), "073": (time_s, "s"), "080": address,
        "131": (("LAT", (latitude, "°")), ("LON", (longitude, "°"))),
    }  # fmt: skip
    category = layout("Cat_021_2_7")
    return category.create([category.cv_record.create(items)]).unparse().to_bytes()


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A run of a radar over two aircraft that fly radially, and their ADS-B, a report each second and a half."""
    folder = tmp_path_factory.mktemp("truth")
    azimuth_deg, begin_s, turn_s, speed = np.array([30.0, 200.0]), 700.0, 4.0, 150.0
    scan = np.repeat(np.arange(12), 2)
    seen_s = turn_s * (scan + np.tile(azimuth_deg, 12) / 360)
    table = {"scan": scan, "range_m": 2e4 + speed * seen_s, "azimuth_deg": np.tile(azimuth_deg, 12)}
    (folder / "radar.ast").write_bytes(b"".join(sweeps(table, turn_s, begin_s)))
    reports = []
    for time_s in np.arange(-5, 60, 1.5):
        for address, azimuth in enumerate(np.radians(azimuth_deg), start=0xABC):
            place = (2e4 + speed * time_s) * np.array([[np.sin(azimuth), np.cos(azimuth)]])
            (latitude,), (longitude,) = Plane(*PLACE).degrees(place)
            reports.append(adsb(begin_s + time_s, latitude, longitude, address))
    (folder / "adsb.ast").write_bytes(b"".join(reports))
    for name, place in (("run", PLACE), ("lost", None)):
        settings = Settings().model_copy(update={"radar": Settings().radar.model_copy(update={"geodetic": place})})
        with run_plots(str(folder / "radar.ast"), settings, folder / name) as run:
            for _ in run:
                pass
    return folder


def test_aircraft_are_where_they_say(scene):
    truth = read_truth(scene / "adsb.ast", scene / "run")
    scores = score.evaluate(formats.read(scene / "run"), truth, max_distance=200)
    assert scores["truth_tracks"] == 2
    assert scores["idf1"] == 1
    assert scores["gospa_localisation"] < 60


def test_a_run_without_a_position_is_refused(scene):
    with pytest.raises(FormatError, match="track again with --radar-position"):
        read_truth(scene / "adsb.ast", scene / "lost")


def test_a_table_of_plots_has_the_place_that_its_settings_say(scene):
    shutil.copytree(scene / "run", scene / "table")
    summary = json.loads((scene / "run" / "summary.json").read_text())
    del summary["origin"]  # a table says none
    (scene / "table" / "summary.json").write_text(json.dumps(summary))
    np.testing.assert_array_equal(
        read_truth(scene / "adsb.ast", scene / "table").xy, read_truth(scene / "adsb.ast", scene / "run").xy
    )


@pytest.mark.parametrize("first", [0, 1, 100])
def test_scans_before_the_first_row_and_after_the_last_one_count(scene, first):
    name = f"from-{first}"
    shutil.copytree(scene / "run", scene / name)
    rows = pq.read_table(scene / "run" / "tracks.parquet")
    rows = rows.filter((pc.field("scan") > 2) & (pc.field("scan") < 9))
    rows = rows.set_column(rows.column_names.index("scan"), "scan", pc.add(rows["scan"], first))
    pq.write_table(rows, scene / name / "tracks.parquet")
    short, whole = (read_truth(scene / "adsb.ast", scene / run) for run in (name, "run"))
    np.testing.assert_array_equal(short.frame, whole.frame + first)
    np.testing.assert_allclose(short.xy, whole.xy, atol=1.0)


def test_another_time_is_refused(scene, tmp_path):
    (tmp_path / "late.ast").write_bytes(b"".join(track(5000.0 + k, 52.0, 13.0, 1) for k in range(5)))
    with pytest.raises(FormatError, match="no target at the time of"):
        read_truth(tmp_path / "late.ast", scene / "run")
