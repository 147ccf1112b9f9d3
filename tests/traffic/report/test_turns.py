"""Left, through and right from the gates."""

import numpy as np
import pytest
from made_up_day import CALIBRATION, SITE

from vidtrack.traffic.report.turns import LEFT, RIGHT, THROUGH, U_TURN, drawn, turns
from vidtrack.traffic.site import Site, read_site

ROUND = ("north", "east", "south", "west")  # clockwise


@pytest.mark.parametrize("calibration", ["", CALIBRATION])
def test_at_a_crossroads(tmp_path, calibration):
    (tmp_path / "site.toml").write_text(SITE.format(name="cross", calibration=calibration))
    found = turns(drawn(read_site(tmp_path / "site.toml")))
    turn = (U_TURN, LEFT, THROUGH, RIGHT)  # to the next leg clockwise one turns left: from the north to the east
    for i, start in enumerate(ROUND):
        for j, end in enumerate(ROUND):
            assert found[start, end] == turn[(j - i) % 4]


def gate(angle_deg, role, leg, turned=0.0):
    """A gate square to the ray at this angle from the middle, counter-clockwise from the right of the picture."""
    a, b = np.radians([angle_deg, angle_deg + 90 + turned])
    middle = np.array([500 + 200 * np.cos(a), 500 - 200 * np.sin(a)])
    half = 30 * np.array([np.cos(b), -np.sin(b)])
    return {"line": [tuple(middle - half), tuple(middle + half)], "role": role, "leg": leg}


def site(**gates):
    return Site.model_validate({"site": {"name": "s", "width": 1000, "height": 1000}, "gates": gates})


@pytest.mark.parametrize(
    ("exit_deg", "turn"),
    [(180, THROUGH), (221, THROUGH), (229, LEFT), (270, LEFT), (139, THROUGH), (131, RIGHT), (60, RIGHT)],
)
def test_forty_five_degrees_part_through_from_turns(exit_deg, turn):
    """Two gates far apart and their mirror images keep the middle of the site where it is."""
    four = {
        "a": gate(0, "entry", "from"),
        "b": gate(exit_deg, "exit", "to"),
        "c": gate(180, "entry", "other"),
        "d": gate(exit_deg + 180, "exit", "another"),
    }
    assert turns(drawn(site(**four)))["from", "to"] == turn


def test_a_gate_may_be_drawn_either_way_round():
    one = gate(0, "entry", "from")
    back = {**one, "line": one["line"][::-1]}
    for first in (one, back):
        assert turns(drawn(site(a=first, b=gate(180, "exit", "to"))))["from", "to"] == THROUGH


def test_a_gate_in_the_middle_of_the_site_tells_no_turn():
    assert turns(drawn(site(only=gate(0, "both", "only")))) == {}
