"""What a batch costs and survives.

    python tools/benchmark_batch.py files [--files 1000] [--damaged 0.05] [--workers 1] [--kills 0] [--dask local]
    python tools/benchmark_batch.py tasks [--tasks 10000]
    python tools/benchmark_batch.py cores [VIDEO] [--files 8]

files   copies of the bundled crossing's first pictures, a share of them damaged (cut, overwritten or empty), are
        tracked by `vidtrack batch`; N times at random moments one of its processes is killed. Printed: what became of
        the files, against what must become of them, and the resident memory of the process after each hundredth file.
tasks   empty tasks on a Dask cluster of this machine: the time of client, scheduler and worker for each.
cores   the same files by single runs, one after the other, and by `vidtrack batch` on 1 and 2 cores: wall-clock and CPU
        time, of all processes.
"""

from __future__ import annotations

import argparse
import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import av
import pyarrow.parquet as pq

SAMPLES = Path(__file__).parent.parent / "samples"
ROOT = Path(__file__).parent.parent
FRAMES = 8
SEED = 1
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}


def small_video(target: Path, frames: int = FRAMES) -> bytes:
    """The first pictures of the bundled crossing as a file of their own."""
    with av.open(str(SAMPLES / "crossing.avi")) as source, av.open(str(target), "w") as output:
        given = source.streams.video[0]
        stream = output.add_stream_from_template(given)
        stream.time_base = 1 / given.average_rate
        for number, packet in enumerate(source.demux(given)):
            if number < frames and packet.size:
                packet.stream, packet.time_base, packet.pts, packet.dts = stream, stream.time_base, number, number
                output.mux(packet)
    return target.read_bytes()


def damaged(content: bytes, kind: int, rng: random.Random) -> bytes:
    """The file empty, without its end, or overwritten from somewhere on."""
    at = rng.randrange(len(content) // 4, len(content))
    return (b"", content[:at], content[:at] + rng.randbytes(len(content) - at))[kind]


def children_of(pid: int) -> list[int]:
    """Processes of a batch that do its tasks."""
    found = subprocess.run(["pgrep", "-P", str(pid)], capture_output=True, text=True, check=False)
    return [int(line) for line in found.stdout.split()]


def resident_mb(pid: int) -> float:
    """What a process holds, in MB."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0]) / 1024


def batch(folder: Path, workers: int, dask: str | None) -> subprocess.Popen:
    """A running batch of the files in a folder."""
    more = ["--dask", dask] if dask else []
    command = [sys.executable, "-m", "vidtrack", "batch", "in", "-o", "out", "-q", "--workers", str(workers), *more]
    return subprocess.Popen(command, cwd=folder, env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def files(given: argparse.Namespace) -> None:
    """Track many small files, some damaged, while processes are killed."""
    rng = random.Random(SEED)
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "in").mkdir()
        content = small_video(folder / "one.avi")
        bad = set(rng.sample(range(given.files), round(given.damaged * given.files)))
        for k in range(given.files):
            made = damaged(content, k % 3, rng) if k in bad else content
            (folder / "in" / f"{k:05d}.avi").write_bytes(made)
        begun = time.monotonic()
        running = batch(folder, given.workers, given.dask)
        killed, told, memory = 0, 0, []
        while running.poll() is None:
            time.sleep(0.2)
            results = folder / "out" / "results"
            done = len(os.listdir(results)) if results.is_dir() else 0
            try:
                if done >= told + 100:
                    told = done
                    memory.append(round(max(map(resident_mb, children_of(running.pid)))))
                due = killed < given.kills * done / (0.9 * given.files)
                alive = children_of(running.pid)
                if due and alive:
                    os.kill(rng.choice(alive), signal.SIGKILL)
                    killed += 1
            except (OSError, ValueError, IndexError):  # it ended meanwhile
                continue
        rows = pq.read_table(folder / "out" / "index.parquet").to_pylist()
        whole = [row for row in rows if int(Path(row["source"]).stem) not in bad]
        print(f"files {len(rows)}, damaged {len(bad)}, kills {killed}, exit code {running.returncode}, "
              f"{time.monotonic() - begun:.0f} s")  # fmt: skip
        print(
            "whole files:",
            dict(Counter(row["state"] for row in whole)),
            "frames",
            dict(Counter(r["frames"] for r in whole)),
        )
        print("damaged files:", dict(Counter(row["state"] for row in rows if row not in whole)))
        print("attempts:", dict(Counter(row["attempts"] for row in rows)))
        print("folders of results:", len(os.listdir(folder / "out" / "results")), "left:", os.listdir(folder / "out"))
        print("MB of the process after each hundred:", memory)


def nothing(task: int) -> int:
    """An empty task."""
    return task


def tasks(given: argparse.Namespace) -> None:
    """Empty tasks, each with what a real one carries, through the executor that a batch uses."""
    from concurrent.futures import as_completed

    from vidtrack.run.batch.engines import engine

    with engine("local", 1) as found:
        begun, cpu = time.monotonic(), time.process_time()
        futures = [found.executor.submit(nothing, k) for k in range(given.tasks)]
        for future in as_completed(futures):
            future.result()
        wall, cpu = time.monotonic() - begun, time.process_time() - cpu
    print(
        f"{given.tasks} tasks: {1e3 * cpu / given.tasks:.2f} ms of CPU each (client, scheduler, worker), {wall:.0f} s"
    )
    print(f"resident {resident_mb(os.getpid()):.0f} MB")


def cores(given: argparse.Namespace) -> None:
    """Single runs against a batch on 1 and 2 cores."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "in").mkdir()
        for k in range(given.files):
            os.symlink(Path(given.video).absolute(), folder / "in" / f"{k}{Path(given.video).suffix}")

        def single() -> None:
            for k in range(given.files):
                command = [
                    sys.executable,
                    "-m",
                    "vidtrack",
                    "track",
                    f"in/{k}{Path(given.video).suffix}",
                    "-q",
                    "-o",
                    f"r{k}",
                ]
                subprocess.run(command, cwd=folder, env=ENVIRONMENT, check=True, stdout=subprocess.DEVNULL)

        for what, job in (
            ("single runs", single),
            *((f"batch, {n} cores", lambda n=n: batched(folder, n)) for n in (1, 2)),
        ):
            before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
            job()
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            print(f"{what}: {time.monotonic() - begun:.1f} s, CPU {cpu:.1f} s", flush=True)


def batched(folder: Path, workers: int) -> None:
    """A batch of the folder from the beginning."""
    running = batch(folder, workers, None)
    running.wait()
    os.rename(folder / "out", folder / f"out-{workers}")


def main() -> None:
    """Do one of the three."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = parser.add_subparsers(dest="kind", required=True)
    one = kinds.add_parser("files")
    one.add_argument("--files", type=int, default=1000)
    one.add_argument("--damaged", type=float, default=0.05)
    one.add_argument("--workers", type=int, default=1)
    one.add_argument("--kills", type=int, default=0)
    one.add_argument("--dask")
    one = kinds.add_parser("tasks")
    one.add_argument("--tasks", type=int, default=10_000)
    one = kinds.add_parser("cores")
    one.add_argument("video", nargs="?", default=str(SAMPLES / "junction.avi"))
    one.add_argument("--files", type=int, default=8)
    given = parser.parse_args()
    {"files": files, "tasks": tasks, "cores": cores}[given.kind](given)


if __name__ == "__main__":
    main()
