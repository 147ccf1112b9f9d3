"""CPU time of a scan with very many plots in a small place, between scans with few.

python tools/benchmark_dense_scan.py --plots 10000 --method gnn
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

from vidtrack.config.load import load
from vidtrack.radar.plots import Plots
from vidtrack.radar.scans import measurements
from vidtrack.run.radar import build_radar_tracker


def main() -> None:
    """Print the time of each scan: 200 plots, then the many, then 200 again, within 4 km and 11 degrees."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plots", type=int, default=10_000)
    parser.add_argument("--method", default="gnn")
    options = parser.parse_args()
    rng, count = np.random.default_rng(0), [200, options.plots, 200, 200]
    scan = np.repeat(np.arange(len(count)), count)
    z = np.column_stack([rng.uniform(20000, 24000, len(scan)), rng.uniform(0, 0.2, len(scan))])
    sigma = np.broadcast_to(np.array([40, np.radians(0.3)]), z.shape)
    settings = load(assignments=[f"tracker.method={options.method}"])
    found = measurements(Plots(scan, scan * 4.0, z, sigma, True, 2, False, None, 0), settings.radar)
    tracker = build_radar_tracker(settings, found)
    for number, one in found:
        began = time.process_time()
        tracks = tracker.step(one)
        spent = time.process_time() - began
        sys.stdout.write(f"scan {number}: {len(one)} plots, {len(tracks)} tracks, {spent:.2f} s\n")


if __name__ == "__main__":
    main()
