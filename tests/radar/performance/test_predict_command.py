import json

import pytest
from click.testing import CliRunner

from vidtrack.cli.predict import command
from vidtrack.errors import ConfigError, OutputError


def run(*arguments):
    outcome = CliRunner().invoke(command, [str(argument) for argument in arguments], catch_exceptions=False)
    assert outcome.exit_code == 0, outcome.output
    return outcome.stdout


def numbers(*arguments):
    return json.loads(run(*arguments, "--json", "-"))


def test_json_of_a_strongest_neighbour_filter():
    found = numbers(
        "--filter", "psn", "--snr-db", 16, "--pfa", "1e-1", "--q", 0.16, "--gate", 4, "--cell", 0.1, "--scans", 50
    )  # fmt: skip
    assert list(found) == ["k", "paper", "corrected"]
    assert found["k"] == list(range(1, 51))
    assert found["paper"][0] == pytest.approx(1.8120569568641833, rel=1e-9)
    assert found["corrected"][1] == pytest.approx(1.9068286087907496, rel=1e-9)


def test_json_of_a_data_association_filter():
    found = numbers("--filter", "pda", "--snr-db", 10, "--pfa", 0.01, "--q", 0.01, "--cell", 4, "--scans", 35)
    assert list(found) == ["k", "kershaw_evans", "exact"]
    assert len(found["k"]) == len(found["exact"]) == 35
    assert found["kershaw_evans"][0] == pytest.approx(2.5396729587796028, rel=1e-9)
    assert found["exact"][0] == pytest.approx(2.583078269261201, rel=1e-9)


def test_outside_its_gate_the_fit_is_null_and_the_table_says_why():
    arguments = ("--filter", "pda", "--snr-db", 10, "--pfa", 0.01, "--gate", 3, "--scans", 2)
    assert numbers(*arguments)["kershaw_evans"] is None
    assert "gate of 4 only" in run(*arguments)


def test_divergence_is_said():
    text = run("--snr-db", 16, "--pfa", "1e-3", "--weibull", "1,1", "--scans", 5)
    assert "corrected: no steady state" in text
    assert "paper: steady state 4.46" in text


@pytest.mark.parametrize("kind", ["psn", "pda"])
def test_simulated_runs_add_the_share_of_lost_tracks(kind, tmp_path):
    arguments = ("--filter", kind, "--snr-db", 20, "--pfa", "1e-2", "--cell", 4, "--scans", 20, "--runs", 300)
    found = numbers(*arguments, "-o", tmp_path / "out")
    assert 0 <= found["loss_share"] < 0.1
    assert found["runs"] == 300
    best = found["corrected" if kind == "psn" else "exact"]
    assert found["actual_kept"][-1] == pytest.approx(best[-1], rel=0.2)
    assert found == numbers(*arguments)
    assert (tmp_path / "out" / "prediction.png").read_bytes().startswith(b"\x89PNG")
    assert "300 runs" in run(*arguments)
    with pytest.raises(OutputError, match="not empty"):
        run(*arguments, "-o", tmp_path / "out")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--snr-db", 16, "--pfa", 2), "P_FA is 2"),
        (("--snr-db", 16, "--pfa", 0), "P_FA is 0"),
        (("--snr-db", 16, "--pfa", "nan"), "P_FA is nan"),
        (("--snr-db", "inf", "--pfa", 0.1), "--snr-db is inf"),
        (("--snr-db", 16, "--pfa", 0.1, "--gate", 0), "gate is 0"),
        (("--snr-db", 16, "--pfa", 0.1, "--q", "nan"), "q is nan"),
        (("--snr-db", 16, "--pfa", 0.1, "--weibull", "-1,2"), "shape is -1"),
    ],
)
def test_wrong_values_are_refused_in_one_line(arguments, message):
    with pytest.raises(ConfigError, match=message) as caught:
        run(*arguments)
    assert "\n" not in str(caught.value)
