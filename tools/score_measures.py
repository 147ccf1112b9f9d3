"""Score `vidtrack measure` against the exact events of simulated roads.

    python tools/score_measures.py CLIP... [--uncalibrated | --reach 45]

Each CLIP is a folder of `vidtrack simulate road|junction-3d|roundabout|motorway`; with tracks in CLIP/run (`vidtrack
track CLIP/video.avi --site CLIP/site.toml -o CLIP/run`) these are scored as well. First the exact states are measured
as if they were tracks: what is missed then is missed by the geometry. With --uncalibrated only the tracks are scored,
without the site's calibration: positions are in pixels, and speeds are means over the site's sections. With --reach
each site, of a junction or roundabout, has calibration points up to so many metres along its legs besides, and the
video is tracked again with it.

A crossing is found by one of the same gate and direction within 1 s, one to one; a movement by a complete trip of the
same legs whose two times are within 1 s; a conflict by one within 1 s whose place is within 15 m of the second vehicle,
of several that of the nearest times of both vehicles.
Conflicts whose vehicles the border of the picture cuts are in the exact states and not in the events.

The bounds of a count hold if the true number of crossings of that gate, in that direction and in the whole clip, lies
within them; gates that nobody passes and nobody was counted at are left out.

A queue is found by those of the same leg at an overlapping time; that with most vehicles tells how many there were. One
that overlaps with none is false. In the events vehicles before the stop line queue, in the measures all that stand on
their way in from a leg. Vehicles that stand in the first picture are not seen before they move, so queues are also
told without those that begin there.
"""

from __future__ import annotations

import argparse
import csv
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
from exact_run import write_exact_run
from scipy.optimize import linear_sum_assignment

from vidtrack.simulate.roads.layout import ARMS
from vidtrack.simulate.roads.scenarios import ROADS
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.measures.measure import measured
from vidtrack.traffic.site import Calibration, Report, Site, read_site

TOLERANCE_S, TOLERANCE_M = 1.0, 15.0
FPS = 25.0
SIZE = (1280, 720)
BESIDE_M, ALONG_M = 4.6, (19.0, 21.0, 23.0, 25.0, 35.0, 45.0)  # of points beside the legs: the edges of the road


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def exact_run(clip: Path, folder: Path) -> None:
    """A run whose tracks are the exact states."""
    states = rows_of(clip / "road_truth.csv")
    column = {name: np.array([float(row[name]) for row in states]) for name in states[0] if name != "class"}
    boxes = np.loadtxt(clip / "gt.txt", delimiter=",", ndmin=2)[:, 2:6]
    names = ("time_s", "x_m", "y_m", "speed_kmh", "length_m", "width_m")
    exact = {name: column[name] for name in names}
    exact |= {"track_id": column["target_id"], "heading_deg": 90 - column["heading_deg"]}
    write_exact_run(folder, exact, boxes, FPS, SIZE, float(column["time_s"].max()))


def paired(truth: list[tuple], found: list[tuple]) -> list[tuple[int, int]]:
    """Pairs of (place, times...): the same place, all times within the tolerance; as many as possible, then nearest."""
    cost = np.full((len(truth), len(found)), 1e3)
    for i, (place, *times) in enumerate(truth):
        for j, (other, *others) in enumerate(found):
            off = np.abs(np.array(times) - others).max()
            if place == other and off <= TOLERANCE_S:
                cost[i, j] = off
    rows, columns = linear_sum_assignment(cost)
    return [(i, j) for i, j in zip(rows, columns, strict=True) if cost[i, j] < 1e3]


def conflicts(clip: Path, events: list[dict[str, str]], rows: list[dict], site: Site) -> dict[str, Any]:
    """Conflicts: how many there were, were found, and were right; errors of the post-encroachment times [s].

    `near` and `near_met` are of vehicles that were both within the calibration's points.
    """
    true = [event for event in events if event["event"] == "conflict"]
    states = {(int(row["target_id"]), int(row["frame"])): row for row in rows_of(clip / "road_truth.csv")}
    near = np.array([within_points(site, states, event) for event in true], bool)
    cost = np.full((len(true), len(rows)), 1e3)
    for i, event in enumerate(true):
        at = states.get((int(event["target_id"]), round(float(event["time_s"]) * FPS) + 1))
        for j, row in enumerate(rows):
            kind = "ttc" if row["pet_s"] is None else "pet"
            late = abs(float(event["time_s"]) - row["time_s"])
            if at is None or late > TOLERANCE_S:
                continue
            if event["pet_s"] and row["pet_s"] is not None:  # the first vehicle, too, was there at that time
                late += abs(float(event["pet_s"]) - row["pet_s"])
            far = np.hypot(float(at["x_m"]) - row[f"{kind}_x_m"], float(at["y_m"]) - row[f"{kind}_y_m"])
            cost[i, j] = late if far < TOLERANCE_M else 1e3
    pairs = [(i, j) for i, j in zip(*linear_sum_assignment(cost), strict=True) if cost[i, j] < 1e3]
    both = [(i, j) for i, j in pairs if true[i]["pet_s"] and rows[j]["pet_s"] is not None]
    pet = np.array([rows[j]["pet_s"] - float(true[i]["pet_s"]) for i, j in both])
    sigma = np.array([rows[j]["pet_sigma_s"] for _, j in both])
    met = [i for i, _ in pairs]
    return {
        "close": len(true),
        "said": len(rows),
        "met": len(pairs),
        "near": int(near.sum()),
        "near_met": int(near[met].sum()),
        "pet": pet,
        "pet_sigma": sigma,
    }


def within_points(site: Site, states: dict[tuple[int, int], dict[str, str]], event: dict[str, str]) -> bool:
    """Whether both vehicles of a conflict are within the hull of the calibration's points when they count."""
    second_s = float(event["time_s"])
    first_s = second_s - float(event["pet_s"] or 0)
    moments = [(int(event["target_id"]), second_s), (int(event["other_id"]), first_s)]
    rows = [states.get((vehicle, round(time_s * FPS) + 1)) for vehicle, time_s in moments]
    if site.calibration is None or None in rows:
        return False
    ground = calibrated(site)
    places = np.array([[float(row["x_m"]), float(row["y_m"])] for row in rows if row])
    return bool(np.isfinite(ground.inside(ground.pixels(places))).all())


def queues(events: list[dict[str, str]], rows: list[dict]) -> dict[str, Any]:
    """Queues of the events: when each began [s], and by how many vehicles the measured one differs; how many are false.

    NaN: no queue was measured there just then.
    """
    true = [event for event in events if event["event"] == "queue"]
    spans = [(event["from_leg"], float(event["time_s"]), float(event["end_s"])) for event in true]
    others = [(row["leg"], row["begin_s"], row["end_s"]) for row in rows]
    meet = np.array([[a == d and b <= f and e <= c for d, e, f in others] for a, b, c in spans], bool)
    meet = meet.reshape(len(spans), len(others))
    vehicles = np.array([row["vehicles"] for row in rows], float)
    most = np.where(meet, vehicles, -np.inf).max(axis=1, initial=-np.inf)
    there = np.array([float(event["vehicles"]) for event in true])
    return {
        "queued_s": np.array([begin for _, begin, _ in spans]),
        "queue_off": np.where(most > 0, most - there, np.nan),
        "false_queues": int((~meet.any(axis=0)).sum()),
    }


def bounds(true: list[dict[str, str]], rows: list[dict]) -> dict[str, int]:
    """Gates and directions that somebody passed or was counted at, and at how many the bounds of the count hold."""
    passed = Counter((event["place"], event["direction"]) for event in true)
    whole = [(passed[row["gate"], row["direction"]], row) for row in rows if row["begin_s"] <= 0]
    busy = [(there, row) for there, row in whole if there or row["count"]]
    return {"ways": len(busy), "held": sum(row["count_low"] <= there <= row["count_high"] for there, row in busy)}


def tracked(clip: Path, run: Path, event: dict[str, str]) -> bool:
    """Whether a track lies on the vehicle of an event at that time, with an IoU of 0.3 or more."""
    boxes = np.loadtxt(clip / "gt.txt", delimiter=",", ndmin=2)
    frame = round(float(event["time_s"]) * FPS)
    true = boxes[(boxes[:, 0] == frame + 1) & (boxes[:, 1] == int(event["target_id"])), 2:6]
    table = pq.read_table(run / "tracks.parquet")
    there = np.abs(table["time_s"].to_numpy() - frame / FPS) < 0.5 / FPS
    box = np.column_stack([table[f"{name}_px"].to_numpy() for name in ("left", "top", "width", "height")])[there]
    for left, top, width, height in true:
        wide = np.minimum(box[:, 0] + box[:, 2], left + width) - np.maximum(box[:, 0], left)
        high = np.minimum(box[:, 1] + box[:, 3], top + height) - np.maximum(box[:, 1], top)
        common = np.maximum(wide, 0) * np.maximum(high, 0)
        if (common >= 0.3 * (width * height + box[:, 2] * box[:, 3] - common)).any():
            return True
    return False


def reaching(clip: Path, reach_m: float) -> str:
    """The text of the clip's site with more points, along its legs, where its camera has them in the picture.

    Its gates tell the camera: they are in the picture without errors, and the scenario has them on the ground.
    """
    site, text = read_site(clip / "site.toml"), (clip / "site.toml").read_text(encoding="utf-8")
    assert site.calibration is not None
    gates = ROADS[site.camera.name]().gates
    known = {  # two gates may share a corner
        corner: at
        for name, gate in site.gates.items()
        for corner, at in zip((gate.line[0], gate.line[-1]), gates[name].line.tolist(), strict=True)
    }
    lens = site.calibration.model_dump(include={"distortion", "focal_px", "center"})
    exact = Calibration(picture=tuple(known), ground=tuple(known.values()), sigma_picture_px=0.01, **lens)
    eye = calibrated(site.model_copy(update={"calibration": exact}))
    along = [metres for metres in ALONG_M if metres <= reach_m]
    more = np.array([arm(metres, side) for metres in along for arm in ARMS.values() for side in (-BESIDE_M, BESIDE_M)])
    px = eye.pixels(more)
    shown = (px >= 0).all(axis=1) & (px <= np.array(SIZE) - 1).all(axis=1)
    for name, points in (("picture", px[shown].round(2)), ("ground", more[shown].round(3))):
        text = re.sub(rf"(?m)^({name} = \[.*)\]$", rf"\1, {str(points.tolist())[1:-1]}]", text, count=1)
    return text


def tracked_again(clip: Path, site: Path, folder: Path) -> Path:
    """The run of the clip's video with another site, in a new folder."""
    again = [sys.executable, "-m", "vidtrack", "track", clip / "video.avi", "--site", site, "-o", folder, "-q"]
    subprocess.run([*map(str, again)], check=True, stdout=subprocess.DEVNULL)
    return folder


def score(clip: Path, run: Path, site: Site) -> dict[str, Any]:
    """Crossings and movements: how many there were, were found, and were right; errors of speed [km/h]."""
    events = rows_of(clip / "road_events.csv")
    seconds = round(float(rows_of(clip / "road_truth.csv")[-1]["time_s"])) or 1
    found = measured([str(run)], site.model_copy(update={"report": Report(interval_s=seconds)})).tables
    crossings, trips = found["crossings"].to_pylist(), found["trips"].to_pylist()
    true = [event for event in events if event["event"] == "crossing"]
    pairs = paired(
        [((event["place"], event["direction"]), float(event["time_s"])) for event in true],
        [((row["gate"], row["direction"]), row["time_s"]) for row in crossings],
    )
    off, sigma = [], []
    for i, j in pairs:
        row = crossings[j]
        if row["speed_kmh"] is not None:
            off.append(row["speed_kmh"] - float(true[i]["speed_kmh"]))
            sigma.append(np.hypot(row["speed_sigma_kmh"], row["speed_shared_sigma_kmh"]))
    moved = [event for event in events if event["event"] == "movement"]
    whole = [row for row in trips if row["complete"]]
    right = paired(
        [((event["from_leg"], event["to_leg"]), float(event["time_s"]), float(event["end_s"])) for event in moved],
        [((row["from_leg"], row["to_leg"]), row["begin_s"], row["end_s"]) for row in whole],
    )
    return {
        "true": len(true),
        "found": len(crossings),
        "hit": len(pairs),
        "movements": len(moved),
        "trips": len(whole),
        "right": len(right),
        **bounds(true, found["intervals"].to_pylist()),
        "untracked": sum(not tracked(clip, run, true[i]) for i in set(range(len(true))) - {i for i, _ in pairs}),
        "off": np.array(off),
        "sigma": np.array(sigma),
        **conflicts(clip, events, found["conflicts"].to_pylist() if "conflicts" in found else [], site),
        **queues(events, found["queues"].to_pylist()),
    }


def told(name: str, results: list[dict[str, Any]]) -> str:
    counts = ("true", "found", "hit", "ways", "held", "movements", "trips", "right")
    counts += ("untracked", "close", "said", "met", "near", "near_met")
    total = {key: max(sum(result[key] for result in results), 1e-9) for key in counts}
    off, sigma, pet, pet_sigma = (
        np.concatenate([result[key] for result in results]) for key in ("off", "sigma", "pet", "pet_sigma")
    )
    late = "|"
    if len(pet):
        covered = np.mean(np.abs(pet) <= 1.96 * pet_sigma)
        late = f"{np.median(pet):+.2f}, {np.median(np.abs(pet)):.2f} | {covered:.2f}"
    speeds = "| |"
    if len(off):
        inside = np.mean(np.abs(off) <= 1.96 * sigma)
        speeds = f"| {np.median(off):+.2f}, {np.median(np.abs(off)):.2f} | {inside:.2f} |"
    return (
        f"| {name} | {total['true']:.0f} | {total['hit'] / total['true']:.3f} | {total['hit'] / total['found']:.3f} "
        f"| {total['held']:.0f} of {total['ways']:.0f} "
        f"| {total['movements']:.0f} | {total['right'] / total['movements']:.3f} "
        f"| {total['right'] / total['trips']:.3f} {speeds} {len(off) / total['hit']:.2f} | {total['untracked']:.0f} "
        f"| {total['close']:.0f} | {total['met'] / total['close']:.3f} | {total['met'] / total['said']:.3f} "
        f"| {total['near_met']:.0f} of {total['near']:.0f} | {late} |"
    )


def told_queues(name: str, results: list[dict[str, Any]]) -> str:
    begin, off = (np.concatenate([result[key] for result in results]) for key in ("queued_s", "queue_off"))
    counts = [
        f"{len(ours)} | {np.isfinite(ours).sum()} | {(ours == 0).sum()} | {(np.abs(ours) <= 1).sum()}"
        for ours in (off, off[begin > 0])
    ]
    return f"| {name} | {' | '.join(counts)} | {sum(result['false_queues'] for result in results)} |"


def reach(text: str) -> float:
    """The metres of --reach."""
    metres = float(text)
    if not metres >= ALONG_M[0]:
        raise argparse.ArgumentTypeError(f"{text} m adds no points: the nearest are {ALONG_M[0]:g} m along the legs")
    return metres


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", nargs="+", type=Path)
    other = parser.add_mutually_exclusive_group()
    other.add_argument("--uncalibrated", action="store_true", help="score the tracks without the calibration")
    other.add_argument("--reach", type=reach, metavar="M", help="add calibration points up to M metres along the legs")
    options = parser.parse_args()
    clips, uncalibrated = options.clips, options.uncalibrated
    of, speed = "recall | precision", "speed error: median, median absolute | in 95 % | with speed"
    pet = "PET error: median, median absolute | in 95 %"
    print(
        f"| clip | crossings | {of} | bounds of counts hold | movements | {of} | {speed} | missed without a track "
        f"| conflicts | {of} | found within the calibration's points | {pet} |"
    )
    exact, real = [], []
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        for number, clip in enumerate(clips):
            site, run = read_site(clip / "site.toml"), clip / "run"
            if uncalibrated:
                site = site.model_copy(update={"calibration": None, "classes": {}})
            else:
                perfect = Path(folder, str(number))
                exact_run(clip, perfect)
                exact.append(score(clip, perfect, site))
                print(told(f"{clip.name}, exact", exact[-1:]))
                lines.append(told_queues(f"{clip.name}, exact", exact[-1:]))
            if options.reach is not None:
                path = Path(folder, f"{number}.toml")
                path.write_text(reaching(clip, options.reach), encoding="utf-8")
                site, run = read_site(path), tracked_again(clip, path, Path(folder, f"{number}-run"))
            if run.is_dir():
                real.append(score(clip, run, site))
                print(told(clip.name, real[-1:]))
                lines.append(told_queues(clip.name, real[-1:]))
    if exact:
        print(told("all, exact", exact))
        lines.append(told_queues("all, exact", exact))
    if real:
        print(told("all", real))
        lines.append(told_queues("all", real))
    counts = "found | same number | within one"
    print(f"\n| clip | queues | {counts} | not from the first picture on | {counts} | false |")
    print(*lines, sep="\n")


if __name__ == "__main__":
    main()
