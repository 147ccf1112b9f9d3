"""`vidtrack validate`, and what it refuses."""

import csv
import json
import os
from pathlib import Path

import pytest

from vidtrack.cli import cli
from vidtrack.errors import Error

COUNTS = (
    "time_s,frame,line,direction,track_id\n"
    "1.0,25,north,up,1\n2.0,50,north,down,2\n3.5,88,south,up,3\n4,100,west,left,4\n"
)
CROSSINGS = (
    "time_s,utc,gate,direction,track_id\n"
    "1.0,2026-06-01T05:00:01+00:00,north,up,1\n2.0,2026-06-01T05:00:02+00:00,north,down,2\n"
)


def validate(*arguments):
    return cli.main(["validate", *map(str, arguments)], prog_name="vidtrack", standalone_mode=False)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "counts.csv").write_text(COUNTS)
    (tmp_path / "measures").mkdir()
    (tmp_path / "measures" / "crossings.csv").write_text(CROSSINGS)
    return tmp_path


def test_a_run_is_compared_by_seconds(folder, capsys):
    (folder / "manual.csv").write_text(
        "time_s,gate,direction,class\n1.2,north,up,car\n2.1,north,down,car\n3,south,up,van\n"
    )
    validate(folder / "run", folder / "manual.csv", "--json", folder / "out.json", "-o", folder / "report")
    report = json.loads((folder / "out.json").read_text())
    assert report == json.loads((folder / "report" / "validation.json").read_text())
    assert report["pooled"]["hit"] == 3
    assert report["gates"]["north"]["recall"]["value"] == 1.0
    assert "north" in capsys.readouterr().out


def test_measures_are_compared_by_the_time_of_day_in_any_zone(folder, capsys):
    (folder / "manual.csv").write_text(
        "utc,line,direction\n2026-06-01T07:00:01+02:00,north,up\n2026-06-01T05:00:02Z,north,down\n"
    )
    validate(folder / "measures", folder / "manual.csv", "--tolerance", "0.1", "--json", "-")
    report = json.loads(capsys.readouterr().out)
    assert (report["pooled"]["hit"], report["clock"]) == (2, "utc")


def test_a_gate_that_nobody_crossed_is_known_from_the_summary(folder, capsys):
    (folder / "run" / "summary.json").write_text('{"counts": {"west": {"left": 0, "right": 0}}}')
    (folder / "manual.csv").write_text("time_s,gate,direction\n2,west,left\n")
    validate(folder / "run", folder / "manual.csv", "--json", "-")
    assert json.loads(capsys.readouterr().out)["gates"]["west"]["missed"] == 1


def test_and_from_the_intervals(folder, capsys):
    (folder / "measures" / "intervals.csv").write_text("begin_s,gate,direction,count\n0,west,left,0\n")
    (folder / "manual.csv").write_text("time_s,gate,direction\n2,west,left\n")
    validate(folder / "measures", folder / "manual.csv", "--json", "-")
    assert json.loads(capsys.readouterr().out)["gates"]["west"]["missed"] == 1


def test_measures_of_a_site_without_start_are_compared_by_seconds_or_the_user_is_told_to_give_one(folder, capsys):
    table = folder / "measures" / "crossings.csv"
    table.write_text("time_s,utc,gate,direction,track_id\n1.0,,north,up,1\n2.0,,north,down,2\n")
    (folder / "manual.csv").write_text("time_s,utc,gate,direction\n1.2,,north,up\n")
    validate(folder / "measures", folder / "manual.csv", "--json", "-")
    assert json.loads(capsys.readouterr().out)["pooled"]["hit"] == 1
    (folder / "manual.csv").write_text("utc,gate,direction\n2026-06-01T07:00:01+02:00,north,up\n")
    with pytest.raises(Error, match=r"manual.csv has times of day, .* give \[site\] the time of the first picture"):
        validate(folder / "measures", folder / "manual.csv")


@pytest.mark.parametrize(
    ("manual", "measures", "code", "words"),
    [
        ("time_s,gate,direction\n1,nort,up\n", "run", 2, "gate 'nort' is not in"),
        ("time_s,gate,direction\n1,nort,up\n", "run", 2, "did you mean north?"),
        ("time_s,gate,direction\n1,north,upp\n", "run", 2, "direction 'upp' of gate north is not in"),
        ("time_s,gate,direction\n1,west,up\n", "run", 2, "direction 'up' of gate west is not in"),
        ("time_s,gate,direction\n1,north,left\n", "run", 2, "counts.csv; there is up, down"),
        ("time_s,gate,direction\n100,north,up\n", "run", 2, "no overlap in time"),
        ("time_s,gate,direction\n", "run", 2, "is empty"),
        ("", "run", 2, "has no column time_s or utc"),
        ("when,gate,direction\n1,north,up\n", "run", 2, "has no column time_s or utc; it has when, gate, direction"),
        ("time_s;gate;direction\n1;north;up\n", "run", 2, "separate columns by commas"),
        ("time_s,direction\n1,up\n", "run", 2, "has no column gate"),
        ("time_s,gate\n1,north\n", "run", 2, "has no column direction"),
        ("time_s,gate,direction\nsoon,north,up\n", "run", 2, "line 2: time_s is 'soon'; write seconds"),
        ("time_s,gate,direction\nnan,north,up\n", "run", 2, "line 2: time_s is 'nan'"),
        ("time_s,gate,direction\n1,north\n", "run", 2, "direction '' of gate north is not in"),
        ("time_s,gate,direction,certain\n1,north,up,perhaps\n", "run", 2, "certain is 'perhaps'; write 1 or 0"),
        (
            "utc,gate,direction\n2026-06-01T05:00:01,north,up\n",
            "measures",
            2,
            "line 2: utc is '2026-06-01T05:00:01', without a zone",
        ),
        ("utc,gate,direction\n7 o'clock,north,up\n", "measures", 2, "write a date and a time"),
        ("utc,gate,direction\n2026-06-01T05:00:01+02:00,north,up\n", "measures", 2, "no overlap in time"),
        (
            "utc,gate,direction\n2026-06-01T05:00:01Z,north,up\n",
            "run",
            2,
            "has times of day, and the counted table has none",
        ),
        ("time_s,gate,direction\n1,north,up\n", "none", 3, "holds no crossings.csv or counts.csv"),
        ("time_s,gate,direction\n1,north,up\n", "empty", 2, "nothing was counted"),
    ],
)
def test_bad_input_is_refused_in_one_line(folder, manual, measures, code, words):
    (folder / "empty").mkdir()
    (folder / "empty" / "counts.csv").write_text(COUNTS.splitlines()[0] + "\n")
    (folder / "manual.csv").write_text(manual)
    with pytest.raises(Error) as refused:
        validate(folder / measures, folder / "manual.csv", "-q")
    assert refused.value.exit_code == code
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_missing_or_binary_count_is_refused(folder):
    with pytest.raises(Error, match="cannot read") as refused:
        validate(folder / "run", folder / "none.csv")
    assert refused.value.exit_code == 3
    (folder / "picture.csv").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(Error, match="is no CSV table"):
        validate(folder / "run", folder / "picture.csv")


def test_a_start_is_a_time_of_the_table(folder):
    (folder / "manual.csv").write_text("time_s,gate,direction\n1,north,up\n")
    with pytest.raises(Error, match="--start: time_s is 'early'"):
        validate(folder / "run", folder / "manual.csv", "--start", "early")


@pytest.mark.skipif("VIDTRACK_DATA" not in os.environ, reason="needs the real data: set VIDTRACK_DATA")
def test_a_real_clip_against_its_count_by_hand(tmp_path, capsys):
    """Tunnel: nine crossings of two lines, noted by frame."""
    data, fps = Path(os.environ["VIDTRACK_DATA"]), 25.0
    lines = ("--line", "left:150,140,150,245", "--line", "right:425,250,580,250")
    cli.main(["track", str(data / "tunnel.mp4"), *lines, "-o", str(tmp_path / "run"), "-q"], standalone_mode=False)
    with (data / "events" / "tunnel.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    noted = "".join(f"{int(row['frame']) / fps},{row['line']},{row['direction']},{row['certain']}\n" for row in rows)
    (tmp_path / "manual.csv").write_text(f"time_s,line,direction,certain\n{noted}")
    capsys.readouterr()
    validate(
        tmp_path / "run", tmp_path / "manual.csv", "--tolerance", 8 / fps, "--start", 0, "--end", 15, "--json", "-"
    )
    pooled = json.loads(capsys.readouterr().out)["pooled"]
    assert pooled["noted"] == sum(row["certain"] == "1" for row in rows)
    assert pooled["recall"]["value"] >= 0.8
    assert pooled["recall"]["low"] < pooled["recall"]["value"]
