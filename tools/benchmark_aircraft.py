"""Time of a scan with thousands of aircraft: `python tools/benchmark_aircraft.py [--aircraft 5000] [--scans 20]`.

Straight flights at 150 to 250 m/s over 1,000 km x 1,000 km, a scan every 10 s, plots of 50 m, one target in ten missed,
one false plot for every ten aircraft. Median of the scans after the fifth; real time is 10 s a scan.
"""

from __future__ import annotations

import argparse
from time import perf_counter

import numpy as np

import vidtrack as vt

SIDE_M, SIGMA_M, SCAN_S, P_D, FALSE = 1e6, 50.0, 10.0, 0.9, 0.1


def main() -> None:
    """Print a line for each method."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--aircraft", type=int, default=5000)
    parser.add_argument("--scans", type=int, default=20)
    options = parser.parse_args()
    scans = list(plots(options.aircraft, options.scans))
    for name, method in (("gnn", vt.GNN), ("jpda", vt.JPDA)):
        tracker = vt.Tracker(
            vt.ConstantVelocity(accel=1.0, speed=150.0), method(),
            detection_probability=P_D, clutter_density=FALSE * options.aircraft / SIDE_M**2,
        )  # fmt: skip
        seconds = []
        for scan in scans:
            began = perf_counter()
            tracks = tracker.step(scan)
            seconds.append(perf_counter() - began)
        known = int((tracks.status != vt.Status.TENTATIVE).sum())
        typical = float(np.median(seconds[5:]))
        print(f"{name:5} {typical * 1e3:7.1f} ms a scan, {SCAN_S / typical:6.0f} times real time, {known} tracks")


def plots(aircraft: int, scans: int):
    """Scans of all aircraft and of clutter."""
    rng = np.random.default_rng(0)
    start, heading = rng.uniform(0, SIDE_M, (aircraft, 2)), rng.uniform(0, 2 * np.pi, aircraft)
    velocity = rng.uniform(150, 250, (aircraft, 1)) * np.column_stack([np.cos(heading), np.sin(heading)])
    for k in range(scans):
        seen = (start + velocity * SCAN_S * k)[rng.random(aircraft) < P_D]
        false = rng.uniform(0, SIDE_M, (rng.poisson(FALSE * aircraft), 2))
        z = np.concatenate([seen + rng.normal(0, SIGMA_M, seen.shape), false])
        yield vt.Scan(SCAN_S * k, z, SIGMA_M**2 * np.eye(2))


if __name__ == "__main__":
    main()
