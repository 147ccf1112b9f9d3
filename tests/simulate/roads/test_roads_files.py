"""The files of a road's clip, and its events against brute force."""

import csv
import tomllib
from functools import cache

import numpy as np
import pytest
from click.testing import CliRunner

from vidtrack.cli.simulate import command
from vidtrack.simulate import simulate_road
from vidtrack.simulate.roads.conflicts import time_to_collision
from vidtrack.simulate.roads.events import events, motion, picture_line
from vidtrack.simulate.roads.stage import footprints
from vidtrack.simulate.roads.write import site_toml, write_events, write_road
from vidtrack.simulate.scene import touching

SMALL = (640, 360)


@cache
def clip(name, **knobs):
    return simulate_road(name, seed=4, size=SMALL, seconds=30, fps=5, **knobs)


@cache
def found(name):
    return events(clip(name))


def of(kind, name):
    return [event for event in found(name) if event.event == kind]


@pytest.mark.parametrize("name", ["road", "junction-3d", "motorway"])
def test_crossings_agree_with_brute_force_in_the_picture(name):
    c = clip(name)
    ids = c.truth.ids(len(c.fleet.length))
    theirs = []
    for gate_name, gate in c.layout.gates.items():
        line = picture_line(c, gate_name, gate)
        a, b = np.array([line.x1, line.y1]), np.array([line.x2, line.y2])
        normal = np.array([a[1] - b[1], b[0] - a[0]])
        previous = {}
        for time in np.arange(0, c.times[-1], 0.02):
            now = c.history.at(float(time))
            xy = c.eye.project(np.column_stack([now.xy, np.zeros(len(now.xy))]))[0]
            for vehicle, point in zip(now.vehicle, xy, strict=True):
                side, along = (point - a) @ normal, (point - a) @ (b - a) / ((b - a) @ (b - a))
                if vehicle in previous and (previous[vehicle] >= 0) != (side >= 0) and 0 <= along <= 1:
                    theirs.append((gate_name, int(ids[vehicle]), line.directions[int(side >= 0)], time))
                previous[vehicle] = side
    ours = sorted((e.place, e.target_id, e.direction, e.time_s) for e in of("crossing", name))
    assert [row[:3] for row in ours] == [row[:3] for row in sorted(theirs)]
    assert [row[3] for row in ours] == pytest.approx([row[3] for row in sorted(theirs)], abs=0.021)
    assert len(ours) >= 5


def test_movements_are_those_of_the_routes():
    c = clip("junction-3d")
    ids = c.truth.ids(len(c.fleet.length))
    state = c.history
    ways = {int(ids[v]): c.layout.network.routes[r] for v, r in zip(state.vehicle, state.route, strict=True)}
    movements = of("movement", "junction-3d")
    assert len(movements) > 2
    for event in movements:
        assert (ways[event.target_id].start, ways[event.target_id].end) == (event.from_leg, event.to_leg)
        assert event.end_s > event.time_s


def test_a_queue_is_as_long_as_what_stands_before_the_line():
    c = clip("road")
    queues = of("queue", "road")
    assert queues
    event = max(queues, key=lambda queue: queue.vehicles)
    most, back = 0, 0.0
    for time in np.arange(event.time_s, event.end_s, 0.1):
        now = c.history.at(float(time))
        mine = np.array([c.layout.network.routes[r].start == event.from_leg for r in now.route])
        half = c.fleet.length[now.vehicle] / 2
        stop = c.layout.network.stop[now.route]
        seen = c.truth.vehicle[c.truth.boxes.frame == round(time * c.fps)]
        waits = mine & (3.6 * now.speed < 5) & (now.s + half <= stop) & np.isin(now.vehicle, seen)
        most = max(most, int(waits.sum()))
        back = max([back, *(stop - now.s + half)[waits]])
    assert event.vehicles == most
    assert event.length_m == pytest.approx(back, abs=0.1)


def test_time_to_collision_agrees_with_small_steps():
    rng = np.random.default_rng(0)
    n = 200
    a = footprints(rng.uniform(-10, 10, (n, 2)), rng.uniform(-3, 3, n), np.full(n, 4.5), np.full(n, 1.8))
    b = footprints(rng.uniform(-10, 10, (n, 2)), rng.uniform(-3, 3, n), np.full(n, 8.0), np.full(n, 2.5))
    relative = rng.uniform(-10, 10, (n, 2))
    times = np.arange(0, 4, 0.005)
    hit = np.stack([touching(a, b + t * relative[:, None]) for t in times], axis=1)
    first = np.where(hit.any(axis=1), times[hit.argmax(axis=1)], np.inf)
    ours = time_to_collision(a, b, relative)
    near = first < 3.9
    assert near.sum() > 40
    assert ours[near] == pytest.approx(first[near], abs=0.006)
    assert (ours[~near] > 3.5).all()


def test_post_encroachment_is_between_two_vehicles_at_one_place():
    c = clip("junction-3d")
    moved, ids = motion(c), c.truth.ids(len(c.fleet.length))
    crossing = [event for event in of("conflict", "junction-3d") if event.pet_s is not None]
    assert crossing
    for event in crossing:
        late, early = (int(np.flatnonzero(ids == i)[0]) for i in (event.target_id, event.other_id))
        k = int(np.argmin(np.abs(moved.time - event.time_s)))
        before = k - round(event.pet_s / 0.04)
        base = [
            footprints(moved.xy[n, [v]], moved.heading[n, [v]], c.fleet.length[[v]], c.fleet.width[[v]])
            for n, v in ((k, late), (before, early))
        ]
        assert touching(*base).all()


@pytest.mark.parametrize(
    ("name", "lens"), [("road", 0.0), ("junction-3d", -0.2), ("roundabout", 0.1), ("motorway", 0.0)]
)
def test_the_site_says_what_the_camera_is_up_to_its_errors(name, lens):
    c = clip(name, lens=lens, click_sigma=0.5)
    site = tomllib.loads(site_toml(c))
    assert (site["site"]["width"], site["site"]["height"]) == SMALL
    assert site["site"]["start"].utcoffset() is not None
    given = site["calibration"]
    picture, ground = np.array(given["picture"]) + 0.5, np.array(given["ground"])
    off = picture - c.eye.project(np.column_stack([ground, np.zeros(len(ground))]))[0]
    assert len(ground) >= 6
    assert 0.2 < off.std() < 1.5
    assert ("distortion" in given) == (lens != 0)
    for gate in site["gates"].values():
        assert gate["role"] in ("entry", "exit")
        assert (np.array(gate["line"]) >= -0.5).all()
        assert (np.array(gate["line"]) <= SMALL).all()
    for zone in site["zones"].values():
        assert (np.array(zone["polygon"]) >= 0).all()
        assert (np.array(zone["polygon"]) <= SMALL).all()
    for section in site.get("sections", {}).values():
        ends = [np.mean(site["gates"][section[key]]["line"], axis=0) + 0.5 for key in ("from", "to")]
        where = c.eye.on_ground(np.array(ends))
        assert np.linalg.norm(where[0] - where[1]) == pytest.approx(section["length_m"], rel=0.2)
    assert all(
        leg in {g["leg"] for g in site["gates"].values()} for pair in site["movements"]["allowed"] for leg in pair
    )


def test_the_command_writes_five_files_that_belong_together(tmp_path):
    arguments = [
        "road",
        "-o",
        str(tmp_path),
        "--size",
        "320x180",
        "--seconds",
        "4",
        "--seed",
        "2",
        "--quiet",
        "--force",
    ]
    assert CliRunner().invoke(command, arguments).exit_code == 0
    names = ["gt.txt", "road_events.csv", "road_truth.csv", "site.toml", "video.avi"]
    assert sorted(path.name for path in tmp_path.iterdir()) == names
    with (tmp_path / "road_truth.csv").open() as file:
        truth = list(csv.DictReader(file))
    boxes = np.loadtxt(tmp_path / "gt.txt", delimiter=",")
    assert [[int(row["frame"]), int(row["target_id"])] for row in truth] == boxes[:, :2].astype(int).tolist()
    before = {name: (tmp_path / name).read_bytes() for name in names}
    assert CliRunner().invoke(command, arguments).exit_code == 0
    assert all((tmp_path / name).read_bytes() == before[name] for name in names)


def test_an_event_is_a_row_with_empty_cells_where_a_column_does_not_apply(tmp_path):
    write_events(tmp_path / "events.csv", found("road"))
    with (tmp_path / "events.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(found("road"))
    assert {row["event"] for row in rows} >= {"crossing", "queue"}
    assert all((row["place"] == "") == (row["event"] != "crossing") for row in rows)
    times = [float(row["time_s"]) for row in rows]
    assert times == sorted(times)


@pytest.mark.parametrize(
    "arguments",
    [
        ["junction", "--flow", "100"],
        ["crossing", "--lens", "-0.1"],
        ["road", "--leaves", "2"],
        ["road", "--snr-db", "9"],
        ["radar-tws", "--tilt-deg", "20"],
    ],
)
def test_an_option_of_another_kind_of_scenario_is_refused(arguments):
    result = CliRunner().invoke(command, arguments)
    assert result.exit_code == 2
    assert f"{arguments[1]} does nothing for {arguments[0]}" in result.output


def test_a_clip_without_vehicles_has_empty_tables(tmp_path):
    empty = simulate_road("road", seed=0, size=(160, 90), seconds=1, flow=1)
    write_road(empty, tmp_path)
    assert (tmp_path / "gt.txt").read_text() == ""
    assert len((tmp_path / "road_truth.csv").read_text().splitlines()) == 1
