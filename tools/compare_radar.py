"""Our methods and Stone Soup's on real plots: GOSPA, IDF1, switches, CPU time.

    python tools/compare_radar.py autoferry --peers-in DIR

Data sets are read from VIDTRACK_DATA: `autoferry` (five scenarios), `joyride`, `opensky` (real air traffic, simulated
radar; a scenario is a seed). Scores are means over the scenarios; CPU time is their sum, in seconds, without compiling
and loading. Stone Soup has no IMM; its GNN and JPDA (EHM2) have the process noise and clutter density of ours.

  usual   Stone Soup with the default values of its classes: P_D .85, P_G .95, two plots begin a track; it ends after
          five scans without one
  ours    Stone Soup with our P_D, gate .999, three plots
  best    Stone Soup with the settings of a grid that have the best mean IDF1 in this very data: P_G, plots to begin,
          factor on the process noise
"""

from __future__ import annotations

import argparse
import itertools
import logging
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from peers.environment import python_of
from read_autoferry import write_autoferry
from read_joyride import read_joyride, write_joyride
from track_opensky import aircraft, tracked, write_plots

from vidtrack import formats, score
from vidtrack.config.load import load
from vidtrack.config.settings import Settings
from vidtrack.radar.plots import read_plots
from vidtrack.radar.scans import clutter_density, measurements

BOATS = ("radar.max_speed=10", "radar.accel=0.5", "radar.quiet_accel=0.1")
FAST_BOAT = ("radar.max_speed=20", "radar.accel=1", "radar.quiet_accel=0.1", "radar.detection_probability=0.85")
SCORES = ("gospa", "idf1", "idr", "switches")
USUAL: dict[str, Any] = {"p_d": 0.85, "p_g": 0.95, "hits": 2, "misses": 5, "noise": 1.0}
GRID = {"p_g": (0.95, 0.999), "hits": (2, 3, 4), "noise": (0.3, 1.0, 3.0)}


class Scenario(NamedTuple):
    """Plots to be tracked, the truth, and the distance [m] up to which they match."""

    plots: Path
    truth: formats.Table
    near_m: float


class Found(NamedTuple):
    """A result, and the CPU time [s] that it took."""

    tracks: formats.Table
    cpu_s: float


def scenarios(name: str, seeds: int, folder: Path) -> Iterator[Scenario]:
    """The scenarios of a data set, written into a folder."""
    data = Path(os.environ["VIDTRACK_DATA"])
    if name == "autoferry":
        for scenario in sorted(path.name.partition("_")[0] for path in (data / name).glob("*_detections.json")):
            write_autoferry(data / name / scenario, folder / scenario)
            yield Scenario(folder / scenario / "plots.csv", formats.read(folder / scenario / "truth.csv"), 30.0)
    elif name == "joyride":
        write_joyride(read_joyride(data / name / "joyride.mat"), folder)
        yield Scenario(folder / "plots.csv", formats.read(folder / "truth.csv"), 50.0)
    else:
        truth = aircraft(data / name / "OpenSky_Plane_States.csv")
        for seed in range(seeds):
            write_plots(folder / f"{seed}.csv", truth, np.random.default_rng(seed))
            yield Scenario(folder / f"{seed}.csv", truth, 2000.0)


def ours(scenario: Scenario, settings: Settings) -> Found:
    """Our tracks."""
    began = time.process_time()
    tracks = tracked(scenario.plots, settings)
    return Found(tracks, time.process_time() - began)


def stone_soup(
    kind: str, all_of: list[Scenario], settings: Settings, choices: list[dict[str, Any]], python: Path
) -> list[list[Found]]:
    """Stone Soup's tracks of all scenarios with the models of our settings, by each of the `choices` of the others."""
    worker = Path(__file__).parent / "peers" / "plots.py"
    with tempfile.TemporaryDirectory() as place:
        files = []
        for k, (chosen, scenario) in enumerate(itertools.product(choices, all_of)):
            files += [Path(place, f"{k}.npz"), Path(place, f"{k}-tracks.npz")]
            np.savez(files[-2], **problem(scenario, settings, chosen))
        subprocess.run([python, worker, kind, *files], check=True)
        found = [_read(path) for path in files[1::2]]
    return [found[k : k + len(all_of)] for k in range(0, len(found), len(all_of))]


def problem(scenario: Scenario, settings: Settings, chosen: dict[str, Any]) -> dict[str, Any]:
    """What the peer's worker reads."""
    radar = settings.radar
    plots = read_plots(scenario.plots, radar)
    return {
        "times": np.interp(np.arange(int(plots.scan.max()) + 1), plots.scan, plots.time_s),
        "plots": plots.z,
        "scan": plots.scan,
        "sigma": plots.sigma.mean(),
        "intensity": chosen["noise"] * radar.accel**2 * radar.hold_s,
        "speed": radar.max_speed / 2,
        "clutter": clutter_density(measurements(plots, radar)),
        **{name: chosen[name] for name in ("p_d", "p_g", "hits", "misses")},
    }


def _read(path: Path) -> Found:
    with np.load(path) as stored:
        rows, cpu_s = stored["rows"], float(stored["cpu_s"])
    frame, identity = rows[:, :2].astype(int).T
    return Found(formats.Table(frame, identity, rows[:, 2:], None, np.ones(len(rows)), unit="m"), cpu_s)


def scored(found: list[Found], all_of: list[Scenario]) -> dict[str, float]:
    """Means of the scores, and the CPU time."""
    each = [
        score.evaluate(one.tracks, scenario.truth, max_distance=scenario.near_m)
        for one, scenario in zip(found, all_of, strict=True)
    ]
    mean: dict[str, float] = {name: float(np.mean([float(scores[name]) for scores in each])) for name in SCORES}
    return mean | {"cpu_s": sum(one.cpu_s for one in found)}


def show(name: str, scores: dict[str, float], more: str = "") -> None:
    """Print one row."""
    sys.stdout.write(f"{name:34}" + "".join(f"{value:12.3f}" for value in scores.values()) + f"  {more}\n")
    sys.stdout.flush()


def compare(arguments: argparse.Namespace, all_of: list[Scenario]) -> None:
    """Print the table of a data set."""
    own = {"autoferry": BOATS, "joyride": FAST_BOAT, "opensky": ()}[arguments.data]
    settings = load(assignments=own)
    ours(all_of[0], settings)  # compiles
    for estimator, method in itertools.product(("imm", "kalman"), ("gnn", "jpda", "mht")):
        named = [*own, f"tracker.method={method}", f"radar.estimator={estimator}", *arguments.set]
        show(f"{method} {estimator}", scored([ours(one, load(assignments=named)) for one in all_of], all_of))
    if own:
        aircraft_like = [ours(one, load(assignments=arguments.set)) for one in all_of]
        show("gnn imm, nothing set", scored(aircraft_like, all_of))
    if arguments.peers_in is None:
        return
    python = python_of("filters", arguments.peers_in)

    as_ours: dict[str, Any] = {**USUAL, "p_d": settings.radar.detection_probability, "p_g": 0.999, "hits": 3}
    grid = [as_ours | dict(zip(GRID, values, strict=True)) for values in itertools.product(*GRID.values())]
    drawn = np.random.default_rng(0).permutation(len(grid))[: arguments.grid]
    choices = [USUAL, as_ours, *(grid[k] for k in drawn)]
    for kind in ("gnn", "jpda"):
        every = [scored(found, all_of) for found in stone_soup(kind, all_of, settings, choices, python)]
        show(f"Stone Soup {kind}, usual", every[0])
        show(f"Stone Soup {kind}, ours", every[1])
        best = max(range(len(every)), key=lambda k: every[k]["idf1"])
        show(f"Stone Soup {kind}, best", every[best], str({name: choices[best][name] for name in GRID}))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", choices=["autoferry", "joyride", "opensky"])
    parser.add_argument("--seeds", type=int, default=3, help="of opensky")
    parser.add_argument("--set", action="append", default=[], metavar="A.B=VALUE", help="one setting of ours")
    parser.add_argument("--grid", type=int, default=18, help="so many of the 18 settings of the grid, drawn once")
    parser.add_argument("--peers-in", type=Path, metavar="DIR", help="compare with Stone Soup in this environment")
    arguments = parser.parse_args()
    logging.disable(logging.WARNING)
    sys.stdout.write(f"{'':34}" + "".join(f"{name:>12}" for name in (*SCORES, "cpu_s")) + "\n")
    with tempfile.TemporaryDirectory() as folder:
        compare(arguments, list(scenarios(arguments.data, arguments.seeds, Path(folder))))


if __name__ == "__main__":
    main()
