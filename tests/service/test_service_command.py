"""`vidtrack service`: the unit is one that systemd takes, runs what was asked, and shows no password."""

import configparser
import json
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from vidtrack.cli import cli
from vidtrack.cli.live import command as live
from vidtrack.errors import ConfigError
from vidtrack.service.unit import Unit

LIVE = ["live", "rtsp://10.0.0.7/a", "-o", "results", "--keep", "30d"]


def printed(*arguments, options=()):
    result = CliRunner().invoke(cli, ["service", "install", "--dry-run", *options, "--", *arguments])
    assert result.exit_code == 0, result.output
    return result.output


def parsed(text):
    unit = configparser.RawConfigParser(strict=False)
    unit.optionxform = str
    unit.read_string(text)
    return unit


def refused(*arguments):
    with pytest.raises(ConfigError) as error:
        cli.main(["service", "install", "--dry-run", "--", *arguments], standalone_mode=False)
    return str(error.value)


def test_the_unit_runs_what_was_asked_and_waits_for_a_late_camera():
    service = parsed(printed(*LIVE))["Service"]
    command = shlex.split(service["ExecStart"])
    assert command == [sys.executable, "-m", "vidtrack", *LIVE, "--set", "live.retry_first=true"]
    assert service["Type"] == "notify"
    assert service["Restart"] == "on-failure"
    assert int(service["WatchdogSec"]) > 0
    assert service["RestartPreventExitStatus"] == "2"  # a wrong configuration does not get better
    assert service["StateDirectory"] == "vidtrack"


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze")
def test_systemd_takes_the_unit(tmp_path):
    text = printed(
        *LIVE, "--line", "a b:1,2,3,4", "--set", "live.zone=UTC", options=["--name", "cam-1", "--user", "root"]
    )
    path = tmp_path / "cam-1.service"
    path.write_text(text)
    result = subprocess.run(["systemd-analyze", "verify", path], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")


def test_lists_of_cameras_are_found_from_anywhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("cameras.toml").touch()
    command = shlex.split(parsed(printed("live", "cameras.toml", "-o", "r", "--roll", "1h"))["Service"]["ExecStart"])
    assert command[4] == str(tmp_path / "cameras.toml")
    assert "live.retry_first=true" not in command  # lists wait anyway


def test_arguments_are_quoted_as_systemd_reads_them():
    text = Unit("cam", "cam", ["/bin/x", "a b", "50%", "$HOME", 'q"', "back\\slash", ""], "/etc/a").text()
    assert 'ExecStart=/bin/x "a b" 50%% "$$HOME" "q\\"" "back\\\\slash" ""\n' in text


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["live", "rtsp://10.0.0.7/a", "--keep", "30d"], "needs -o DIR"),
        (["live", "rtsp://10.0.0.7/a", "-o", "results"], "--roll or --keep"),
        (["track", "a.mp4"], "not 'track'"),
        (["live", "rtsp://u:geheim@10.0.0.7/a", "-o", "results", "--keep", "30d"], "everyone may read a unit"),
        ([*LIVE, "--mqtt", "mqtt://u:geheim@broker"], "everyone may read a unit"),
        ([*LIVE, "--http-token", "geheim"], "everyone may read a unit"),
    ],
)
def test_what_a_service_cannot_do_is_refused(arguments, said):
    message = refused(*arguments)
    assert said in message
    assert "geheim" not in message


def test_uninstalling_what_is_not_there_is_refused_and_a_dry_run_says_what_it_would_do():
    with pytest.raises(ConfigError, match="there is no service nosuch"):
        cli.main(["service", "uninstall", "--name", "nosuch"], standalone_mode=False)
    told = CliRunner().invoke(cli, ["service", "uninstall", "--dry-run"]).output
    assert told.splitlines()[0] == "systemctl disable --now vidtrack"


def test_the_container_file_copies_what_there_is_and_runs_what_the_program_takes():
    """It is not built here: that takes minutes, and a base image."""
    root = Path(__file__).parents[2]
    lines = (root / "tools" / "Containerfile").read_text().replace("\\\n", "").splitlines()
    orders = [line.split(maxsplit=1) for line in lines if line and not line.startswith("#")]
    known = [
        "FROM",
        "COPY",
        "RUN",
        "ENV",
        "USER",
        "WORKDIR",
        "VOLUME",
        "EXPOSE",
        "STOPSIGNAL",
        "HEALTHCHECK",
        "ENTRYPOINT",
        "CMD",
    ]
    assert {order for order, _ in orders} <= set(known)
    for order, rest in orders:
        if order == "COPY":
            assert all((root / source).exists() for source in rest.split()[:-1])
    given = dict(orders)
    program, command = json.loads(given["CMD"])[0], json.loads(given["CMD"])[1:]
    assert program == "live"
    assert live.make_context("live", command).params["http"] == "0.0.0.0:8080"
    check = given["HEALTHCHECK"].partition("CMD ")[2]
    compile(json.loads(check)[2], "check", "exec")
