"""Track the boat of the Joyride data set with every method and filter, and say how well.

    python tools/track_joyride.py joyride.mat [--methods nn gnn ...] [--estimators kalman imm] [--peers-in DIR]

A boat of up to 11 m/s, so max_speed is 20 m/s; acceleration 1 m/s^2, P_D 0.85; the rest as `vidtrack radar` has it.
With --peers-in, Stone Soup's PDA and JPDA track the same plots with the same models (peers/plots.py), in an environment
that pip makes in DIR.

on target    share of the scans in which the boat's track, confirmed, is within 50 m of it
rms          of its distances then, m
breaks       how often another track takes over, the one before being lost or gone astray
false        confirmed tracks that are on the target in less than half of their scans, and how many scans they hold
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from peers.environment import python_of
from read_joyride import SIGMA_M, Joyride, read_joyride, write_joyride

from vidtrack.config.load import load
from vidtrack.config.settings import Settings
from vidtrack.radar.plots import read_plots
from vidtrack.radar.scans import clutter_density, measurements
from vidtrack.run.radar import track_plots
from vidtrack.tracks import Status

GATE = 0.999
NEAR_M = 50.0
BOAT = ("radar.max_speed=20", "radar.accel=1", "radar.quiet_accel=0.1", "radar.detection_probability=0.85")
PEERS = {"stonesoup pda": "pda", "stonesoup jpda": "jpda"}

Snapshot = tuple[int, np.ndarray, np.ndarray]
"""Number of a scan, ids (T,) and positions (T, 2) of the confirmed tracks after it."""


def ours(plots: Path, settings: Settings) -> Iterator[Snapshot]:
    """Our tracks."""
    for scan, tracks in track_plots(plots, settings):
        confirmed = tracks.status != Status.TENTATIVE
        yield scan, tracks.id[confirmed], tracks.xy[confirmed]


def stone_soup(kind: str, plots: Path, data: Joyride, peers: Path) -> Iterator[Snapshot]:
    """Stone Soup's tracks, with the models that BOAT and the defaults describe."""
    settings = load(assignments=BOAT)
    radar, common = settings.radar, settings.tracker
    with tempfile.TemporaryDirectory() as place:
        given, result = Path(place, "data.npz"), Path(place, "result.npz")
        np.savez(
            given,
            times=data.times,
            plots=data.plots,
            scan=data.scan,
            sigma=SIGMA_M,
            intensity=radar.accel**2 * radar.hold_s,
            speed=radar.max_speed / 2,
            p_d=radar.detection_probability,
            p_g=GATE,
            clutter=clutter_density(measurements(read_plots(plots, radar), radar)),
            hits=common.confirm_hits,
            misses=radar.coast_scans,
        )
        worker = Path(__file__).parent / "peers" / "plots.py"
        subprocess.run([python_of("numpy2", peers), worker, kind, given, result], check=True)
        with np.load(result) as stored:
            rows = stored["rows"]
    for scan in range(len(data.times)):
        here = rows[rows[:, 0] == scan]
        yield scan, here[:, 1].astype(int), here[:, 2:]


def report(name: str, snapshots: Iterator[Snapshot], data: Joyride) -> None:
    """Print one row of the table."""
    error = np.full(len(data.times), np.inf)
    held, breaks = None, 0
    near: dict[int, list[bool]] = {}
    for scan, ids, position in snapshots:
        distance = np.linalg.norm(position - data.boat[scan, :2], axis=1)
        by_id = dict(zip(ids.tolist(), distance.tolist(), strict=True))
        for track_id, d in by_id.items():
            near.setdefault(track_id, []).append(d < NEAR_M)
        if by_id and by_id.get(held, np.inf) >= NEAR_M:
            nearest = min(by_id, key=by_id.__getitem__)
            if by_id[nearest] < NEAR_M:
                breaks += held is not None
                held = nearest
        error[scan] = by_id.get(held, np.inf)
    on = error < NEAR_M
    rms = np.sqrt(np.mean(error[on] ** 2))
    false = [len(scans) for scans in near.values() if np.mean(scans) < 0.5]
    print(f"{name:24} {on.mean():9.3f} {rms:6.1f} {breaks:7d} {len(false):6d} ({sum(false)})")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--methods", nargs="+", default=["nn", "gnn", "pda", "jpda", "mht"])
    parser.add_argument("--estimators", nargs="+", default=["kalman", "imm"])
    parser.add_argument("--peers-in", type=Path, metavar="DIR", help="compare with Stone Soup in this environment")
    arguments = parser.parse_args()
    data = read_joyride(arguments.file)
    print(f"{'':24} on target  rms m  breaks  false tracks (scans)")
    with tempfile.TemporaryDirectory() as folder:
        write_joyride(data, Path(folder))
        plots = Path(folder, "plots.csv")
        for estimator in arguments.estimators:
            for method in arguments.methods:
                named = [f"tracker.method={method}", f"radar.estimator={estimator}"]
                report(f"{method} {estimator}", ours(plots, load(assignments=[*BOAT, *named])), data)
        if arguments.peers_in:
            for name, kind in PEERS.items():
                report(name, stone_soup(kind, plots, data, arguments.peers_in), data)


if __name__ == "__main__":
    main()
