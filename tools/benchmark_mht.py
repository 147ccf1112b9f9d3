"""Time of a scan, and memory, with multiple hypotheses: `python tools/benchmark_mht.py [--scans 300] [--targets 100]`.

Targets fly circles of 4 to 8 km radius at 100 to 150 m/s within 20 km x 20 km;
a scan each second, plots of 20 m, one target in ten missed, as many false plots as targets, decisions after 3 scans.
Memory is that of the process after each tenth of the scans; for the 10,000 of a long run: `--scans 10000`.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from time import perf_counter

import numpy as np
from benchmark_memory import resident_mb
from scipy.spatial import cKDTree

import vidtrack as vt
from vidtrack.arrays.types import Floats

SIDE_M, SIGMA_M, SCAN_S, P_D = 20e3, 20.0, 1.0, 0.9
WARM_UP = 10
"""Scans not counted: kernels are loaded, tracks confirmed."""
NEAR_M = 100.0
"""A target with a confirmed track so near is followed."""


def main() -> None:
    """Print times, memory, and whether the tracks are any good."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scans", type=int, default=300)
    parser.add_argument("--targets", type=int, default=100)
    options = parser.parse_args()
    if options.scans <= WARM_UP:
        parser.error(f"--scans is {options.scans}; it must be above {WARM_UP}, which are not counted")
    tracker = vt.Tracker(
        vt.ConstantVelocity(accel=4.0, speed=120.0), vt.MHT(n_scan=3), life=vt.LifeCycle(coast_s=5.0),
        detection_probability=P_D, clutter_density=options.targets / SIDE_M**2,
    )  # fmt: skip
    seconds, memory, followed, ids, tracks_shown = [], [], 0, set(), 0
    for k, (truth, scan) in enumerate(flights(options.targets, options.scans)):
        began = perf_counter()
        tracks = tracker.step(scan)
        seconds.append(perf_counter() - began)
        if (k + 1) % max(1, options.scans // 10) == 0:
            memory.append(resident_mb())
        if k < WARM_UP:
            continue
        known = tracks.only(tracks.status != vt.Status.TENTATIVE)
        ids |= set(known.id.tolist())
        tracks_shown += len(known)
        if len(known):
            followed += int((cKDTree(known.xy).query(truth)[0] < NEAR_M).sum())
    ms = 1e3 * np.array(seconds[WARM_UP:])
    counted = len(ms) * options.targets
    print(
        f"step: median {np.median(ms):.1f} ms, 99th percentile {np.percentile(ms, 99):.1f} ms, most {ms.max():.1f} ms"
    )
    print("memory after each tenth [MB]: " + " ".join(f"{mb:.0f}" for mb in memory))
    print(
        f"followed {followed / counted:.1%} of the targets' scans; {tracks_shown / counted:.3f} tracks a target, ",
        end="",
    )
    print(f"{len(ids)} identities for {options.targets} targets")


def flights(targets: int, scans: int) -> Iterator[tuple[Floats, vt.Scan]]:
    """True positions (N, 2) and the scan of each second."""
    rng = np.random.default_rng(0)
    radius, speed = rng.uniform(4e3, 8e3, (targets, 1)), rng.uniform(100, 150, (targets, 1))
    centre, phase = rng.uniform(radius, SIDE_M - radius, (targets, 2)), rng.uniform(0, 2 * np.pi, (targets, 1))
    for k in range(scans):
        angle = phase + speed / radius * SCAN_S * k
        x = centre + radius * np.hstack([np.cos(angle), np.sin(angle)])
        seen = x[rng.random(targets) < P_D]
        false = rng.uniform(0, SIDE_M, (rng.poisson(targets), 2))
        z = np.concatenate([seen + rng.normal(0, SIGMA_M, seen.shape), false])
        yield x, vt.Scan(SCAN_S * k, z, SIGMA_M**2 * np.eye(2))


if __name__ == "__main__":
    main()
