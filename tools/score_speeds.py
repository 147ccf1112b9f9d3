"""Speeds, lengths and classes at drawn sites, against their exact truth.

    python tools/score_speeds.py --sites 100 --first 0 -o DIR

Each site has a straight road of two lanes before a camera 8 m high (1280x720, 25 frames/s, horizontal view 50 to 70
degrees), 8 calibration points with errors of 1 px, one gate, and vehicles of 20 to 80 km/h. The clip is tracked and
measured as a user would do it (`vidtrack track --site`, `vidtrack measure`). A crossing counts where the vehicle is
whole in the picture, 15 to 60 m away, over at least 15 m of path around the gate. Finished sites in DIR are not drawn
again.
"""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from vidtrack.simulate.camera import camera
from vidtrack.simulate.conditions import Conditions
from vidtrack.simulate.ground import ASPHALT, KERB
from vidtrack.simulate.roads.clip import FPS, SIZE, RoadClip
from vidtrack.simulate.roads.layout import EAST, LANE_M, MARK_M, GroundGate, Layout, at
from vidtrack.simulate.roads.network import Network, Route, smooth
from vidtrack.simulate.roads.pinhole import Pinhole, pinhole
from vidtrack.simulate.roads.traffic import drive
from vidtrack.simulate.roads.write import write_road
from vidtrack.traffic.measures.measure import measured
from vidtrack.traffic.site import read_site

SECONDS, HEIGHT_M, FLOW = 9.0, 8.0, 1200.0
NEAR_M, FAR_M, PATH_M, LEAST_REACH_M = 15.0, 60.0, 15.0, 25.0
GATE_M = 3.8  # half the length of the gate
SLOWEST, FASTEST = 20.0, 80.0  # km/h
TOLERANCE_S, FAR = 1.0, 1e3
HEAVY = ("lorry", "bus")


def shown(eye: Pinhole, aside: float) -> np.ndarray:
    """(N,) m along the road where the camera shows both of its edges, 15 to 60 m away (12 m: vehicles are long)."""
    x = np.arange(0, 80, 0.5)
    edges = [eye.shows(np.column_stack([x, np.full(len(x), side)]), SIZE) for side in (-GATE_M, GATE_M)]
    away = np.hypot(x, aside)
    return x[edges[0] & edges[1] & (away > NEAR_M - 3) & (away < FAR_M)]


def drawn(seed: int) -> RoadClip:
    """A site and its traffic; the road runs east, the camera stands south of it and looks along it."""
    rng, traffic_rng, camera_rng = np.random.default_rng(seed).spawn(3)
    reach = np.zeros(0)
    while len(reach) == 0 or np.ptp(reach) < LEAST_REACH_M:
        view, azimuth, aside = np.radians(rng.uniform(50, 70)), np.radians(rng.uniform(8, 45)), rng.uniform(5, 12)
        tilt = np.radians(rng.uniform(13, 19))
        away = HEIGHT_M / np.tan(tilt)
        aim = away * np.cos(azimuth), away * np.sin(azimuth) - aside
        eye = pinhole(aim, azimuth, tilt, HEIGHT_M, SIZE, view, 0.0)
        reach = shown(eye, aside)
    begin, end = reach[0], reach[-1]
    far, y = 150.0, LANE_M / 2
    gate_x = rng.uniform(begin + 0.25 * (end - begin), begin + 0.75 * (end - begin))
    limits = rng.uniform(25, 75, 2) / 3.6
    lanes = [
        Route(smooth([(-far, -y), (far, -y)], 2), "west", "east", "west", limits[0]),
        Route(smooth([(far, y), (-far, y)], 2), "east", "west", "east", limits[1]),
    ]
    ground = (
        EAST.patch(KERB, -far, far, -3.9, 3.9),
        EAST.patch(ASPHALT, -far, far, -3.75, 3.75),
        *EAST.dashes(-far, far, 0, 3, 6, MARK_M),
    )
    survey = [(a, b) for a in np.linspace(begin, end, 4) for b in (-3.75, 3.75)]
    gates = {"gate": GroundGate(at((gate_x, -GATE_M), (gate_x, GATE_M)), "road", "neutral")}
    layout = Layout(Network(lanes), ground, gates, {}, {}, np.array(survey), aim, azimuth, tilt, flow=FLOW, warm_s=60.0)
    times = np.arange(round(SECONDS * FPS)) / FPS
    history, fleet = drive(layout.network, FLOW, -layout.warm_s, float(times[-1]), traffic_rng)
    picture = camera(SIZE, SIZE, times, camera_rng, noise=2.0, shake=0.0, light_steps=0)
    up, towards = np.radians(rng.uniform(38, 60)), rng.uniform(0, 2 * np.pi)
    sun = np.array([np.cos(up) * np.cos(towards), np.cos(up) * np.sin(towards), np.sin(up)])
    return RoadClip("drawn", layout, eye, picture, FPS, times, seed, Conditions(), history, fleet, sun, 1.0)


def make(folder: Path, seed: int) -> None:
    """Draw the site's clip and track it, unless that has been done."""
    if not (folder / "site.toml").is_file():
        folder.mkdir(parents=True, exist_ok=True)
        clip = drawn(seed)
        write_road(clip, folder)
        text = (folder / "site.toml").read_text(encoding="utf-8").split("[classes]")[0]
        (folder / "site.toml").write_text(text, encoding="utf-8")
        (folder / "camera.json").write_text(json.dumps(clip.eye.position.tolist()))
    if not (folder / "run" / "summary.json").is_file():
        video, site, run = (str(folder / name) for name in ("video.avi", "site.toml", "run"))
        command = [sys.executable, "-m", "vidtrack", "track", video, "--site", site, "-o", run]
        subprocess.run(command, check=True, capture_output=True)


@dataclass(frozen=True)
class Passing:
    """A vehicle at the gate: true and measured speed [km/h], standard deviations own and shared, true and measured
    class, true and measured length [m]; NaN and "" where nothing was found or stated."""

    true: float
    speed: float
    own: float
    shared: float
    kind: str
    found: str
    true_length: float
    length: float


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def passings(folder: Path) -> list[Passing]:
    """The true crossings that count, each with the measured one that is nearest in time."""
    states, eye = rows_of(folder / "road_truth.csv"), json.loads((folder / "camera.json").read_text())
    boxes = np.loadtxt(folder / "gt.txt", delimiter=",", ndmin=2)[:, 2:6]
    whole = (boxes[:, :2] > 1).all(axis=1) & (boxes[:, :2] + boxes[:, 2:] < np.array(SIZE) - 1).all(axis=1)
    target = np.array([int(row["target_id"]) for row in states])
    xy = np.array([[float(row["x_m"]), float(row["y_m"])] for row in states])
    away = np.hypot(*(xy - eye[:2]).T)
    near = whole & (away > NEAR_M) & (away < FAR_M)
    crossings = measured([str(folder / "run")], read_site(folder / "site.toml")).tables["crossings"].to_pylist()
    events = [row for row in rows_of(folder / "road_events.csv") if row["event"] == "crossing"]
    off = np.array(
        [
            [abs(row["time_s"] - float(event["time_s"])) if row["direction"] == event["direction"] else np.inf
             for row in crossings]
            for event in events
        ]
    ).reshape(len(events), len(crossings))  # fmt: skip
    pairs = dict(zip(*linear_sum_assignment(np.where(off < TOLERANCE_S, off, FAR)), strict=True))
    found = []
    for k, event in enumerate(events):
        own = np.flatnonzero(near & (target == int(event["target_id"])))
        if not SLOWEST <= float(event["speed_kmh"]) <= FASTEST or len(own) < 2:
            continue
        time = [float(states[row]["time_s"]) for row in (own[0], own[-1])]
        path = np.linalg.norm(xy[own[-1]] - xy[own[0]])
        if path < PATH_M or not time[0] <= float(event["time_s"]) <= time[1]:
            continue
        state, best = states[own[0]], {}
        if k in pairs and off[k, pairs[k]] < TOLERANCE_S:
            best = crossings[pairs[k]]
        number = {name: np.nan if best.get(name) is None else best[name] for name in _NUMBERS}
        kind = "lorry or bus" if state["class"] in HEAVY else _NAMES.get(state["class"], state["class"])
        speed, sigma, shared, length = number.values()
        found.append(
            Passing(float(event["speed_kmh"]), speed, sigma, shared, kind, best.get("class") or "",
                    float(state["length_m"]), length)
        )  # fmt: skip
    return found


_NUMBERS = ("speed_kmh", "speed_sigma_kmh", "speed_shared_sigma_kmh", "length_m")
_NAMES = {"motorcycle": "motorcycle or bicycle"}


def told(sites: list[list[Passing]]) -> None:
    """Print the figures."""
    rows = [row for site in sites for row in site]
    found = [row for row in rows if row.found]
    speeds = [[row for row in site if np.isfinite(row.speed)] for site in sites]
    pooled = [row for site in speeds for row in site]
    error = np.array([row.speed - row.true for row in pooled])
    sigma = np.array([np.hypot(row.own, row.shared) for row in pooled])
    inside = np.abs(error) <= 1.96 * sigma
    means = [np.mean([abs(row.speed - row.true) for row in site]) for site in speeds if site]
    print(f"{len(sites)} sites, {len(rows)} vehicles, {len(found)} found, {len(pooled)} with a speed")
    print(
        f"speed: mean absolute error {np.abs(error).mean():.2f} km/h, median {np.median(np.abs(error)):.2f}, "
        f"95 % {np.quantile(np.abs(error), 0.95):.2f}, largest {np.abs(error).max():.1f}; "
        f"mean error {error.mean():+.2f}; within 95 % interval {inside.mean():.3f}; median sigma {np.median(sigma):.2f}"
    )
    print(f"mean absolute errors of sites: median {np.median(means):.2f}, 90 % {np.quantile(means, 0.9):.2f}")
    known = [row for row in found if row.found != "unknown"]
    right = sum(row.found == row.kind for row in known)
    length = np.array([row.length - row.true_length for row in known])
    print(
        f"class: right {right / len(known):.3f} of {len(known)} known, {1 - len(known) / len(found):.3f} unknown; "
        f"length: mean absolute error {np.nanmean(np.abs(length)):.2f} m, mean {np.nanmean(length):+.2f} m"
    )
    table = Counter((row.kind, row.found) for row in found)
    print("true class: measured as")
    for kind in sorted({kind for kind, _ in table}):
        counts = (f"{name} {count}" for (one, name), count in sorted(table.items()) if one == kind)
        print(f"  {kind}: {', '.join(counts)}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0, help="seed of the first site")
    parser.add_argument("--sites", type=int, default=100)
    parser.add_argument("-o", dest="folder", type=Path, required=True)
    options = parser.parse_args()
    sites = []
    for seed in range(options.first, options.first + options.sites):
        make(options.folder / str(seed), seed)
        sites.append(passings(options.folder / str(seed)))
    told(sites)


if __name__ == "__main__":
    main()
