"""How long a first run takes: nothing is compiled yet.

    python tools/benchmark_first_run.py [--rounds 2] [video stored radar predict threshold psn eval warm]

Each command runs on samples, with an empty folder for its kernels, and once more with what is kept then. Times by the
clock, of all rounds; processor time, the mean of the rounds, of all its processes but those that it ends. The last
column is the number of kernels that are kept.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from tempfile import TemporaryDirectory
from time import perf_counter

ROOT = Path(__file__).parent.parent
SAMPLES = ROOT / "samples"
COMMANDS = {
    "video": ["track", str(SAMPLES / "junction.avi"), "-o", "run", "--force"],
    "stored": ["track", "boxes/junction/det.txt", "-o", "run", "--force"],
    "radar": ["radar", "tws/plots.csv", "-o", "run", "--force"],
    "predict": ["predict", "--snr-db", "13", "--pfa", "1e-3", "--runs", "1000"],
    "threshold": ["threshold", "--filter", "pda", "--snr-db", "13", "--cells", "100"],
    "psn": ["threshold", "--filter", "psn", "--snr-db", "13"],
    "eval": ["eval", "boxes/junction/gt.txt", "boxes/junction/gt.txt"],
    "warm": ["doctor", "--warm"],
}


def vidtrack(command: list[str], folder: Path, kernels: Path) -> tuple[float, float]:
    """Seconds by the clock and of the processor that a command takes in a folder."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(kernels)}
    used, begin = _used(), perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "vidtrack", *command],
        cwd=folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    seconds = perf_counter() - begin
    if done.returncode:
        raise SystemExit(f"vidtrack {' '.join(command)}: {done.stderr.strip()}")
    return seconds, _used() - used


def _used() -> float:
    """Processor time of the processes that have ended [s]."""
    usage = getrusage(RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def prepare(folder: Path) -> None:
    """The inputs of the commands."""
    sequence = folder / "boxes" / "junction"
    sequence.mkdir(parents=True)
    vidtrack(["simulate", "radar-tws", "-o", "tws"], folder, folder / "other kernels")
    truth = (SAMPLES / "junction.txt").read_text(encoding="utf-8")
    for name in ("gt.txt", "det.txt"):
        (sequence / name).write_text(truth, encoding="utf-8")
    (sequence / "seqinfo.ini").write_text("[Sequence]\nname=junction\nframeRate=15\n", encoding="utf-8")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commands", nargs="*", metavar="COMMAND", help=", ".join(COMMANDS))
    parser.add_argument("--rounds", type=int, default=2)
    options = parser.parse_args()
    print(f"{'':12s}{'first, s':>20s}{'processor, s':>14s}{'again, s':>10s}{'kernels':>9s}")
    with TemporaryDirectory() as place:
        folder = Path(place)
        prepare(folder)
        for name in options.commands or COMMANDS:
            first, processor, again, kept = [], [], [], 0
            for k in range(options.rounds):
                kernels = folder / f"kernels of {name} {k}"
                seconds, used = vidtrack(COMMANDS[name], folder, kernels)
                first.append(seconds)
                processor.append(used)
                again.append(vidtrack(COMMANDS[name], folder, kernels)[0])
                kept = sum(1 for _ in kernels.rglob("*.nbi"))
            times = ", ".join(f"{each:.1f}" for each in first)
            mean = sum(processor) / len(processor)
            print(f"{name:12s}{times:>20s}{mean:14.1f}{min(again):10.1f}{kept:9d}", flush=True)


if __name__ == "__main__":
    main()
