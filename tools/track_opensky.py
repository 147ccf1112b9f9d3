"""Track real air traffic seen by a simulated radar, with every method, and compare by GOSPA.

    python tools/track_opensky.py OpenSky_Plane_States.csv [--methods nn gnn ...] [--estimators kalman imm] [--seeds 5]

The file holds ADS-B states of aircraft over England every 10 s, with identities (OpenSky network). Positions are moved
to the time of the scan by their velocity; states older than 10 s are left out. The radar has errors of 100 m in x and
y, misses one in ten aircraft, and sees 20 false plots a scan, uniform over 460 x 500 km, drawn anew for each seed.
GOSPA: order 2, cutoff 2 km, with its parts; all numbers are means over the seeds.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
import pyarrow.csv

from vidtrack import formats, score
from vidtrack.config.load import load
from vidtrack.config.settings import Settings
from vidtrack.run.radar import track_plots
from vidtrack.tracks import Status

SIGMA_M, P_D, FALSE_PLOTS = 100.0, 0.9, 20
OLDEST_S = 10.0
ORIGIN_DEG = 52.25, -1.7
EARTH_M = 6_371_000.0
CUTOFF_M = 2000.0
SCORES = ("gospa", "gospa_localisation", "gospa_missed", "gospa_false", "idf1", "switches")


def aircraft(path: Path) -> formats.Table:
    """True positions in metres, x east and y north of the middle; frame k is the time 10 k s."""
    states = pyarrow.csv.read_csv(path)

    def column(name: str) -> np.ndarray:
        return states[name].to_numpy(zero_copy_only=False).astype(float)

    time, age = column("time"), column("time") - column("lastposupdate")
    latitude, longitude = np.radians(column("lat") - ORIGIN_DEG[0]), np.radians(column("lon") - ORIGIN_DEG[1])
    xy = EARTH_M * np.column_stack([longitude * np.cos(np.radians(ORIGIN_DEG[0])), latitude])
    xy += np.column_stack([column("x_speed"), column("y_speed")]) * age[:, None]
    _, number = np.unique(states["icao24"].to_pylist(), return_inverse=True)
    frame = ((time - time.min()) / 10).astype(int)
    conf = np.ones(len(frame))
    return formats.Table(frame, number + 1, xy, None, conf, unit="m").select(np.abs(age) <= OLDEST_S)


def write_plots(path: Path, truth: formats.Table, rng: np.random.Generator) -> None:
    """What the radar sees."""
    seen = rng.random(len(truth)) < P_D
    scans = np.arange(truth.frame.max() + 1)
    false = np.repeat(scans, rng.poisson(FALSE_PLOTS, len(scans)))
    clutter = rng.uniform(truth.xy.min(axis=0), truth.xy.max(axis=0), (len(false), 2))
    xy = np.concatenate([truth.xy[seen] + SIGMA_M * rng.standard_normal((seen.sum(), 2)), clutter])
    scan = np.concatenate([truth.frame[seen], false])
    order = np.lexsort((xy[:, 0], scan))
    columns = np.column_stack([scan, 10 * scan, xy, np.full((len(scan), 2), SIGMA_M)])
    header = "scan,time_s,x_m,y_m,sigma_x_m,sigma_y_m"
    np.savetxt(path, columns[order], fmt="%d,%d,%.1f,%.1f,%g,%g", header=header, comments="")


def tracked(plots: Path, settings: Settings) -> formats.Table:
    """Confirmed tracks."""
    frame, identity, xy = [], [], []
    for scan, tracks in track_plots(plots, settings):
        confirmed = tracks.status != Status.TENTATIVE
        frame.append(np.full(confirmed.sum(), scan))
        identity.append(tracks.id[confirmed])
        xy.append(tracks.xy[confirmed])
    frames = np.concatenate(frame)
    return formats.Table(frames, np.concatenate(identity), np.concatenate(xy), None, np.ones(len(frames)), unit="m")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--methods", nargs="+", default=["nn", "gnn", "pda", "jpda", "mht"])
    parser.add_argument("--estimators", nargs="+", default=["kalman", "imm"])
    parser.add_argument("--seeds", type=int, default=5)
    arguments = parser.parse_args()
    truth = aircraft(arguments.file)
    per_scan = np.bincount(truth.frame)
    print(f"{len(np.unique(truth.id))} aircraft, {per_scan.mean():.0f} at a time, {len(per_scan)} scans")
    print(f"{'':24}" + "".join(f"{name.removeprefix('gospa_'):>14}" for name in SCORES))
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder, f"{seed}.csv") for seed in range(arguments.seeds)]
        for seed, file in enumerate(files):
            write_plots(file, truth, np.random.default_rng(seed))
        for estimator in arguments.estimators:
            for method in arguments.methods:
                settings = load(assignments=[f"tracker.method={method}", f"radar.estimator={estimator}"])
                found = [score.evaluate(tracked(file, settings), truth, max_distance=CUTOFF_M) for file in files]
                mean = [np.mean([float(scores[name]) for scores in found]) for name in SCORES]
                print(f"{method + ' ' + estimator:24}" + "".join(f"{value:14.3f}" for value in mean))


if __name__ == "__main__":
    main()
