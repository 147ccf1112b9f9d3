"""Measures the registration of radars on `simulate radar-network`: errors, ids, GOSPA, and honesty of the biases.

    python tools/measure_registration.py --seeds 20
    python tools/measure_registration.py --seeds 20 --first 1000 --drawn --clock 0.5
    python tools/measure_registration.py --seeds 10 --drawn --places "0,0;0,0"
    python tools/measure_registration.py --seeds 8 --drawn --targets 4 --scans 90 --turned 1

With --drawn each radar has biases of its own, drawn from the prior; --turned turns the last one in mid-run.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from vidtrack import score
from vidtrack.config.load import load
from vidtrack.formats import read, read_states
from vidtrack.radar.network.radars import read_radars
from vidtrack.run.network import network_pipeline
from vidtrack.run.run import Extras, Run
from vidtrack.simulate.radar_network import NORTH, biased, joined, observed, simulate_network, write_network

BIAS = {"bias_range_m": 0, "bias_azimuth_deg": 0}
NEAR_M = 2000.0
LEARNT = 30
"""Scans of both radars, in 60 s, after which errors are also given without what came before."""


def tracked(folder: Path, given: dict[str, float], settings: list[str]) -> tuple[dict[str, float], dict]:
    """Scores of the network in a folder; `given` replaces keys of radars.toml. Also what the registration found."""
    radars = read_radars(folder / "radars.toml")
    if given:
        text = (folder / "radars.toml").read_text()
        lines = "\n".join(f"{key} = {value}" for key, value in given.items())
        (folder / "known.toml").write_text(text.replace("scan_s", f"{lines}\nscan_s"))
        radars = read_radars(folder / "known.toml")
    paths = [str(folder / f"{name}.csv") for name in radars.names]
    found: dict = {}
    with Run(
        network_pipeline(paths, radars, load(assignments=settings), Extras(), 0), folder / "run", force=True
    ) as run:
        for _ in run:
            pass
        found = run._summary._reading()["radars"]
    result, truth = read(folder / "run"), read(folder / "truth.csv")
    scores = score.evaluate(result, truth, max_distance=NEAR_M, states=read_states(folder / "run"))
    error, late = [], []
    for frame in np.unique(truth.frame):
        at, there = result.xy[result.frame == frame], truth.xy[truth.frame == frame][:, :2]
        if len(at):
            near = np.linalg.norm(there[:, None] - at[None], axis=-1).min(axis=1)
            error.extend(near[near < NEAR_M])
            late.extend(near[near < NEAR_M] if frame >= LEARNT else [])
    row = {
        "rms_m": float(np.sqrt(np.mean(np.square(error)))),
        "late_rms_m": float(np.sqrt(np.mean(np.square(late)))),
        "ids": len(np.unique(result.id)),
        "idf1": scores["idf1"],
        "switches": scores["switches"],
        "gospa_m": scores["gospa"],
        "nees": scores["nees"],
    }
    return row, found


def drawn(options: argparse.Namespace, seed: int, folder: Path) -> dict[str, tuple[float, float, float]]:
    """Write the plots of radars with biases drawn from the default prior; gives those of each by name."""
    places = [tuple(float(part) for part in place.split(",")) for place in options.places.split(";")]
    rng = np.random.default_rng(seed)
    radars = {
        f"r{k}": replace(NORTH, place=(*place, 0.0), start_s=NORTH.scan_s * k / len(places))
        for k, place in enumerate(places)
    }
    targets, seen = observed(rng, radars, options.targets, options.scans)
    bias = {name: (rng.normal(0, 30), rng.normal(0, 1), options.clock * (k > 0)) for k, name in enumerate(radars)}
    seen = {name: biased(one, *bias[name]) for name, one in seen.items()}
    last = list(radars)[-1]
    late = seen[last].time_s > options.scans * NORTH.scan_s / 2
    seen[last].z[late, 1] = (seen[last].z[late, 1] + options.turned) % 360
    bias[last] = (bias[last][0], bias[last][1] + options.turned, bias[last][2])
    write_network(joined(targets, seen), folder)
    return bias


def measure_drawn(options: argparse.Namespace) -> None:
    """Means over the seeds with their standard errors."""
    rows, squares, named = [], [], 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for seed in range(options.first, options.first + options.seeds):
            bias = drawn(options, seed, folder)
            row, found = tracked(folder, eval(options.prior), options.set)
            rows.append(row)
            squares.append([
                [((own[f"bias_{kind}"] - bias[radar][k]) / sigma) ** 2
                 if (sigma := own[f"bias_{kind.replace('_', '_sigma_')}"]) else np.nan
                 for k, kind in enumerate(("range_m", "azimuth_deg", "time_s"))]
                for radar, own in found.items()
            ])  # fmt: skip
            named += any(own["bias_time_sigma_s"] > 0 for own in found.values())
    for key in rows[0]:
        values = np.array([row[key] for row in rows])
        error = values.std(ddof=1) / len(rows) ** 0.5
        print(f"{key:12s} {values.mean():.3f} +- {error:.3f}, median {np.median(values):.3f}")
    told = np.array(squares).reshape(len(rows), -1)
    print("squared errors of the biases over their variances:", [
        round(float(np.mean(column[~np.isnan(column)])), 2) if not np.isnan(column).all() else None for column in told.T
    ])  # fmt: skip
    print(f"runs with a clock estimated: {named} of {len(rows)}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=500)
    parser.add_argument("--targets", type=int, default=2)
    parser.add_argument("--bias", default="0,1,0")
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--prior", default="{}", help="keys of radars.toml, as a Python dictionary")
    parser.add_argument("--drawn", action="store_true", help="biases of all radars drawn from the prior")
    parser.add_argument("--places", default="0,15e3;0,-15e3", help="with --drawn: x,y;x,y;... in m")
    parser.add_argument("--clock", type=float, default=0.0, help="with --drawn: s, error of all clocks but the first")
    parser.add_argument("--turned", type=float, default=0.0, help="with --drawn: degrees")
    parser.add_argument("--scans", type=int, default=60, help="with --drawn")
    options = parser.parse_args()
    if options.drawn:
        measure_drawn(options)
        return
    bias = tuple(float(part) for part in options.bias.split(","))
    prior = eval(options.prior)
    ways = {
        "no bias, known": ((0.0, 0.0, 0.0), BIAS),
        "no bias": ((0.0, 0.0, 0.0), prior),
        "bias, registered": (bias, prior),
        "bias, not registered": (bias, BIAS),
    }
    rows: dict[str, list[dict[str, float]]] = {way: [] for way in ways}
    errors = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(options.first, options.first + options.seeds):
            for way, (wrong, given) in ways.items():
                write_network(simulate_network(seed, bias=wrong, targets=options.targets), Path(folder))
                row, found = tracked(Path(folder), given, options.set)
                rows[way].append(row)
                if way == "bias, registered":
                    true = {"north": (0, 0, 0), "south": bias}
                    errors.append([
                        [(own[f"bias_{name}"] - true[radar][k], own[f"bias_{name.replace('_', '_sigma_')}"])
                         for k, name in enumerate(("range_m", "azimuth_deg", "time_s"))]
                        for radar, own in found.items()
                    ])  # fmt: skip
    for way, each in rows.items():
        cells = (
            f"{name} {np.mean([row[name] for row in each]):.3f} +- {np.std([row[name] for row in each], ddof=1):.3f}"
            for name in each[0]
        )
        print(f"{way:22s}", "  ".join(cells))
    error = np.array(errors)
    print("final bias errors, rms by radar (range m, azimuth deg, time s):", np.sqrt((error[..., 0] ** 2).mean(axis=0)))
    with np.errstate(invalid="ignore", divide="ignore"):
        print(
            "... over their stated standard deviations:", np.sqrt(((error[..., 0] / error[..., 1]) ** 2).mean(axis=0))
        )


if __name__ == "__main__":
    main()
