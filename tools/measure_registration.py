"""Measures the registration of two radars on `simulate radar-network`: errors, ids, GOSPA, and honesty of the biases.

python tools/measure_registration.py --seeds 20
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from vidtrack import score
from vidtrack.config.load import load
from vidtrack.formats import read, read_states
from vidtrack.radar.network.radars import read_radars
from vidtrack.run.network import network_pipeline
from vidtrack.run.run import Extras, Run
from vidtrack.simulate.radar_network import simulate_network, write_network

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


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=500)
    parser.add_argument("--targets", type=int, default=2)
    parser.add_argument("--bias", default="0,1,0")
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--prior", default="{}", help="keys of radars.toml, as a Python dictionary")
    options = parser.parse_args()
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
