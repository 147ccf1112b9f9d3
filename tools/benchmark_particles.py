"""Time the particle filter in the experiment of paper 003, and those of other libraries.

    python tools/benchmark_particles.py [--peers-in DIR] [--rounds 5]

2,000 particles for each of 3 channels in each of 100 runs over 232 scans, bootstrap with systematic resampling: 139
million particle-steps of prediction, likelihood, estimate and resampling. With one thread and with all processors.
With --peers-in FilterPy, `particles` and Stone Soup filter one channel of one run, in an environment that pip makes in
DIR. The error is the mean absolute one after 3 s. Compiled beforehand; the fastest of the rounds counts.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from time import perf_counter
from unittest.mock import patch

import numpy as np
from peers.environment import python_of

from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.estimate.particle import ParticleBank
from vidtrack.papers.p003.experiment import PARTICLES, SCAN_S, SCANS, SETTLED, Channels, estimate, measure, polar
from vidtrack.simulate.radar_scenarios import speed

PEERS = ("filterpy", "particles", "stonesoup")
RUNS, CHANNELS, SIGMA_M, ACCEL = 100, 3, 5.0, 49.0


def measured(rows: int) -> Channels:
    """The range of the speed manoeuvre, as many times as there are rows."""
    rng = np.random.default_rng(0)
    return measure(polar(speed(rng)[0].flight)[:, :1], np.array([SIGMA_M]), rows, rng)


def ours(rounds: int, threads: int) -> tuple[float, float]:
    """Seconds for all channels and runs, and the error [m]."""
    seen = measured(RUNS * CHANNELS)
    seconds = []
    with patch("vidtrack.estimate.blocks.ThreadPoolExecutor", lambda _: ThreadPoolExecutor(threads)):
        for _ in range(rounds + 1):
            begin = perf_counter()
            found = estimate(ParticleBank(ConstantVelocity(1, accel=ACCEL), PARTICLES), seen, np.ones(RUNS * CHANNELS))
            seconds.append(perf_counter() - begin)
    return min(seconds[1:]), float(np.abs(found - seen.truth)[SETTLED].mean())


def peer(name: str, rounds: int, folder: Path) -> tuple[float, float]:
    """Seconds for one channel of one run, and the error [m]."""
    seen = measured(1)
    program = Path(__file__).parent / "peers" / "particle_filters.py"
    with tempfile.TemporaryDirectory() as place:
        data, result = Path(place) / "data.npz", Path(place) / "result.npz"
        np.savez(data, z=seen.z[:, 0], step=SCAN_S, sigma=SIGMA_M, accel=ACCEL, particles=PARTICLES, rounds=rounds)
        subprocess.run([python_of("filters", folder), program, name, data, result], check=True)
        stored = np.load(result)
        return float(stored["seconds"].min()), float(np.abs(stored["found"] - seen.truth[:, 0])[SETTLED].mean())


def report(name: str, seconds: float, error: float, steps: int) -> None:
    """Print one line."""
    print(f"{name:24s}{seconds:10.3f}{1e9 * seconds / steps:10.1f}{error:10.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peers-in", type=Path, metavar="DIR", help="where the peers' environment is, or is to be")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    steps = PARTICLES * SCANS
    print(f"{'':24s}{'seconds':>10s}{'ns/step':>10s}{'error m':>10s}")
    for threads in sorted({1, os.cpu_count() or 1}):
        report(f"vidtrack, {threads} threads", *ours(options.rounds, threads), steps * RUNS * CHANNELS)
    for name in PEERS if options.peers_in else ():
        report(name, *peer(name, options.rounds, options.peers_in), steps)


if __name__ == "__main__":
    main()
