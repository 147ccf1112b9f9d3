"""The folder of a report: what the page says, what the spreadsheets hold, and that neither runs anything."""

import csv
import html
import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from made_up_day import SITE, busy_day, write_day, write_run

from vidtrack.cli import cli
from vidtrack.errors import ConfigError, OutputError, SourceError
from vidtrack.output.corrections import CorrectionsFile
from vidtrack.output.report.report import write_report
from vidtrack.traffic.report.findings import read_findings
from vidtrack.traffic.validation.audit import Correction


def report(folder, scene=None):
    made = folder.parent / "report"
    made.mkdir()
    write_report(made, read_findings(folder), scene)
    return made


@pytest.fixture
def unpainted(monkeypatch):
    """For what words and tables say: pictures are laid out, and not painted."""
    for part in ("charts", "pictures"):
        monkeypatch.setattr(f"vidtrack.output.report.{part}.png", lambda figure: b"")


def table(path):
    with path.open(encoding="utf-8-sig", newline="") as file:
        return list(csv.DictReader(file))


def words(made):
    page = (made / "report.html").read_text(encoding="utf-8").partition("<body>")[2]
    return html.unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", page)))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("busy")
    return folder, report(busy_day(folder / "day"))


def test_page_pictures_and_spreadsheets_agree(made):
    folder, out = made
    found = read_findings(folder / "day")
    rows = table(out / "turning_movements.csv")
    trips = int((found.numbers("trips", "complete") > 0).sum())
    assert sum(int(row["all"] or 0) for row in rows) == trips
    assert sum(int(row["trips"]) for row in table(out / "origin_destination.csv")) == trips
    text = words(out)
    assert f"Whole trips {trips}" in text
    (whole, *_) = table(out / "peak_hour.csv")
    assert f"Peak hour {whole['begin'][-5:]}–{whole['end'][-5:]} {whole['vehicles']} vehicles" in text
    assert f"Peak hour factor {float(whole['peak_hour_factor']):.2f}" in text
    for name in ("turning_movements", "origin_destination", "speeds", "flow", "queues", "coverage"):
        assert (out / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_the_page_needs_nothing_from_elsewhere(made):
    page = (made[1] / "report.html").read_text(encoding="utf-8")
    assert not re.search(r"https?:|<script|<link|<iframe|@import|url\(|srcset", page)
    sources = re.findall(r'(?:src|href)="([^"]{22})', page)
    assert len(sources) == 5
    assert set(sources) == {"data:image/png;base64,"}


def test_the_page_says_what_contradicts_the_calibration(tmp_path, made, unpainted):
    assert "calibration is contradicted" not in words(made[1])
    scale = {"factor": 1.26, "sigma": 0.05, "vehicles": 20, "off": True}
    sections = ["sections.main.length_m = 24, but by the calibration the gates are 31 m apart"]
    pairs = ["pair 5 of the calibration is 3 m from where the other pairs put it"]
    folder = write_day(tmp_path / "day", [[3], [5]], calibration=pairs, scale=scale, sections=sections)
    page = words(report(folder))
    told = page.index("The calibration is contradicted, so speeds, lengths and places may be wrong:")
    for reason in (pairs[0], "vehicles come out 1.26 times as large", sections[0]):
        assert told < page.index(reason) < page.index("Turning movements")


def test_the_page_says_where_an_earlier_version_did_not_tell_of_the_calibration(tmp_path, made, unpainted):
    doubt = "does not tell whether the points of the calibration agree: measure it again"
    assert doubt not in words(made[1])
    folder = write_day(tmp_path / "day", [[3], [5]])
    told = json.loads((folder / "measures.json").read_text())
    del told["calibration"]
    (folder / "measures.json").write_text(json.dumps(told))
    assert doubt in words(report(folder))


def test_conflicts_are_shown_where_there_is_a_table_of_them(tmp_path, made, unpainted):
    assert "Conflicts" not in words(made[1])
    assert not (made[1] / "conflicts.csv").exists()
    nothing = np.nan
    close = [
        ("crossing", nothing, 2.5),
        ("rear-end", 1.2, nothing),
        ("crossing", 0.75, 0.5),
        ("crossing", nothing, 4.0),
    ]
    out = report(write_day(tmp_path / "day", [4], close=close))
    rows = [{name: cell for name, cell in row.items() if cell} for row in table(out / "conflicts.csv")]
    assert rows == [
        {
            "kind": "crossing",
            "conflicts": "3",
            "with_ttc": "1",
            "with_pet": "3",
            "least_ttc_s": "0.75",
            "least_pet_s": "0.5",
        },
        {"kind": "rear-end", "conflicts": "1", "with_ttc": "1", "with_pet": "0", "least_ttc_s": "1.2"},
    ]
    text = words(out)
    times = [
        text.index(one)
        for one in ("06:02 crossing 0.75 ± 0.20 0.50 ± 0.40", "06:01 rear-end 1.20 ± 0.20 –", "06:00 crossing –")
    ]
    assert times == sorted(times)  # the closest first


def test_no_conflicts_is_said(tmp_path, unpainted):
    assert "No two vehicles came so close" in words(report(write_day(tmp_path / "day", [4], close=[])))


def test_nobody_watched_is_said_and_not_zero(made):
    _, out = made
    gap = [row for row in table(out / "turning_movements.csv") if row["coverage"] == "0"]
    assert [row["begin"] for row in gap] == [f"2026-06-01 12:{minute:02d}" for minute in (0, 15, 30, 45)]
    assert {value for row in gap for name, value in row.items() if name not in ("begin", "end", "coverage")} == {""}
    flows = [row for row in table(out / "flow_and_queues.csv") if row["coverage"] == "0"]
    assert {(row["flow_per_h"], row["queue"]) for row in flows} == {("", "")}
    page = (out / "report.html").read_text(encoding="utf-8")
    hatched = re.findall(r'<tr class="none">.*?</tr>', page, re.S)
    assert len(hatched) == 4 * (1 + page.count("<summary>"))  # in the whole sheet, and in that of each leg
    assert not any(re.search(r"<td[^>]*>\s*\d", row) for row in hatched)


def test_what_there_is_no_data_for_is_left_out_in_words(made):
    text = words(made[1])
    assert text.count("Left out: the tracks of the run gone are no longer where they were measured.") == 2
    assert not (made[1] / "heat_map.png").exists()


def test_a_site_without_metres_has_no_queues_and_no_speeds(tmp_path, unpainted):
    text = words(report(write_day(tmp_path / "day", [4, 5, 6, 7], metres=False)))
    assert "Left out: no speed was measured" in text
    assert "Left out: without a calibration nobody knows whether a vehicle stands." in text
    assert "The angles are those of the picture" in text


def test_a_day_without_a_queue_has_no_empty_axes(tmp_path, made, unpainted):
    left_out = "Left out: no vehicle was seen to queue."
    assert left_out not in words(made[1])
    out = report(write_day(tmp_path / "day", [4, 5]))
    assert left_out in words(out)
    assert not (out / "queues.png").exists()
    assert {row["queue"] for row in table(out / "flow_and_queues.csv")} == {"0"}


def test_less_than_an_hour_has_no_peak_hour(tmp_path, unpainted):
    made = report(write_day(tmp_path / "day", [4, 5, 6]))
    assert "Left out: no hour of whole intervals was watched." in words(made)
    assert not (made / "peak_hour.csv").exists()


def test_no_trips_at_all(tmp_path):
    text = words(report(write_day(tmp_path / "day", [1], legs=("north", None))))
    assert "Whole trips 0" in text
    empty = write_day(tmp_path / "other" / "day", [0, 0, 0, 0])
    assert "Left out: no vehicle was counted." in words(report(empty))


HOSTILE = [
    "<script>alert(1)</script>",
    '=HYPERLINK("x","y")',
    "a, b",
    '"quoted"',
    "$x$ \\alpha",
    "+1",
    "@SUM(A1)",
    "\t=1",
]


def test_names_run_nothing_in_a_browser_or_a_spreadsheet(tmp_path):
    pairs = [(name, "south") for name in HOSTILE]
    made = report(
        write_day(tmp_path / "day", [range(1, 9)] * 4, legs=pairs, name="<img src=x onerror=alert(1)> & =1+1")
    )
    page = (made / "report.html").read_text(encoding="utf-8")
    assert not re.search(r"<script|<img src=x", page)
    for name in HOSTILE:
        assert name in html.unescape(page)
    rows = table(made / "origin_destination.csv")
    trips = {row["from"].removeprefix("'").strip(): row["trips"] for row in rows}
    assert [trips[name.strip()] for name in HOSTILE] == [str(4 * k) for k in range(1, 9)]
    for path in made.glob("*.csv"):
        with path.open(encoding="utf-8-sig", newline="") as file:
            for row in csv.reader(file):
                assert not any(re.match(r"\s*[=+@]|\s*-\D", cell) for cell in row), (path.name, row)


def test_a_picture_lies_under_the_arrows(tmp_path, made):
    scene = np.zeros((720, 1280, 3), np.uint8)
    other = report(write_day(tmp_path / "day", [4]), scene)
    assert "Without the scene" in words(made[1])
    assert "Without the scene" not in words(other)


def command(*arguments):
    cli.main(["report", *map(str, arguments)], standalone_mode=False)


def test_the_command_writes_the_folder_and_says_where(tmp_path, monkeypatch, capsys):
    write_day(tmp_path / "day", [4, 5, 6, 7])
    monkeypatch.chdir(tmp_path)
    command("day")
    assert capsys.readouterr().out == f"{Path('runs/day-report')}\n"
    assert (tmp_path / "runs/day-report/report.html").is_file()


def test_what_the_command_refuses(tmp_path):
    day = write_day(tmp_path / "day", [4, 5, 6, 7])
    with pytest.raises(OutputError, match="is what is to be read"):
        command(day, "-o", day, "--force")
    with pytest.raises(SourceError, match="is not a folder; give one that vidtrack measure wrote"):
        command(tmp_path / "nothing")
    cv2.imwrite(str(tmp_path / "square.png"), np.zeros((500, 500, 3), np.uint8))
    with pytest.raises(ConfigError, match="not the same shape"):
        command(day, "-o", tmp_path / "out", "--picture", tmp_path / "square.png")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("seconds", "said"), [(10, "10 s"), (90, "90 s"), (60, "1 min"), (900, "15 min")])
def test_the_page_says_how_long_intervals_are(tmp_path, unpainted, monkeypatch, seconds, said):
    monkeypatch.setattr("made_up_day.INTERVAL_S", float(seconds))
    assert f"in intervals of {said} " in words(report(write_day(tmp_path / "day", [1, 2])))


def test_a_site_with_zones_alone_has_a_report(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_run(tmp_path / "run", 20.0)
    text = SITE.format(name="yard", calibration="")
    head, zones = text[: text.index("[gates")], text[text.index("[zones") : text.index("[movements]")]
    (tmp_path / "site.toml").write_text(head + zones)
    cli.main(["measure", "run", "--site", "site.toml", "-o", "measures", "-q"], standalone_mode=False)
    command("measures", "-o", "out")
    page = words(tmp_path / "out")
    assert "Left out: the site has no gates. Stays in its zones are in the table stays of vidtrack measure." in page
    assert not (tmp_path / "out" / "checks.csv").exists()
    heat = table(tmp_path / "out" / "heat_map.csv")
    assert sum(float(row["vehicle_seconds"]) for row in heat) > 0
    with pytest.raises(ConfigError, match="utdf holds turning counts, and the site yard has no entry gate"):
        cli.main(["export", "measures", "--as", "utdf", "-o", "volumes"], standalone_mode=False)


def test_from_a_run_to_its_report(tmp_path, monkeypatch):
    """Two vehicles: one drives from the north to the south, one stands aside. Somebody looked at one crossing."""
    monkeypatch.chdir(tmp_path)
    write_run(tmp_path / "run", 20.0)
    (tmp_path / "site.toml").write_text(SITE.format(name="cross", calibration=""))
    cli.main(["measure", "run", "--site", "site.toml", "-o", "measures", "-q"], standalone_mode=False)
    CorrectionsFile(tmp_path / "measures").replace(
        [Correction("double", 28.0, "south_out", "down", 0, 1), Correction("missed", 5.0, "north_in", "down")]
    )
    command("measures", "-o", "out")
    (movement,) = [row for row in table(tmp_path / "out" / "origin_destination.csv") if row["trips"] != "0"]
    assert movement == {"from": "north", "to": "south", "turn": "through", "trips": "1"}
    assert (tmp_path / "out" / "time_space.png").is_file()
    assert "Whole trips 1" in words(tmp_path / "out")
    assert "Somebody looked at 1 of 2 crossings" in words(tmp_path / "out")
    looked_at = {row["gate"]: row for row in table(tmp_path / "out" / "looked_at.csv")}
    found = {
        gate: (looked_at[gate]["counted"], looked_at[gate]["corrected"]) for gate in ("north_in", "south_out", "all")
    }
    assert found == {"north_in": ("1", "2"), "south_out": ("1", "0"), "all": ("2", "2")}


def test_the_scene_of_the_newest_run_lies_under_the_arrows(tmp_path):
    """Where no picture is given: of the last run that has a whole one of the site's shape."""
    runs = [{"folder": str(tmp_path / f"run{n}"), "begin_s": 0.0, "end_s": 900.0, "run": n} for n in range(6)]
    for run in runs:
        Path(run["folder"]).mkdir()
    found = write_day(tmp_path / "day", [4], runs=runs)
    scenes = {n: np.full((360, 640, 3), 80 * n, np.uint8) for n in (0, 1)} | {2: np.zeros((500, 500, 3), np.uint8)}
    for n, picture in scenes.items():
        cv2.imwrite(str(tmp_path / f"run{n}" / "scene.jpg"), picture)
    for n, content in ((3, b"no picture"), (4, b"")):
        (tmp_path / f"run{n}" / "scene.jpg").write_bytes(content)
    other, given = report(found), tmp_path / "given"
    assert "Without the scene" not in words(other)
    given.mkdir()
    write_report(given, read_findings(found), scenes[1])
    assert (other / "origin_destination.png").read_bytes() == (given / "origin_destination.png").read_bytes()
