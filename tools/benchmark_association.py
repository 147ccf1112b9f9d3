"""Time the association methods, measure the error of belief propagation and the coalescence of JPDA.

    python tools/benchmark_association.py [--peers-in DIR] [--tracks 10 100 1000 10000] [--runs 500]

1. Whole scans: tracks at random, one on each 100 square sigmas, P_D 0.9, clutter so that a track's gate holds 0.4
   false measurements in the mean; the gate and each method's decision are timed, medians of 9 rounds.
2. Fully coupled clusters, every measurement in every gate: exact JPDA, JPDA*, belief propagation, and, with
   --peers-in, the associators of Stone Soup on the same problems (in an environment that pip makes in DIR), with the
   largest difference of any weight from our exact ones.
3. Belief propagation against exact weights over 1,000 random clusters of 2 to 8 tracks, 2 to 10 measurements, with some
   clutter and with next to none.
4. Coalescence: two targets side by side for 60 scans at distances of 1 to 4 sigma of the measurements, P_D 0.9,
   clutter 0.001 per square sigma; the share of runs that end with the estimates closer than half the true distance,
   and with the estimates the other way round.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
from peers.environment import python_of

import vidtrack as vt
from vidtrack.arrays.types import Floats
from vidtrack.associate.hard import Associator
from vidtrack.associate.problem import Problem
from vidtrack.decision import Decision

GATE = 0.999
WHOLE: dict[str, Associator] = {"gnn": vt.GNN(), "pda": vt.PDA(), "jpda": vt.JPDA()}
CLUSTER: dict[str, Associator] = {
    "exact": vt.JPDA(largest=2**24),
    "star": vt.JPDA(largest=2**24, star=True),
    "belief": vt.JPDA(largest=0),
}
FOLLOW: dict[str, Associator] = {"nn": vt.NN(), **WHOLE, "jpda*": vt.JPDA(star=True)}
COUPLED = ((2, 3), (5, 7), (8, 10), (10, 12))
PEERS = {"jpda": 10, "ehm2": 80, "lbp": 120}
"""Associators of Stone Soup, and the most pairs that each is given: beyond, it takes minutes."""


def crowd(tracks: int, rng: np.random.Generator) -> tuple[Floats, Problem]:
    """Predicted positions and the problem of a whole scan."""
    side = 10.0 * np.sqrt(tracks)
    zhat = rng.uniform(0, side, (tracks, 2))
    seen = zhat[rng.random(tracks) < 0.9]
    false = rng.uniform(0, side, (rng.poisson(0.01 * side**2), 2))
    z = np.concatenate([seen + rng.normal(0, np.sqrt(2.0), seen.shape), false])
    cov = np.tile(np.eye(2), (tracks, 1, 1))
    return zhat, Problem.gated(vt.Gate(GATE), zhat, cov, vt.Scan(0.0, z, np.eye(2)), 0.9, 0.01)


def cluster(
    tracks: int, measurements: int, rng: np.random.Generator, gate: float = GATE, clutter: float = 0.02
) -> tuple[Floats, Problem]:
    """Predicted positions and the problem of one cluster: tracks and measurements about one place."""
    zhat, z = rng.normal(size=(tracks, 2)), rng.normal(size=(measurements, 2))
    cov = np.tile(3 * np.eye(2), (tracks, 1, 1))
    return zhat, Problem.gated(vt.Gate(gate), zhat, cov, vt.Scan(0.0, z, np.eye(2)), 0.9, clutter)


def coupled(tracks: int, measurements: int, rng: np.random.Generator) -> tuple[Floats, Problem]:
    """A cluster with every measurement in every gate."""
    while True:
        zhat, problem = cluster(tracks, measurements, rng)
        if len(problem.pairs) == tracks * measurements:
            return zhat, problem


def weights(problem: Problem, decision: Decision) -> Floats:
    """(T, 1 + M), those of a miss in front."""
    table = np.zeros((problem.rows, 1 + problem.measurements))
    table[:, 0] = decision.beta0
    table[decision.row, 1 + decision.measurement] = decision.beta
    return table


def median_ms(call: Callable[[], object], rounds: int = 9) -> float:
    """Median of the rounds, after one that compiles."""
    call()
    seconds = np.empty(rounds)
    for k in range(rounds):
        begin = perf_counter()
        call()
        seconds[k] = perf_counter() - begin
    return 1e3 * float(np.median(seconds))


def decision_ms(method: Associator, problem: Problem) -> float:
    """Time of a method's decision, with a fresh problem each time: it remembers its likelihoods."""
    return median_ms(lambda: method.decide(replace(problem)))


def whole_scans(counts: list[int]) -> None:
    """Print the times of the gate and of each method."""
    print(f"\nwhole scans [ms]\n{'tracks':>8s}{'pairs':>8s}{'gate':>10s}" + "".join(f"{name:>10s}" for name in WHOLE))
    for count in counts:
        zhat, problem = crowd(count, np.random.default_rng(0))
        gate = median_ms(partial(vt.Gate(GATE).pairs, zhat, problem.cov, problem.scan))
        methods = [decision_ms(method, problem) for method in WHOLE.values()]
        print(f"{count:8d}{len(problem.pairs):8d}" + "".join(f"{ms:10.3f}" for ms in (gate, *methods)))


def coupled_clusters(folder: Path | None) -> None:
    """Print the times of exact and approximate joint weights, and those of the peers."""
    names = [*CLUSTER, *PEERS] if folder else [*CLUSTER]
    print(
        f"\nfully coupled clusters [ms]; largest difference from exact\n{'':10s}" + "".join(f"{n:>18s}" for n in names)
    )
    for size in COUPLED:
        zhat, problem = coupled(*size, np.random.default_rng(0))
        exact = weights(problem, CLUSTER["exact"].decide(problem))
        cells = []
        for method in CLUSTER.values():
            off = np.abs(weights(problem, method.decide(problem)) - exact).max()
            cells.append(f"{decision_ms(method, problem):9.3f}{off:9.1e}")
        for name, most in PEERS.items():
            if folder is None:
                break
            if len(problem.pairs) > most:
                cells.append(f"{'-':>18s}")
                continue
            seconds, table = run_peer(name, zhat, problem, folder)
            cells.append(f"{1e3 * seconds:9.1f}{np.abs(table - exact).max():9.1e}")
        print(f"{size[0]:4d} x {size[1]:<3d}" + "".join(cells))


def run_peer(name: str, zhat: Floats, problem: Problem, folder: Path) -> tuple[float, Floats]:
    """Median seconds and weights of a peer."""
    worker = Path(__file__).parent / "peers" / "associate.py"
    with tempfile.TemporaryDirectory() as place:
        given, result = Path(place) / "data.npz", Path(place) / "result.npz"
        np.savez(
            given, zhat=zhat, cov=problem.cov, z=problem.scan.z, R=problem.scan.R[0],
            detection=problem.detection[0], clutter=problem.clutter[0], gate=GATE, rounds=3,
        )  # fmt: skip
        subprocess.run([python_of("numpy2", folder), worker, name, given, result], check=True)
        with np.load(result) as stored:
            return float(np.median(stored["seconds"])), stored["weights"]


def belief_error(clutter: float, count: int = 1000) -> None:
    """Print how far belief propagation is from the exact weights, with so much clutter [per unit of area]."""
    rng = np.random.default_rng(0)
    worst = np.empty(count)
    for k in range(count):
        tracks, measurements = rng.integers(2, (9, 11))
        _, problem = cluster(int(tracks), int(measurements), rng, rng.choice([0.9, 0.99, 0.999]), clutter)
        exact, close = (weights(problem, CLUSTER[name].decide(problem)) for name in ("exact", "belief"))
        worst[k] = np.abs(exact - close).max()
    print(f"\nbelief propagation, {count} random clusters, clutter {clutter:g}: ", end="")
    print(f"largest error of a weight {worst.max():.3f}, ", end="")
    print(f"its median over clusters {np.median(worst):.4f}, 95 % of clusters below {np.quantile(worst, 0.95):.3f}")


def coalescence(runs: int) -> None:
    """Print what becomes of two targets side by side."""
    print(f"\ntwo targets side by side, {runs} runs: coalesced, swapped")
    print(f"{'sigmas':>8s}" + "".join(f"{name:>16s}" for name in FOLLOW))
    for apart in (1.0, 2.0, 3.0, 4.0):
        cells = []
        for method in FOLLOW.values():
            ratio = side_by_side(method, apart, runs)
            cells.append(f"{(np.abs(ratio) < 0.5).mean():8.1%}{(ratio <= -0.5).mean():8.1%}")
        print(f"{apart:8.0f}" + "".join(cells))


def side_by_side(method: Associator, apart: float, runs: int, scans: int = 60) -> Floats:
    """(runs,) signed distance of the estimates over the true one, across the direction of travel, at the end."""
    rng = np.random.default_rng(0)
    model = vt.ConstantVelocity(dim=2, accel=0.1)
    tracker = vt.Tracker(
        model, method, GATE, vt.LifeCycle(coast_scans=62), births=False,
        detection_probability=0.9, clutter_density=1e-3,
    )  # fmt: skip
    run = np.repeat(np.arange(runs), 2)
    truth = np.tile([[0.0, 1.0, 0.0, 0.0], [0.0, 1.0, apart, 0.0]], (runs, 1))
    cov = np.tile(np.diag([0.5, 0.1, 0.5, 0.1]), (2 * runs, 1, 1))
    tracker.add(0.0, truth + rng.normal(size=truth.shape) * np.sqrt(np.diag(cov[0])), cov, run)
    for k in range(1, scans + 1):
        xy = truth[:, [0, 2]] + [float(k), 0.0]
        seen = rng.random(2 * runs) < 0.9
        number = rng.poisson(1e-3 * 40**2, runs)
        place = np.repeat(xy[::2], number, axis=0) + rng.uniform(-20, 20, (number.sum(), 2))
        z = np.concatenate([xy[seen] + rng.normal(size=(seen.sum(), 2)), place])
        of = np.concatenate([run[seen], np.repeat(np.arange(runs), number)])
        tracks = tracker.step(vt.Scan(float(k), z, np.eye(2), run=of))
    y = tracks.xy[np.argsort(tracks.id), 1]
    return (y[1::2] - y[::2]) / apart


def main() -> None:
    """Run all four parts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peers-in", type=Path, metavar="DIR", help="folder of the peers' environments")
    parser.add_argument("--tracks", type=int, nargs="+", default=[10, 100, 1000, 10_000])
    parser.add_argument("--runs", type=int, default=500, help="of the parallel targets (default 500)")
    options = parser.parse_args()
    whole_scans(options.tracks)
    coupled_clusters(options.peers_in)
    for clutter in (0.02, 1e-5):
        belief_error(clutter)
    coalescence(options.runs)


if __name__ == "__main__":
    main()
