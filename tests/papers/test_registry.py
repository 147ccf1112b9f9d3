import csv

import pytest
from click.testing import CliRunner

from vidtrack.cli.reproduce import command
from vidtrack.errors import ConfigError, OutputError
from vidtrack.papers.registry import EXPERIMENTS, choose


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_experiment_writes_a_picture_and_a_table_and_says_what_came_out(name, tmp_path):
    result = CliRunner().invoke(command, [name, "--runs", "1", "-o", str(tmp_path / "out")], catch_exceptions=False)
    assert result.exit_code == 0
    verdict = next(line for line in result.stdout.splitlines() if line.startswith(f"{name}: "))
    assert verdict.endswith(".")
    assert (tmp_path / "out" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader((tmp_path / "out" / f"{name}.csv").open()))
    assert rows
    assert any("paper" in column or "reference" in column for column in rows[0])


def test_list_shows_all_names_and_writes_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(command, ["--list"])
    assert [line.split()[0] for line in result.stdout.splitlines()] == list(EXPERIMENTS)
    assert not list(tmp_path.iterdir())


def test_an_unknown_name_is_refused_with_the_nearest_one():
    with pytest.raises(ConfigError, match=r"004-fig4.*did you mean 004-fig"):
        choose(["004-fig4"])
    with pytest.raises(ConfigError, match="--list"):
        choose(["zebra"])


def test_results_of_others_are_not_overwritten_unasked(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    result = CliRunner().invoke(command, ["004-fig1", "-o", str(tmp_path)])
    assert isinstance(result.exception, OutputError)


def test_the_default_folder_is_reproduced_and_may_be_filled_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("004-fig1", "004-fig3"):
        assert CliRunner().invoke(command, [name, "--quiet"]).exit_code == 0
    assert {path.name for path in (tmp_path / "reproduced").iterdir()} == {
        f"{name}.{kind}" for name in ("004-fig1", "004-fig3") for kind in ("png", "csv")
    }
