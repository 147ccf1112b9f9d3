import json

import numpy as np
import pytest
from click.testing import CliRunner

from vidtrack.amplitude.densities import detection_probability
from vidtrack.amplitude.reduction import q2
from vidtrack.cli.threshold import command
from vidtrack.errors import ConfigError


def run(*arguments):
    outcome = CliRunner().invoke(command, [str(argument) for argument in arguments], catch_exceptions=False)
    assert outcome.exit_code == 0, outcome.output
    return outcome.stdout


def numbers(*arguments):
    return json.loads(run(*arguments, "--json", "-"))


def test_json_has_the_closed_form_and_the_exact_optimum():
    found = numbers("--snr-db", 10, "--cells", 1000)
    assert list(found) == ["p_fa", "p_fa_exact", "p_d", "q2", "clamped"]
    assert found["p_fa"] == pytest.approx(8.399434016146147e-05, rel=1e-9)
    assert found["p_fa_exact"] == pytest.approx(6.22496282692639e-05, rel=1e-6)
    assert found["p_d"] == pytest.approx(0.42606638834271526, rel=1e-9)
    assert found["q2"] == pytest.approx(0.3548089069026351, rel=1e-9)
    assert found["clamped"] is False


@pytest.mark.parametrize("db", [-300, -10, 0, 1.9])
def test_below_the_validity_of_the_closed_form_it_is_clamped(db):
    found = numbers("--snr-db", db, "--cells", 100, "--pfa-max", 0.5)
    assert (found["p_fa"], found["clamped"]) == (0.5, True)
    assert 0 < found["p_fa_exact"] <= 0.5
    assert 0 <= found["q2"] <= found["p_d"] <= 1


def test_strongest_neighbour_prefers_the_lowest_threshold_and_says_what_is_enough():
    found = numbers("--filter", "psn", "--snr-db", 16, "--pfa-max", 0.1)
    assert (found["p_fa"], found["clamped"]) == (0.1, True)
    assert found["error"] == pytest.approx(1.41732803, rel=1e-6)
    assert found["p_fa_one_percent"] < 1e-3


@pytest.mark.parametrize("gate", [2.5, 3, 5])
def test_other_gates_have_the_exact_optimum_and_no_closed_form(gate):
    found = numbers("--snr-db", 10, "--cells", 100, "--gate", gate)
    assert list(found) == ["p_fa_exact", "p_d", "q2", "clamped"]
    around = found["p_fa_exact"] * np.array([0.9, 1.0, 1.1])
    q = q2(detection_probability(around, 10.0), 100 * around, gate=gate)
    assert q.argmax() == 1
    assert found["q2"] == pytest.approx(q[1], rel=1e-9)


def test_a_prediction_without_end_is_null():
    found = numbers("--filter", "psn", "--snr-db", 16, "--weibull", "1,1")
    assert found["error"] is None


def test_table_and_file(tmp_path):
    table = run("--snr-db", 10, "--cells", 100, "--json", tmp_path / "t.json")
    assert f"{json.loads((tmp_path / 't.json').read_text())['p_fa']:.6g}" in table


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--snr-db", "nan", "--cells", 10), "--snr-db is nan"),
        (("--snr-db", 10), "--cells is None"),
        (("--snr-db", 10, "--cells", 0), "--cells is 0"),
        (("--snr-db", 10, "--cells", 10, "--pfa-max", 2), "--pfa-max is 2"),
        (("--snr-db", 10, "--cells", 10, "--gate", 0), "gate is 0"),
        (("--snr-db", 10, "--filter", "psn", "--weibull", "-1,2"), "shape is -1"),
        (("--snr-db", 10, "--filter", "psn", "--cell", -1), "cell volume is -1"),
    ],
)
def test_wrong_values_are_refused_in_one_line(arguments, message):
    with pytest.raises(ConfigError, match=message) as caught:
        run(*arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["a,b", "1", "1,2,3"])
def test_clutter_that_is_no_pair_of_numbers_is_refused(text):
    outcome = CliRunner().invoke(command, ["--snr-db", "10", "--filter", "psn", "--weibull", text])
    assert outcome.exit_code == 2
    assert f"'{text}' is not two numbers B,C" in outcome.output


@pytest.mark.parametrize(
    ("arguments", "option"),
    [
        (("--cells", "10", "--cell", "0.1"), "--cell"),
        (("--cells", "10", "--q", "0.2"), "--q"),
        (("--cells", "10", "--weibull", "1,1"), "--weibull"),
        (("--filter", "psn", "--cells", "10"), "--cells"),
    ],
)
def test_options_without_effect_on_the_filter_are_refused(arguments, option):
    outcome = CliRunner().invoke(command, ["--snr-db", "10", *arguments])
    assert outcome.exit_code == 2
    assert f"{option} has no effect with --filter" in outcome.output
