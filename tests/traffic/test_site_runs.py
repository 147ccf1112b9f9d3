"""Runs at a calibrated site: positions in metres and speeds in the tables, and `vidtrack calibrate`."""

import csv
import json
from dataclasses import replace
from xml.etree import ElementTree

import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest
from pinhole import HEIGHT, POINTS, WIDTH, Pinhole
from synthetic_steps import make_step

from vidtrack.arrays.affine import shift
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError, SourceError
from vidtrack.output.repair import repair
from vidtrack.output.tables import ROAD, VIDEO, track_rows
from vidtrack.run.live.part import Part, columns_of
from vidtrack.run.sinks import Subject
from vidtrack.traffic.measures.runs import site_of
from vidtrack.traffic.metres import footprints_of

CAMERA = Pinhole()
FPS = 25.0
SPEED, HEADING = 12.0, np.radians(20)
START = np.array([-6.0, 14.0])


def site_text(picture, ground=POINTS, more=""):
    return (
        f'[site]\nname = "road"\nwidth = {WIDTH}\nheight = {HEIGHT}\n[calibration]\n'
        f"picture = {np.asarray(picture).round(3).tolist()}\nground = {np.asarray(ground).tolist()}\n{more}"
    )


def where(t):
    """(2,) m; the car's true position."""
    return START + SPEED * t * np.array([np.sin(HEADING), np.cos(HEADING)])


@pytest.fixture
def road(tmp_path):
    """A folder with a site, and the boxes of a car that drives 2.4 s through its picture."""
    (tmp_path / "site.toml").write_text(site_text(CAMERA.picture(POINTS)))
    rows = []
    rng = np.random.default_rng(0)
    for frame in range(60):
        _, box = CAMERA.vehicle(where(frame / FPS), HEADING, 4.5, 1.8, 1.5)
        left, top, width, height = box + rng.normal(0, 0.3, 4)
        rows.append(f"{frame + 1},-1,{left:.2f},{top:.2f},{width:.2f},{height:.2f},1,-1,-1,-1\n")
    (tmp_path / "det.txt").write_text("".join(rows))
    (tmp_path / "seqinfo.ini").write_text(f"[Sequence]\nframeRate={FPS}\nimWidth={WIDTH}\nimHeight={HEIGHT}\n")
    return tmp_path


def rows_of(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def test_a_run_at_a_site_writes_metres_and_speeds(road, vidtrack):
    code, _, err = vidtrack("track", "det.txt", "--site", "site.toml", "-o", "out", "-q")
    assert code == 0, err
    rows = rows_of(road / "out" / "tracks.csv")
    assert list(rows[0]) == [column.name for column in (*VIDEO, *ROAD)]
    settled = [row for row in rows if 1.0 < float(row["time_s"]) < 2.2]
    assert len(settled) >= 25
    for row in settled:
        assert np.hypot(*(np.array([float(row["x_m"]), float(row["y_m"])]) - where(float(row["time_s"])))) < 0.6
        off = abs(float(row["speed_kmh"]) - 3.6 * SPEED)
        assert off < 0.05 * 3.6 * SPEED + 3 * float(row["speed_sigma_kmh"])
        assert abs(float(row["heading_deg"]) - 20) < 10
        assert float(row["speed_shared_sigma_kmh"]) > 0
    assert np.mean([float(row["speed_kmh"]) for row in settled]) == pytest.approx(3.6 * SPEED, rel=0.05)
    table = pq.read_table(road / "out" / "tracks.parquet")
    assert {field.name: field.metadata[b"unit"].decode() for field in table.schema}["speed_kmh"] == "km/h"
    (road / "out" / "tracks.parquet").unlink()
    repair(road / "out")
    assert pq.read_table(road / "out" / "tracks.parquet").equals(table)


def test_a_run_at_a_site_can_be_exported(road, vidtrack):
    assert vidtrack("track", "det.txt", "--site", "site.toml", "-o", "out", "-q")[0] == 0
    (road / "site.toml").unlink()  # the run has a copy
    code, out, err = vidtrack("export", "out", "--as", "sumo", "-o", "fcd")
    assert (code, out) == (0, "fcd\n")
    assert err.startswith("site road; 1 track; ")
    steps = ElementTree.parse(road / "fcd" / "fcd.xml").getroot()
    settled = [step for step in steps if 1.0 < float(step.get("time")) < 2.2]
    assert len(settled) >= 25
    for step in settled:
        (car,) = step
        front = where(float(step.get("time"))) + 4.5 / 2 * np.array([np.sin(HEADING), np.cos(HEADING)])
        assert np.hypot(*(np.array([float(car.get("x")), float(car.get("y"))]) - front)) < 1.0


def test_a_run_without_metres_is_not_exported(road, vidtrack):
    assert vidtrack("track", "det.txt", "-o", "out", "-q")[0] == 0
    code, out, err = vidtrack("export", "out", "--as", "sumo")
    assert (code, out) == (2, "")
    assert "has no positions in metres" in err
    assert err.count("\n") == 1


def test_a_picture_of_another_shape_is_refused_and_half_the_size_is_not(road, vidtrack):
    text = (road / "site.toml").read_text()
    (road / "square.toml").write_text(text.replace("width = 1280", "width = 1290"))
    code, _, err = vidtrack("track", "det.txt", "--site", "square.toml", "-o", "out", "-q")
    assert code == 2
    assert err.startswith("vidtrack: square.toml: ")
    assert "not the same shape" in err
    assert "Traceback" not in err
    assert not (road / "out" / "tracks.csv").exists()
    half = footprints_of(road / "site.toml", WIDTH // 2, HEIGHT // 2)
    assert half is not None


def test_a_site_without_a_calibration_gives_no_metres(road):
    (road / "gates.toml").write_text('[site]\nname = "a"\nwidth = 1280\nheight = 720\n')
    assert footprints_of(road / "gates.toml", WIDTH, HEIGHT) is None
    assert footprints_of(None, WIDTH, HEIGHT) is None


def test_radar_has_no_site(tmp_path, vidtrack):
    (tmp_path / "plots.csv").write_text("scan,time_s,x_m,y_m\n0,0,1,1\n")
    code, _, err = vidtrack("radar", "plots.csv", "--set", "output.site=site.toml")
    assert code == 2
    assert "setting output.site has no effect on radar plots" in err


def test_a_part_of_a_live_run_has_the_same_columns(road):
    prints = footprints_of(road / "site.toml", WIDTH, HEIGHT)
    folder = road / "part"
    folder.mkdir()
    blank = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    text = (road / "site.toml").read_text()
    subject = Subject("camera", Settings(), (HEIGHT, WIDTH), 25.0, lambda: blank, dict, None, prints, text)
    part = Part(folder, subject, decisions=False)
    steps = [make_step(0, [(1, "c", 640.0, 400.0)]), make_step(1, [(1, "c", 642.0, 400.0)])]
    part.write(steps, steps, track_rows(steps, columns_of(subject), prints))
    part.finish()
    rows = rows_of(folder / "tracks.csv")
    assert list(rows[0]) == [column.name for column in (*VIDEO, *ROAD)]
    assert all(float(row["y_m"]) > 10 for row in rows)
    assert pq.read_table(folder / "tracks.parquet").column_names == list(rows[0])
    assert (folder / "site.toml").read_text() == text


GATE = "[gates.near]\nline = [[1, 360], [1279, 360]]\n"


def test_a_run_is_measured_at_the_site_as_it_was(road, vidtrack):
    """The site's file moved its gate away since."""
    drawn = (road / "site.toml").read_text()
    (road / "site.toml").write_text(drawn + GATE)
    assert vidtrack("track", "det.txt", "--site", "site.toml", "-o", "out", "-q")[0] == 0
    assert (road / "out" / "site.toml").read_text() == drawn + GATE
    (road / "site.toml").write_text(drawn + GATE.replace("360", "3"))
    code, out, err = vidtrack("measure", "out")
    assert (code, out) == (0, "runs/out-measures\n")
    assert "1 crossings" in err


def test_without_a_site_that_all_runs_have_one_must_be_given(tmp_path):
    folders = [tmp_path / name for name in ("a", "b", "c")]
    for folder, text in zip(folders, (GATE, GATE, GATE.replace("360", "3")), strict=True):
        folder.mkdir()
        (folder / "site.toml").write_text(text)
        (folder / "tracks.csv").touch()
    a, b, c = map(str, folders)
    assert site_of([f"{a}@2026-06-01T07:00:00Z", b]) == folders[0] / "site.toml"
    with pytest.raises(ConfigError, match=r"a/site.toml and .*c/site.toml are not the same site; give --site"):
        site_of([a, b, c])
    with pytest.raises(SourceError, match="is not a finished run"):
        site_of([a, str(tmp_path)])
    (tmp_path / "tracks.csv").touch()
    with pytest.raises(ConfigError, match=r"has no site.toml: it was tracked without a site; give --site"):
        site_of([a, str(tmp_path)])


def test_calibrate_draws_and_reports(road, vidtrack):
    code, out, err = vidtrack("calibrate", "site.toml", "-o", "check", "--json", "report.json")
    assert code == 0, err
    assert "8.00 m above the road" in out.replace("\n", " ")
    report = json.loads((road / "report.json").read_text())
    assert report == json.loads((road / "check" / "calibration.json").read_text())
    assert len(report["pairs"]) == len(POINTS)
    assert max(pair["residual_px"] for pair in report["pairs"]) < 0.01
    assert report["degrees_of_freedom"] == 8
    picture = cv2.imread(str(road / "check" / "calibration.png"))
    assert picture.shape == (HEIGHT, WIDTH, 3)
    x, y = np.rint(CAMERA.picture([[0, 22.5]])[0]).astype(int)
    assert (picture[y - 1 : y + 2, x - 1 : x + 2] != 90).any()  # the line x = 0 goes through here


def test_calibrate_takes_a_picture_of_another_size(road, vidtrack):
    cv2.imwrite(str(road / "still.png"), np.full((HEIGHT // 2, WIDTH // 2, 3), 30, np.uint8))
    code, _, err = vidtrack("calibrate", "site.toml", "--picture", "still.png", "-o", "check", "-q")
    assert code == 0, err
    assert cv2.imread(str(road / "check" / "calibration.png")).shape == (HEIGHT // 2, WIDTH // 2, 3)


def test_calibrate_says_which_pair_is_wrong(road, vidtrack):
    picture = CAMERA.picture(POINTS)
    picture[3] += 30
    (road / "site.toml").write_text(site_text(picture))
    code, out, _ = vidtrack("calibrate", "site.toml", "--json", "-")
    assert code == 1
    assert json.loads(out)["wrong"] == [4]
    code, out, err = vidtrack("calibrate", "site.toml", "-q")
    assert (code, out) == (1, "")
    assert err.startswith("vidtrack: site.toml: pair 4 of the calibration")
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[site]\nname = "a"\nwidth = 9\nheight = 9\n', "has no section [calibration]"),
        (
            site_text(CAMERA.picture(POINTS), POINTS * [1, -1]),
            "vidtrack: site.toml: calibration: the points are mirrored",
        ),
        ("[site", "is not valid TOML"),
    ],
)
def test_calibrate_refuses_in_one_line(tmp_path, text, words, vidtrack):
    (tmp_path / "site.toml").write_text(text)
    code, out, err = vidtrack("calibrate", "site.toml")
    assert code == 2
    assert words in err
    assert not out
    assert err.count("\n") == 1


def test_calibrate_needs_a_file(tmp_path, vidtrack):
    code, _, err = vidtrack("calibrate", "none.toml")
    assert code == 2
    assert "cannot read site none.toml" in err


def test_a_camera_that_sways_does_not_move_the_road(road):
    """Positions in pixels are those of the picture, those in metres of the scene that the site is drawn on."""
    step = make_step(0, [(1, "c", 640.0, 400.0)])
    steps = [step, replace(step, motion=shift(5.0, -3.0))]
    still, swayed = (
        track_rows([step], (*VIDEO, *ROAD), footprints_of(road / "site.toml", WIDTH, HEIGHT)).to_pylist()[0]
        for step in steps
    )
    assert swayed["x_px"] == still["x_px"] + 5
    assert swayed["y_px"] == still["y_px"] - 3
    for column in ROAD:
        assert swayed[column.name] == still[column.name]
