"""Compare `vidtrack measure` with the detectors of SUMO, on traffic that SUMO makes.

    SUMO_HOME=.../sumo python tools/compare_sumo.py -o DIR [--seconds 900] [--seed 1]

SUMO (pip install eclipse-sumo, in an environment of its own) runs a junction of a major and a minor road without
a signal, with cars, vans and buses that follow closely. Its positions become a run of exact tracks, at 10 frames/s in a
picture from straight above. Then `measure` and SUMO look at the same traffic:

- E1 (loops) at every gate: vehicles in each minute, over the whole time, and their mean speed.
- E2 (lane areas) over the 75 m before each stop line: the most vehicles in the jam while our queue lasts. E2 ends at
  the stop line; our queue also has those that wait inside the junction.
- SSM devices in all vehicles: least times to collision up to 1.5 s, post-encroachment times up to 5 s.

DIR keeps SUMO's files, the run and its site, and the tables.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pyarrow as pa
from exact_run import write_exact_run

from vidtrack.output.figures import write_figures
from vidtrack.traffic.measures.measure import measured
from vidtrack.traffic.site import read_site

FPS, PX_PER_M, SIDE_PX = 10.0, 5.0, 1000
ARM_M, GATE_M, EXIT_M, E2_M, MINUTE_S = 150.0, 85.0, 30.0, 75.0, 60.0
ARMS = {"north": (0, 1), "east": (1, 0), "south": (0, -1), "west": (-1, 0)}
"""Where each arm lies from the middle."""
MAJOR = ("east", "west")
KINDS = {"car": (4.6, 1.8, 0.80), "van": (6.5, 2.1, 0.12), "bus": (12.0, 2.5, 0.08)}
"""Length and width [m], and share."""
FLOWS = {"through": 240, "left": 40, "right": 40}
"""vehicles/h of each arm"""
DRIVER = 'tau="0.3" sigma="0.9" jmTimegapMinor="0.3"'
"""Short gaps, so that there are conflicts"""
ENCOUNTER_S = 5.0
"""Two vehicles that come close once more, later, have another encounter."""


def binary(name: str) -> Path | None:
    """A program of SUMO, from SUMO_HOME or the path; None: not installed."""
    home = os.environ.get("SUMO_HOME")
    if home and (Path(home) / "bin" / name).is_file():
        return Path(home) / "bin" / name
    found = shutil.which(name)
    return None if found is None else Path(found)


def simulate(folder: Path, seconds: float, seed: int) -> None:
    """Let SUMO run; writes fcd.xml, e1.xml, e2.xml and ssm.xml."""
    nodes = [f'<node id="{arm}" x="{x * ARM_M}" y="{y * ARM_M}" type="dead_end"/>' for arm, (x, y) in ARMS.items()]
    edges = [
        f'<edge id="{a}_{b}" from="{a}" to="{b}" numLanes="1" speed="13.9" priority="{2 if arm in MAJOR else 1}"/>'
        for arm in ARMS
        for a, b in ((arm, "c"), ("c", arm))
    ]
    written(folder / "nodes.xml", "nodes", [*nodes, '<node id="c" x="0" y="0" type="priority"/>'])
    written(folder / "edges.xml", "edges", edges)
    files = ["-n", "nodes.xml", "-e", "edges.xml", "-o", "net.xml"]
    call(folder, "netconvert", *files, "--offset.disable-normalization", "true", "--no-turnarounds", "true")
    lanes = {
        lane.get("id"): float(lane.get("length", 0)) for lane in ET.parse(folder / "net.xml").getroot().iter("lane")
    }
    written(folder / "routes.xml", "routes", routes(seconds))
    written(folder / "detectors.xml", "additional", list(detectors(lanes)))
    call(
        folder,
        "sumo",
        *("-n", "net.xml", "-r", "routes.xml", "-a", "detectors.xml", "--step-length", str(1 / FPS)),
        *("--end", str(seconds), "--seed", str(seed), "--fcd-output", "fcd.xml", "--no-step-log", "true"),
        *("--device.ssm.probability", "1", "--device.ssm.measures", "TTC PET", "--device.ssm.thresholds", "1.5 5"),
        *("--device.ssm.range", "60", "--device.ssm.extratime", "6", "--device.ssm.file", "ssm.xml"),
        *("--time-to-teleport", "-1", "--collision.action", "none", "--no-warnings", "true"),
    )


def written(path: Path, name: str, lines: list[str]) -> None:
    path.write_text("\n".join([f"<{name}>", *lines, f"</{name}>", ""]))


def call(folder: Path, name: str, *arguments: str) -> None:
    program = binary(name)
    if program is None:
        raise SystemExit(f"{name} is not installed: pip install eclipse-sumo, and set SUMO_HOME to its folder sumo")
    subprocess.run([program, *arguments], cwd=folder, check=True, stdout=subprocess.DEVNULL)


def routes(seconds: float) -> list[str]:
    """Flows of all movements; types are drawn by their shares."""
    types = [
        f'<vType id="{kind}" length="{length}" width="{width}" probability="{share}" {DRIVER}/>'
        for kind, (length, width, share) in KINDS.items()
    ]
    names, flows = list(ARMS), []
    for k, arm in enumerate(names):
        for turn, steps in (("left", 1), ("through", 2), ("right", 3)):
            end = names[(k + steps) % 4]
            flows.append(
                f'<flow id="{arm}_{turn}" type="mix" from="{arm}_c" to="c_{end}" begin="0" end="{seconds}" '
                f'probability="{FLOWS[turn] / 3600}" departSpeed="max" departPos="base"/>'
            )
    return ['<vTypeDistribution id="mix">', *types, "</vTypeDistribution>", *flows]


def detectors(lanes: dict[str | None, float]):
    """E1 at the gates and E2 before the stop lines."""
    for arm in ARMS:
        into, out = f"{arm}_c_0", f"c_{arm}_0"
        places = ((f"{arm}_in", into, ARM_M - GATE_M), (f"{arm}_out", out, lanes[out] - (ARM_M - EXIT_M)))
        for name, lane, place in places:
            yield f'<inductionLoop id="{name}" lane="{lane}" pos="{place}" period="{MINUTE_S}" file="e1.xml"/>'
        begin, end = lanes[into] - E2_M, lanes[into]
        yield (
            f'<laneAreaDetector id="{arm}" lane="{into}" pos="{begin}" endPos="{end}" period="1" file="e2.xml" '
            f'speedThreshold="{5 / 3.6}" timeThreshold="0" jamThreshold="10"/>'
        )


def convert(folder: Path, seconds: float) -> None:
    """The run and its site from SUMO's positions, which are of the middle of the front bumper."""
    states, ids = [], {}
    for _, step in ET.iterparse(folder / "fcd.xml"):
        if step.tag != "timestep":
            continue
        for one in step:
            number = ids.setdefault(one.get("id"), len(ids) + 1)
            length, width, _ = KINDS[one.get("type")]
            values = (float(one.get(name)) for name in ("x", "y", "angle", "speed"))
            states.append((float(step.get("time")), number, *values, length, width))
        step.clear()
    t, track, x, y, angle, speed, length, width = np.array(states).T
    heading = np.radians(angle)
    x, y = x - length / 2 * np.sin(heading), y - length / 2 * np.cos(heading)
    reach = [
        (length * np.abs(along(heading)) + width * np.abs(across(heading))) / 2
        for along, across in ((np.sin, np.cos), (np.cos, np.sin))
    ]
    left, top = pixel(np.column_stack([x - reach[0], y + reach[1]])).T
    boxes = np.column_stack([left, top, 2 * PX_PER_M * reach[0], 2 * PX_PER_M * reach[1]])
    shown = (boxes[:, :2] >= 0).all(axis=1) & (boxes[:, :2] + boxes[:, 2:] <= SIDE_PX).all(axis=1)
    names = ("time_s", "track_id", "x_m", "y_m", "speed_kmh", "heading_deg", "length_m", "width_m")
    columns = (t, track, x, y, 3.6 * speed, angle, length, width)
    exact = {name: column[shown] for name, column in zip(names, columns, strict=True)}
    shutil.rmtree(folder / "run", ignore_errors=True)
    write_exact_run(folder / "run", exact, boxes[shown], FPS, (SIDE_PX, SIDE_PX), seconds - 1 / FPS)
    (folder / "vehicles.txt").write_text("\n".join(ids) + "\n")
    (folder / "site.toml").write_text(site())


def pixel(xy) -> np.ndarray:
    """Picture points of places in metres: from straight above."""
    return SIDE_PX / 2 + PX_PER_M * np.asarray(xy, float) * (1, -1)


def site() -> str:
    """Gates where the loops are."""
    ground = [(x, y) for x in (-95, 0, 95) for y in (-95, 0, 95)]
    lines = ["[site]", 'name = "sumo"', f"width = {SIDE_PX}", f"height = {SIDE_PX}", "[calibration]"]
    lines += [f"picture = {pixel(ground).tolist()}", f"ground = {[list(map(float, point)) for point in ground]}"]
    for arm, (x, y) in ARMS.items():
        ahead, left = np.array([-x, -y]), np.array([y, -x])  # of those who drive in
        for role, far, side in (("entry", GATE_M, -1), ("exit", EXIT_M, 1)):
            ends = pixel([-far * ahead, -far * ahead + side * 5 * left])
            name = f"{arm}_{'in' if role == 'entry' else 'out'}"
            lines += [f"[gates.{name}]", f"line = {ends.tolist()}", f'leg = "{arm}"', f'role = "{role}"']
    return "\n".join([*lines, "[report]", f"interval_s = {MINUTE_S}", ""])


def loops(folder: Path, tables: dict[str, pa.Table]) -> tuple[np.ndarray, np.ndarray]:
    """(M, 2) vehicles in each minute at each gate, here and there; differences of mean speeds [km/h] where these are
    the same."""
    there = {
        (one.get("id"), float(one.get("begin"))): (float(one.get("nVehContrib")), float(one.get("speed")))
        for one in ET.parse(folder / "e1.xml").getroot().iter("interval")
    }
    ours: dict[tuple[str, float], list[float]] = {}
    for row in tables["intervals"].to_pylist():
        key = row["gate"], row["begin_s"]
        if row["count"] is not None:
            ours.setdefault(key, []).append((row["count"], row["time_mean_speed_kmh"]))
    counts, speeds = [], []
    for key, (count, speed) in there.items():
        mine = ours[key]
        counted = sum(one[0] for one in mine)
        counts.append((counted, count))
        fast = [one[1] for one in mine if one[0]]
        if count and counted == count and len(fast) == 1:
            speeds.append(fast[0] - 3.6 * speed)
    return np.array(counts), np.array(speeds)


def queues(folder: Path, tables: dict[str, pa.Table]) -> tuple[np.ndarray, np.ndarray, int]:
    """How many more vehicles and metres each of our queues has than the largest jam of E2 meanwhile; seconds with a jam
    of E2 outside our queues."""
    jam: dict[str, dict[float, tuple[float, float]]] = {}
    for one in ET.parse(folder / "e2.xml").getroot().iter("interval"):
        values = float(one.get("maxJamLengthInVehicles")), float(one.get("maxJamLengthInMeters"))
        jam.setdefault(one.get("id"), {})[float(one.get("begin"))] = values
    off, metres, alone = [], [], 0
    for arm, values in jam.items():
        times, most = np.array(list(values)), np.array(list(values.values()))
        free = most[:, 0] > 0
        for row in tables["queues"].to_pylist():
            if row["leg"] != arm:
                continue
            then = (times > row["begin_s"] - 2) & (times < row["end_s"] + 1)
            off.append(row["vehicles"] - most[then, 0].max(initial=0))
            if row["length_m"] is not None:  # all stand outside the calibration's points
                metres.append(row["length_m"] - most[then, 1].max(initial=0))
            free &= ~then
        alone += int(np.count_nonzero(free))
    return np.array(off), np.array(metres), alone


def ssm_of(folder: Path) -> tuple[dict, dict]:
    """Of each two vehicles the least TTC with its kind, and the PET, from all devices; outside the picture left out."""
    numbers = {name: k + 1 for k, name in enumerate((folder / "vehicles.txt").read_text().split())}
    ttc, pet = {}, {}
    for one in ET.parse(folder / "ssm.xml").getroot().iter("conflict"):
        if one.get("ego") not in numbers or one.get("foe") not in numbers:
            continue
        pair = tuple(sorted((numbers[one.get("ego")], numbers[one.get("foe")])))
        for tag, into, limit in (("minTTC", ttc, 1.5), ("PET", pet, 5.0)):
            found = one.find(tag)
            if found is None or found.get("value") in ("", "NA") or float(found.get("value")) > limit:
                continue
            place = [float(value) for value in found.get("position").split(",")[:2]]
            value = float(found.get("value")), float(found.get("time")), int(found.get("type")), place
            if max(map(abs, place)) < SIDE_PX / 2 / PX_PER_M - 10 and value < into.get(pair, (np.inf,)):
                into[pair] = value
    return ttc, pet


def conflicts(folder: Path, tables: dict[str, pa.Table]) -> dict[str, tuple[int, int, np.ndarray]]:
    """For ttc and pet: pairs of vehicles there, and here, and the differences [s] of those in both at the same time."""
    ours = {
        tuple(sorted((row["first_track_id"], row["second_track_id"]))): row for row in tables["conflicts"].to_pylist()
    }
    found = {}
    for name, theirs in zip(("ttc", "pet"), ssm_of(folder), strict=True):
        mine = {pair: row for pair, row in ours.items() if row[f"{name}_s"] is not None}
        both = sorted(mine.keys() & theirs.keys())
        one_time = [pair for pair in both if abs(mine[pair][f"{name}_time_s"] - theirs[pair][1]) < ENCOUNTER_S]
        off = np.array([mine[pair][f"{name}_s"] - theirs[pair][0] for pair in one_time])
        found[name] = len(theirs), len(mine), off
    return found


def compared(folder: Path, seconds: float, seed: int) -> dict[str, pa.Table]:
    """Simulate, convert and measure; the tables."""
    folder.mkdir(parents=True, exist_ok=True)
    simulate(folder, seconds, seed)
    convert(folder, seconds)
    found = measured([str(folder / "run")], read_site(folder / "site.toml"))
    (folder / "measures").mkdir(exist_ok=True)
    write_figures(folder / "measures", found.tables, found.report)
    return found.tables


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--seconds", type=float, default=900.0)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    tables = compared(options.output, options.seconds, options.seed)
    counts, speeds = loops(options.output, tables)
    off = np.abs(counts[:, 0] - counts[:, 1])
    print(
        f"E1: {counts[:, 0].sum():.0f} crossings of {counts[:, 1].sum():.0f}; {np.mean(off == 0):.3f} of {len(off)} "
        f"minutes and gates equal, largest difference {off.max():.0f}; mean speed in equal ones: "
        f"{np.mean(speeds):+.2f} km/h in the mean, {np.abs(speeds).max():.2f} at most"
    )
    vehicles, metres, alone = queues(options.output, tables)
    print(
        f"E2: {len(vehicles)} queues; {np.mean(vehicles == 0):.3f} with the same number of vehicles, "
        f"{np.mean(np.abs(vehicles) <= 1):.3f} within one, {vehicles.min():+.0f} to {vehicles.max():+.0f}; length "
        f"{np.median(metres):+.1f} m in the median; {alone} s with a jam of E2 and no queue here"
    )
    for name, (theirs, mine, late) in conflicts(options.output, tables).items():
        print(
            f"SSM {name.upper()}: {theirs} pairs of vehicles there, {mine} here, {len(late)} in both, with a "
            f"difference of {np.median(late):+.3f} s in the median, {np.median(np.abs(late)):.3f} s absolute; "
            f"{np.mean(np.abs(late) < 0.3):.2f} within 0.3 s"
        )


if __name__ == "__main__":
    main()
