"""`vidtrack doctor` as a user runs it: files, stored detections, cameras, and what cannot be opened."""

import json
import re

import click
import pytest
from click.testing import CliRunner
from command_line import SAMPLES

from vidtrack.cli import cli
from vidtrack.config.load import load
from vidtrack.doctor.advice import judge
from vidtrack.doctor.findings import Findings, Reception, Speed


def doctor(*arguments):
    """Exit code and stdout."""
    result = CliRunner().invoke(cli, ["doctor", *map(str, arguments)], standalone_mode=False)
    if result.exception is not None:
        raise result.exception
    return result.return_value, result.stdout


def test_a_good_source_is_told_in_a_table():
    code, shown = doctor(SAMPLES / "junction.avi", "--seconds", 8)
    assert code == 0
    assert "15 frames/s" in shown
    assert "240 x 180 px" in shown
    assert "nothing that will hurt was found" in shown


def test_json_is_one_object_and_nothing_else():
    code, shown = doctor(SAMPLES / "junction.avi", "--seconds", 8, "--json", "-")
    found = json.loads(shown)
    assert code == 0
    assert found["fine"] is True
    assert found["advice"] == []
    assert found["timing"]["rate"] == pytest.approx(15)
    assert found["objects"]["tracks"] > 5


def test_a_problem_has_exit_code_1_and_names_the_option(tmp_path):
    json_file = tmp_path / "found.json"
    code, shown = doctor(SAMPLES / "junction.avi", "--seconds", 8, "--scale", 0.25, "--json", json_file)
    assert code == 1
    assert "--scale 0.5" in shown
    found = json.loads(json_file.read_text())
    assert found["fine"] is False
    assert found["advice"][0]["name"] == "tiny"


def test_stored_detections_need_a_rate(tmp_path):
    detections = tmp_path / "det.txt"
    detections.write_text("".join(f"{k},-1,{10 + k},20,30,40,0.9\n" for k in range(1, 30)))
    code, shown = doctor(detections)
    assert code == 1
    assert "--fps N" in shown
    assert doctor(detections, "--fps", 10, "--quiet") == (0, "")


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("nothing.avi", "no such file"),
        ("rtsp://u:geheim@127.0.0.1:9/x", "connection refused"),
        ("77", "no such device /dev/video77"),
        ("gopher://u:geheim@host/x", "not supported"),
    ],
)
def test_what_cannot_be_opened_is_one_line_and_exit_code_3(source, message):
    at_once = () if source.endswith(".avi") else ("--set", "live.backoff_s=0.01")
    with pytest.raises(Exception, match=message) as caught:
        doctor(source, *at_once)
    assert caught.value.exit_code == 3
    assert "\n" not in str(caught.value)
    assert "geheim" not in str(caught.value)


def test_help_shows_three_examples():
    text = CliRunner().invoke(cli, ["doctor", "--help"]).output
    assert len(re.findall(r"^\s+vidtrack doctor ", text, re.M)) == 3


@pytest.mark.parametrize("wrong", [(), ("--warm", "a.avi"), ("--warm", "--fps", 5), ("--warm", "--json", "-")])
def test_a_source_or_warm_alone(wrong):
    with pytest.raises(click.UsageError, match="--warm"):
        doctor(*wrong)


def found_at(rate, decode_s, track_s, kind="video"):
    return Findings(
        source="x",
        kind="live" if decode_s is None else kind,
        width=640,
        height=480,
        fps=rate,
        reception=Reception(header_fps=rate, fps_assumed=False),
        timing=None,
        speed=Speed(decode_s, track_s),
    )


@pytest.mark.parametrize(
    ("rate", "decode_s", "track_s", "options"),
    [
        (25.0, 0.002, 0.010, None),
        (25.0, 0.010, 0.080, ("--scale 0.5",)),
        (25.0, 0.010, 0.030, ("--max-fps 16",)),
        (25.0, 0.050, 0.005, ()),
        (100.0, None, 0.005, None),
        (25.0, None, 0.200, ("--scale 0.333",)),
    ],
)
def test_a_machine_that_is_too_slow(rate, decode_s, track_s, options):
    found = {advice.name: advice for advice in judge(found_at(rate, decode_s, track_s), load())}
    assert ("speed" in found) == (options is not None)
    if options is not None:
        assert found["speed"].problem
        assert found["speed"].options == options


def test_fewer_pictures_a_second_are_advised_once_and_not_of_a_recording():
    settings = load(assignments=["source.max_fps=16"])
    assert list(judge(found_at(25.0, 0.010, 0.032), settings)) == []  # the time of a picture is never quite the same
    assert list(judge(found_at(25.0, None, 0.045), load(assignments=["source.max_fps=16"]))) == []
    (advice,) = judge(found_at(25.0, 0.010, 0.030, "recording"), load())
    assert advice.options == ("--scale 0.5",)
