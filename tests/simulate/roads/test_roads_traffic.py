"""Whatever the seed, nobody drives through anybody, and the states are consistent."""

from functools import cache

import numpy as np
import pytest

from vidtrack.simulate.roads.scenarios import CROSSING_X, CYCLE_S, RED_S, ROADS
from vidtrack.simulate.roads.stage import footprints
from vidtrack.simulate.roads.traffic import drive
from vidtrack.simulate.scene import touching

LAYOUT = cache(lambda name: ROADS[name]())


@cache
def traffic(name, seed=0, seconds=20.0, factor=1.0):
    layout = LAYOUT(name)
    return drive(layout.network, factor * layout.flow, -30.0, seconds, np.random.default_rng(seed))


def overlaps(history, fleet, time):
    now = history.at(time)
    base = footprints(now.xy, now.heading, fleet.length[now.vehicle], fleet.width[now.vehicle])
    i, j = np.triu_indices(len(base), 1)
    near = np.linalg.norm(now.xy[i] - now.xy[j], axis=1) < 13
    return [] if not near.any() else np.flatnonzero(touching(base[i[near]], base[j[near]])).tolist()


@pytest.mark.parametrize("name", list(ROADS))
@pytest.mark.parametrize(("seed", "factor"), [(0, 1.0), (2, 1.7)])
def test_no_two_vehicles_ever_overlap_on_the_ground(name, seed, factor):
    end = 20.0 if name == "motorway" else 100.0
    history, fleet = traffic(name, seed, end, factor)
    assert len(fleet.kind) > 20
    for time in np.arange(-30, end, 0.25):
        assert overlaps(history, fleet, time) == [], (seed, time)


@pytest.mark.parametrize("name", list(ROADS))
def test_speed_and_heading_are_the_derivative_of_the_place(name):
    history, _ = traffic(name)
    h = 1e-4
    for time in np.arange(0.05, 20, 0.4):  # in the middle of a step
        now, before, after = (history.at(time + d) for d in (0, -h, h))
        assert np.array_equal(before.vehicle, after.vehicle)
        velocity = (after.xy - before.xy) / (2 * h)
        assert np.hypot(*velocity.T) == pytest.approx(now.speed, abs=0.01)
        fast = now.speed > 1
        turned = np.angle(np.exp(1j * (np.arctan2(velocity[:, 1], velocity[:, 0]) - now.heading)))
        assert np.abs(turned[fast]).max(initial=0) < 0.06  # chords of half a metre in curves


@pytest.mark.parametrize("name", list(ROADS))
def test_nobody_jumps_reverses_or_brakes_harder_than_tyres_can(name):
    history, _ = traffic(name)
    assert history.v.min() >= 0
    assert history.a.min() >= -8.0
    assert history.a.max() < 3.0
    before = history.at(0.0)
    for time in np.arange(0.04, 20, 0.04):
        now = history.at(time)
        _, i, j = np.intersect1d(before.vehicle, now.vehicle, return_indices=True)
        step = np.linalg.norm(now.xy[j] - before.xy[i], axis=1)
        assert (step <= 0.04 * np.maximum(now.speed[j], before.speed[i]) + 0.01).all()
        before = now


def test_nobody_drives_over_the_crossing_when_the_signal_has_been_red():
    history, fleet = traffic("road", 5, 120.0)
    for time in np.arange(0, 120, 0.2):
        if 6 < (time - 8.0) % CYCLE_S < RED_S:
            now = history.at(time)
            half = fleet.length[now.vehicle] / 2
            on = (now.xy[:, 0] + half > CROSSING_X[0]) & (now.xy[:, 0] - half < CROSSING_X[1])
            assert not on.any(), time


def test_the_minor_road_waits_for_the_major_one():
    history, _ = traffic("junction-3d", 1, 120.0)
    minor = np.array([route.start in ("north", "south") for route in LAYOUT("junction-3d").network.routes])
    slow = history.v < 0.5
    assert slow[minor[history.route]].mean() > 5 * slow[~minor[history.route]].mean()


@pytest.mark.parametrize("name", list(ROADS))
def test_vehicles_take_every_way_and_reach_its_end(name):
    history, _ = traffic(name, 0, 20.0 if name == "motorway" else 100.0)
    network = LAYOUT(name).network
    reached = {int(r) for r, s in zip(history.route, history.s, strict=True) if s > network.length[r] - 15}
    assert len(reached) > 0.5 * len(network.routes)


def test_on_the_motorway_lanes_are_changed_both_ways():
    history, _ = traffic("motorway", 0, 20.0)
    assert (history.aside > 3).any()
    assert (history.aside < -3).any()
    assert np.abs(history.aside[history.aside != 0]) == pytest.approx(3.75)


def test_the_flow_is_the_one_asked_for():
    counts = [len(traffic("road", seed, 330.0)[1].kind) for seed in range(4)]
    assert np.mean(counts) == pytest.approx(90, rel=0.15)
