"""Time the Monte Carlo experiments of papers 000 and 002, with the kernels still to be compiled and afterwards.

    python tools/benchmark_radar_monte_carlo.py [--runs 1000]

002: the eight cases of its two figures with 50 scans, PSNF and plain strongest neighbour filter, predictions
included; then 10,000 runs of one case. 000: both thresholds with both resolution cells, 35 scans, PDAF. Each
column is a process of its own, imports included; in the first one numba's cache is an empty folder.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from time import perf_counter


def experiments(runs: int) -> dict[str, float]:
    """Seconds of each part."""
    began = perf_counter()
    import numpy as np

    from vidtrack.papers.p000 import fig2 as p000
    from vidtrack.papers.p000.experiment import CELLS
    from vidtrack.papers.p002 import fig1, fig2
    from vidtrack.papers.p002.experiment import study

    seconds = {"imports": perf_counter() - began}

    def timed(name: str, work: object) -> None:
        start = perf_counter()
        work(np.random.default_rng(0))
        seconds[name] = perf_counter() - start

    cases = (*fig1.CASES, *fig2.CASES)
    timed(
        f"002, {len(cases)} cases of {runs} runs, two filters", lambda rng: [study(case, runs, rng) for case in cases]
    )
    timed("002, 10000 runs of one case, two filters", lambda rng: study(cases[0], 10_000, rng))
    timed(f"000, 4 cases of {runs} runs", lambda rng: [p000.study(cell, runs, rng) for cell in CELLS])
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        print(json.dumps(experiments(options.runs)))
        return
    command = [sys.executable, __file__, "--child", "--runs", str(options.runs)]
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
        first, later = (
            json.loads(subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout)
            for _ in range(2)
        )
    print(f"{'seconds':50} {'first':>8} {'later':>8}")
    for name in first:
        print(f"{name:50} {first[name]:8.2f} {later[name]:8.2f}")
    print(f"{'all':50} {sum(first.values()):8.2f} {sum(later.values()):8.2f}")


if __name__ == "__main__":
    main()
