"""Track real trajectories through noise, misses and clutter with ours and with Stone Soup's GNN and JPDA.

    python tools/benchmark_urban.py --peers-in DIR [--seeds 5] [--method gnn jpda]

The truth of VIDTRACK_DATA/urban (two junctions; cars, bicycles, pedestrians) every 0.2 s: the centres of its boxes
are seen with a probability of 0.9 and noise of 2 px on each axis, among 10 false points a scan, uniform over the
picture. All trackers have the same models: nearly constant velocity (white acceleration of 60 px/s^2 correlated
over 0.5 s, unknown first velocity of 50 px/s), the true noise, detection probability and clutter density, a gate of
0.999; five scans without a hit end a track. In Stone Soup three hits make one, with no more than one miss in a row;
ours begins and ends by its likelihood ratio (`LogRatio`) or, for comparison, by 3 hits of 4 (`LifeCycle`).
Scored are all established tracks of a scan, by OSPA and GOSPA with a cutoff of 20 px and order 2, means over scans
and then over seeds and junctions, and the paired differences from Stone Soup's.
"""

from __future__ import annotations

import argparse
import os
import sqlite3
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from peers.environment import python_of

from vidtrack import score
from vidtrack.arrays.types import Floats, Ints
from vidtrack.associate.gate import Gate
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.formats import Table
from vidtrack.scan import Scan
from vidtrack.tracking.lifecycle import LifeCycle
from vidtrack.tracking.log_ratio import LogRatio
from vidtrack.tracking.methods import METHODS
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracks import Status

FPS, EVERY = 25.0, 5
DT = EVERY / FPS
SIGMA, FALSE, CUTOFF = 2.0, 10.0, 20.0
ACCEL, HOLD_S, SPEED = 60.0, 0.5, 50.0
DETECTION, GATE, HITS, WINDOW, COAST = 0.9, 0.999, 3, 4, 5
LIVES = {
    "": LogRatio(coast_scans=COAST),
    " 3 of 4": LifeCycle(confirm_hits=HITS, confirm_window=WINDOW, coast_scans=COAST),
}
PEERS = ("gnn", "jpda")


@dataclass(frozen=True)
class Junction:
    """Positions of a junction's road users in every scan, and the picture that holds them."""

    truth: Table
    low: Floats
    high: Floats

    @property
    def density(self) -> float:
        """False points per square pixel and scan."""
        return float(FALSE / np.prod(self.high - self.low))

    def scans(self, rng: np.random.Generator) -> list[Floats]:
        """Measurements (M, 2) of each scan."""
        truth = self.truth
        seen = np.flatnonzero(rng.random(len(truth)) < DETECTION)
        z = truth.xy[seen] + SIGMA * rng.standard_normal((len(seen), 2))
        false = [rng.uniform(self.low, self.high, (rng.poisson(FALSE), 2)) for _ in range(truth.frame.max() + 1)]
        return [np.concatenate([z[truth.frame[seen] == k], clutter]) for k, clutter in enumerate(false)]


def read_junction(path: Path) -> Junction:
    """Every fifth frame of an Urban Tracker annotation."""
    with sqlite3.connect(path) as base:
        rows = np.array(
            base.execute(
                "select frame_number, object_id, x_top_left, y_top_left, x_bottom_right, y_bottom_right"
                " from bounding_boxes order by frame_number"
            ).fetchall(),
            float,
        )
    rows[:, 0] -= rows[0, 0]
    rows = rows[rows[:, 0] % EVERY == 0]
    xy = (rows[:, 2:4] + rows[:, 4:6]) / 2
    return Junction(_points(rows[:, 0] / EVERY, rows[:, 1], xy), rows[:, 2:4].min(axis=0), rows[:, 4:6].max(axis=0))


def _points(frame: Ints | Floats, identity: Ints | Floats, xy: Floats) -> Table:
    return Table(np.asarray(frame, np.int64), np.asarray(identity, np.int64), xy, None, np.ones(len(xy)))


def track_ours(method: str, life: str, scans: list[Floats], density: float) -> Table:
    """Established tracks in each scan."""
    tracker = Tracker(
        ConstantVelocity(accel=ACCEL, speed=SPEED, hold_s=HOLD_S),
        METHODS[method](),
        Gate(GATE),
        LIVES[life],
        detection_probability=DETECTION,
        clutter_density=density,
    )
    rows = []
    for frame, z in enumerate(scans):
        tracks = tracker.step(Scan(frame * DT, z, SIGMA**2 * np.eye(2)))
        sure = tracks.status != Status.TENTATIVE
        rows.append((np.full(sure.sum(), frame), tracks.id[sure], tracks.xy[sure]))
    return _points(*(np.concatenate(column) for column in zip(*rows, strict=True)))


def track_peer(method: str, scans: list[Floats], density: float, python: Path) -> Table:
    """The same by Stone Soup."""
    worker = Path(__file__).parent / "peers" / "urban.py"
    with tempfile.TemporaryDirectory() as folder:
        given, result = Path(folder) / "data.npz", Path(folder) / "result.npz"
        np.savez(
            given, z=np.concatenate(scans), start=np.cumsum([0, *map(len, scans)]), dt=DT, sigma=SIGMA,
            q=ACCEL**2 * HOLD_S, speed=SPEED, detection_probability=DETECTION, clutter_density=density,
            gate_probability=GATE, confirm_hits=HITS, coast_scans=COAST,
        )  # fmt: skip
        subprocess.run([python, worker, method, given, result], check=True)
        with np.load(result) as stored:
            return _points(stored["frame"], stored["id"], stored["xy"])


def scored(result: Table, truth: Table) -> tuple[float, float, int]:
    """Mean OSPA and GOSPA [px] over scans, and identity switches."""
    matchup = score.match_points(result, truth, CUTOFF)
    ospa, gospa = score.ospa(matchup, CUTOFF), score.gospa(matchup, CUTOFF)
    return float(ospa.distance.mean()), float(gospa.distance.mean()), score.clear(matchup).switches


def main() -> None:
    """Track, score, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peers-in", type=Path, metavar="DIR", help="of the peers' environment; none: ours only")
    parser.add_argument("--seeds", type=int, default=5, help="of noise, misses and clutter (default 5)")
    parser.add_argument("--method", nargs="+", default=["gnn", "jpda"], help="of ours (default gnn jpda)")
    options = parser.parse_args()
    if "VIDTRACK_DATA" not in os.environ:
        parser.error("set VIDTRACK_DATA to the folder that holds urban/")
    junctions = [read_junction(p) for p in sorted((Path(os.environ["VIDTRACK_DATA"]) / "urban").glob("*.sqlite"))]

    found: dict[str, list[tuple[float, float, int]]] = {}
    for seed in range(options.seeds):
        for junction in junctions:
            scans = junction.scans(np.random.default_rng(seed))
            results = {
                method + life: track_ours(method, life, scans, junction.density)
                for method in options.method
                for life in LIVES
            }
            if options.peers_in:
                python = python_of("numpy2", options.peers_in)
                results |= {f"stonesoup {m}": track_peer(m, scans, junction.density, python) for m in PEERS}
            for name, result in results.items():
                found.setdefault(name, []).append(scored(result, junction.truth))

    print(f"{'':18s}{'OSPA':>9s}{'GOSPA':>9s}{'switches':>10s}")
    for name, values in found.items():
        ospa, gospa, switches = np.array(values).T
        print(f"{name:18s}{ospa.mean():9.3f}{gospa.mean():9.3f}{int(switches.sum()):10d}")
    for name in (method + life for life in LIVES for method in options.method):
        for peer in [name for name in found if name.startswith("stonesoup")]:
            ospa, gospa, _ = (np.array(found[name]) - np.array(found[peer])).T
            print(f"{name} - {peer}: OSPA {_spread(ospa)}, GOSPA {_spread(gospa)}")


def _spread(differences: Floats) -> str:
    """Mean and its standard error."""
    return f"{differences.mean():+.3f} ± {differences.std(ddof=1) / np.sqrt(len(differences)):.3f}"


if __name__ == "__main__":
    main()
