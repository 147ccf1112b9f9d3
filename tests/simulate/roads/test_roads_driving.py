"""Car following and lane changes against what the models promise."""

import numpy as np
import pytest

from vidtrack.simulate.roads.driving import Drivers, equilibrium_gap, idm, worth_changing
from vidtrack.simulate.roads.history import CHANGE_S, moved, swerve

CAR = Drivers(*(np.array([value]) for value in (1.5, 2.0, 1.2, 2.0)))


def follow(v, gap, leader, seconds, v0=14.0, step=0.1):
    """Speed and gap after following a leader of constant speed; and the smallest gap on the way."""
    v, gap, least = np.array([v]), np.array([gap]), np.inf
    for _ in range(round(seconds / step)):
        a = np.maximum(idm(v, np.array([v0]), gap, v - leader, CAR), -v / step)
        s, v = moved(np.zeros(1), v, a, step)
        gap = gap + leader * step - s
        least = min(least, float(gap[0]))
    return float(v[0]), float(gap[0]), least


@pytest.mark.parametrize(("v", "gap"), [(14.0, 150.0), (14.0, 60.0), (5.0, 12.0)])
def test_a_driver_stops_before_a_standing_leader(v, gap):
    speed, left, least = follow(v, gap, 0.0, 120)
    assert speed < 0.05
    assert least > 1.5
    assert left == pytest.approx(2.0, abs=0.4)


@pytest.mark.parametrize("speed", [3.0, 8.0, 12.0])
@pytest.mark.parametrize("gap", [10.0, 40.0])
def test_a_driver_keeps_the_equilibrium_gap(speed, gap):
    v, left, _ = follow(speed, gap, speed, 300)
    assert v == pytest.approx(speed, abs=0.01)
    assert left == pytest.approx(equilibrium_gap(np.array([speed]), np.array([14.0]), CAR)[0], rel=0.01)


def test_on_a_free_road_a_driver_reaches_the_speed_he_wishes():
    v, _, _ = follow(0.0, np.inf, 0.0, 120)
    assert v == pytest.approx(14.0, rel=0.01)


def test_lanes_are_changed_when_it_pays_and_nobody_must_brake_hard():
    assert worth_changing((-1.0, 0.5), (0.0, -0.5), (0.0, 0.0), to_right=False)
    assert not worth_changing((-1.0, 0.5), (0.0, -2.5), (0.0, 0.0), to_right=False)
    assert not worth_changing((0.0, 0.3), (0.0, 0.0), (0.0, 0.0), to_right=False)
    assert worth_changing((0.0, 0.0), (0.0, 0.0), (0.0, 0.0), to_right=True)


def test_a_swerve_begins_and_ends_without_a_jerk_and_its_rate_is_its_derivative():
    t = np.linspace(-1, CHANGE_S + 1, 2001)
    offset, rate = swerve(np.full(len(t), 3.75), t)
    assert offset[0] == 3.75
    assert offset[-1] == 0
    assert np.gradient(offset, t) == pytest.approx(rate, abs=1e-3)
    assert np.abs(np.diff(rate)).max() < 0.01
