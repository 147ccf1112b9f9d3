"""A day of a counting station in fast motion, without pixels: its counts with faults, beside those without.

    python tools/station_day.py [--cameras 16] [--hours 24] [--seed 0] [--processes 2] [--folder DIR]

Each camera sees vehicles as boxes, two scans a second, on a simulated clock; tracker, lines, parts, counts by interval
and saved state are those of `vidtrack live`. The day begins half an hour before Berlin leaves
daylight saving time. Faults are drawn from the seed: cameras that do not deliver, kills (half of them within a write),
ends, steps of the wall clock by up to two hours, full disks. After a kill or an end a new process goes on from the
saved state. The reference is the same traffic without faults.

Every crossing of the reference has to be in the files of the intervals once, or in a time that they say was not
watched; none may be there that the reference lacks, but for WARM_S after a fault. The exit code is 1 if one is.
"""

from __future__ import annotations

import argparse
import errno
import os
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from vidtrack.config.load import load
from vidtrack.errors import Error
from vidtrack.estimate.noise import box_noise
from vidtrack.output import folder as folder_module
from vidtrack.output.confirmed import LIVE_HOLD_S, Confirmed
from vidtrack.output.intervals.day import day_folders, read_day
from vidtrack.recording.reserve import Reserve
from vidtrack.recording.retention import Limits, Retention
from vidtrack.run.live import checkpoint as checkpoint_module
from vidtrack.run.live import parts as parts_module
from vidtrack.run.live.checkpoint import Checkpoint, CheckpointFile
from vidtrack.run.live.counting import COUNTS, counting_of
from vidtrack.run.live.parts import Parts
from vidtrack.run.sinks import Subject, line_counter
from vidtrack.run.steps import scan_steps
from vidtrack.run.trackers import build_box_tracker
from vidtrack.scan import Scan
from vidtrack.video.frame import Frame

BEGIN_S = 1_792_888_200.0  # 2026-10-25 02:30 in Berlin
RATE, SIZE, BOX = 2.0, (320.0, 240.0), (36.0, 18.0)
LANES = ((40.0, 30.0), (90.0, 22.0), (150.0, -26.0), (200.0, -18.0))  # y [px], speed [px/s]
GATES = {"west": 110.0, "east": 210.0}
HEADWAY_S, VEHICLES_PER_S = 3.5, 1 / 15  # least time between two in a lane; mean rate of a lane
SEEN = 0.97
WARM_S = 15.0
"""s after a fault in which a vehicle may be counted twice: the one on the line has got a new track"""
NEAR_S = 1.0
"""s by which the times of a crossing differ in two runs: two scans"""
STOPPED, KILLED, REFUSED, BROKEN = 0, 9, 75, 70
SETTINGS = (
    *("live.zone=Europe/Berlin", "live.roll_s=3600", "output.level=counts", "tracker.coast_s=2"),
    ("output.lines", [f"{name}:{x},0,{x},239" for name, x in GATES.items()]),
)


class Traffic:
    """The scans of a camera, and when each vehicle crosses each gate [s after the begin]."""

    def __init__(self, seed: int, camera: int, seconds: float) -> None:
        rng = np.random.default_rng((seed, camera, 1))
        scan, vehicle, xy = [], [], []
        self.crossing: dict[tuple[int, str], float] = {}
        count = 0
        for y, speed in LANES:
            gaps = HEADWAY_S + rng.exponential(1 / VEHICLES_PER_S - HEADWAY_S, int(seconds * VEHICLES_PER_S * 1.5) + 9)
            begin = np.cumsum(gaps) - rng.uniform(0, 20)
            begin = begin[begin < seconds]
            way = (SIZE[0] - BOX[0]) / abs(speed)
            first = 0.5 * BOX[0] if speed > 0 else SIZE[0] - 0.5 * BOX[0]
            for t in begin:
                k = np.arange(max(0, np.ceil(t * RATE)), min(seconds, t + way) * RATE, dtype=np.int64)
                k = k[rng.random(len(k)) < SEEN]
                scan.append(k)
                vehicle.append(np.full(len(k), count))
                xy.append(np.column_stack([first + speed * (k / RATE - t), np.full(len(k), y)]))
                for gate, x in GATES.items():
                    self.crossing[count, gate] = t + (x - first) / speed
                count += 1
        of_scan = np.concatenate(scan)
        order = np.argsort(of_scan, kind="stable")
        self.scans = int(seconds * RATE)
        self._bounds = np.searchsorted(of_scan[order], np.arange(self.scans + 1))
        self._vehicle = np.concatenate(vehicle)[order]
        self._xy = np.concatenate(xy)[order] + rng.normal(0, 0.7, (len(order), 2))

    def at(self, k: int, t: float) -> tuple[Scan, np.ndarray]:
        """Scan number k with the time t, and the vehicle of each of its boxes."""
        rows = slice(self._bounds[k], self._bounds[k + 1])
        xy = self._xy[rows]
        box = np.column_stack([np.tile([-0.5 * BOX[0], -0.5 * BOX[1]], (len(xy), 1)), np.tile(BOX, (len(xy), 1))])
        return Scan(t, xy, box_noise(np.full(len(xy), BOX[0]), 0.05), box=box), self._vehicle[rows]


@dataclass(frozen=True)
class Faults:
    """What goes wrong at a camera: spans (begin, end) and times [s after the begin].

    ends   (time, pause, whether it is a kill) of the processes
    steps  (time, offset) of the wall clock from then on
    """

    lost: list[tuple[float, float]]
    full: list[tuple[float, float]]
    ends: list[tuple[float, float, bool]]
    steps: list[tuple[float, float]]

    def offset(self, t: float) -> float:
        """Of the wall clock [s]."""
        return next((offset for begin, offset in reversed(self.steps) if begin <= t), 0.0)


def no_faults() -> Faults:
    """Of the reference."""
    return Faults([], [], [], [(0.0, 0.0)])


def faults_of(seed: int, camera: int, seconds: float) -> Faults:
    """Of a camera."""
    rng = np.random.default_rng((seed, camera, 2))

    def times(every_s: float) -> list[float]:
        return np.sort(rng.uniform(0, seconds, rng.poisson(seconds / every_s))).tolist()

    def spans(every_s: float, longest_s: float) -> list[tuple[float, float]]:
        return [(t, t + float(np.exp(rng.uniform(0, np.log(longest_s))))) for t in times(every_s)]

    ends = [(begin, end - begin, bool(rng.random() < 0.7)) for begin, end in spans(900, 300)]
    steps = [(t, float(rng.choice([-1, 1]) * np.exp(rng.uniform(0, np.log(7200))))) for t in times(7200)]
    return Faults(spans(1200, 180), spans(3600, 180), ends, [(0.0, 0.0), *steps])


class World:
    """Clocks and disk of one process, in place of the machine's.

    now  seconds after the begin
    """

    def __init__(self, faults: Faults, now: float, dies_s: float, rng: np.random.Generator) -> None:
        self.now = now
        self._faults, self._dies_s, self._rng = faults, dies_s, rng
        self._append = folder_module.append

    def take_over(self) -> None:
        """Replace them in this process, and have its threads run at once, so that a seed gives one day."""
        time.time = lambda: BEGIN_S + self.now + self._faults.offset(self.now)
        time.monotonic = lambda: self.now
        replaced = {
            "append": (folder_module.append, self.append),
            "replacing": (folder_module.replacing, partial(self.replacing, folder_module.replacing)),
            "write_state": (checkpoint_module.write_state, partial(self.write_state, checkpoint_module.write_state)),
        }
        for module in [module for name, module in sys.modules.items() if name.startswith("vidtrack")]:
            for name, (real, own) in replaced.items():
                if getattr(module, name, None) is real:
                    setattr(module, name, own)
        checkpoint_module.Thread = parts_module.Thread = AtOnce

    def append(self, file, block: bytes) -> None:
        """As in `output.folder`, but for a kill or a full disk after a part of the block."""
        if self.now >= self._dies_s:
            file.write(block[: self._rng.integers(len(block) + 1)])
            os._exit(KILLED)
        self._append(Full(file, self._rng) if self._is_full() else file, block)

    @contextmanager
    def replacing(self, real, path: Path) -> Iterator[Path]:
        """As in `output.folder`, but for a kill before the new content is in place."""
        with folder_module.writing(path):
            self._need_room()
        with real(path) as new:
            yield new
            if self.now >= self._dies_s:
                os._exit(KILLED)

    def write_state(self, real, path: Path, state) -> None:
        """As in `vidtrack.state`."""
        self._need_room()
        real(path, state)

    def _is_full(self) -> bool:
        return any(begin <= self.now < end for begin, end in self._faults.full)

    def _need_room(self) -> None:
        if self._is_full():
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


class Full:
    """A file on a disk that has room for a part of a block at most."""

    def __init__(self, file, rng: np.random.Generator) -> None:
        self._file, self._rng = file, rng
        self.tell, self.seek, self.truncate = file.tell, file.seek, file.truncate

    def write(self, block) -> int:
        if len(block) == 0:
            return 0
        self._file.write(block[: self._rng.integers(len(block))])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


class AtOnce:
    """A thread that has run when it is started."""

    def __init__(self, target, args=(), **_) -> None:
        self.start = lambda: target(*args)

    def is_alive(self) -> bool:
        return False

    def join(self, timeout: float | None = None) -> None:
        pass


class NoPictures:
    """In place of a detector."""

    STATE = ()


class Batch:
    """Sink that keeps steps until they are taken."""

    def __init__(self) -> None:
        self._steps = []

    def step(self, step) -> None:
        self._steps.append(step)

    def close(self) -> None:
        pass

    def take(self) -> list:
        taken, self._steps = self._steps, []
        return taken


def process(folder: Path, traffic: Traffic, faults: Faults, world: World, until_s: float) -> None:
    """One process of a camera, as `run.live.run` has it: from the saved state until its end. Raises Error."""
    out, began = folder / "out", world.now
    settings = load(assignments=SETTINGS)
    file = CheckpointFile(folder / "state", replace=True)
    tracker = build_box_tracker(settings.tracker, settings.detections, SIZE)
    checkpoint = Checkpoint(NoPictures(), tracker, Frame.blank((240, 320), coloured=False))
    media, number = 0.0, file.first
    if file.found is not None:
        checkpoint.restore(file.found)
        media = file.found["time_s"] + max(0.0, time.time() - file.found["unix_s"])
        number = file.found["frame"] + 1
    elif file.first:
        tracker.register.next_id = file.first
    origin = began - media
    counter = line_counter(settings, 320, 240)
    subject = Subject("cam", settings, (240, 320), RATE, None, dict, counter, None)
    counting = counting_of(subject, out / COUNTS, lambda: time.time() - (world.now - origin))
    parts = Parts(out, subject, False, settings.live.roll_s, Retention(Limits()), counting, Reserve(0))
    batch = Batch()
    confirmed = Confirmed(batch, hold_s=LIVE_HOLD_S)
    whose: dict[int, int] = {}
    lost = iter(sorted(faults.lost))
    outage = next(lost, None)

    def scans() -> Iterator[tuple[int, Scan]]:
        nonlocal outage
        for place, k in enumerate(range(int(np.ceil(began * RATE)), min(traffic.scans, int(until_s * RATE)))):
            world.now = k / RATE
            while outage is not None and outage[1] <= world.now:
                outage = next(lost, None)
            if outage is not None and outage[0] <= world.now:
                continue
            scan, scans.vehicles = traffic.at(k, world.now - origin)
            file.offer(checkpoint)
            yield number + place, scan

    with (folder / "whose").open("a", buffering=1) as note:
        for step in scan_steps(scans(), tracker):
            world.now += 0.1  # for what it takes
            checkpoint.note(step)
            confirmed.step(step)
            for track, measurement in zip(step.tracks.id.tolist(), step.tracks.measurement.tolist(), strict=True):
                if measurement >= 0 and whose.get(track) != (one := int(scans.vehicles[measurement])):
                    whose[track] = one
                    note.write(f"{track},{one}\n")
            if step.index % 4 == 3:
                with suppress(Error, OSError):  # as the thread that writes: what is lost is counted
                    parts.write(batch.take())
    world.now = max(world.now, until_s)
    if world._dies_s <= until_s:
        os._exit(KILLED)
    confirmed.close()
    with suppress(Error, OSError):
        parts.write(batch.take())
        parts.finish()
    file.close(checkpoint, 0.0)


def load_kernels() -> None:
    """Load what is compiled, once for all processes that are forked from this one."""
    settings = load(assignments=SETTINGS)
    traffic = Traffic(0, 0, 60.0)
    tracker = build_box_tracker(settings.tracker, settings.detections, SIZE)
    for _ in scan_steps(((k, traffic.at(k, k / RATE)[0]) for k in range(traffic.scans)), tracker):
        pass


def forked(work) -> int:
    """The exit code of a process of its own."""
    child = os.fork()
    if child == 0:
        try:
            work()
            os._exit(STOPPED)
        except Error:
            os._exit(REFUSED)
        except BaseException:
            traceback.print_exc()
            os._exit(BROKEN)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def live(folder: Path, traffic: Traffic, faults: Faults, seconds: float, seed: int) -> tuple[Counter, list[float]]:
    """All processes of a camera; how they ended, and when each began."""
    folder.mkdir(parents=True)
    now, begins, ended = 0.0, [], Counter()
    rng = np.random.default_rng((seed, 3))
    for at, pause_s, kills in [*faults.ends, (seconds, 0.0, False)]:
        while now < at:
            dies_s = at - (rng.uniform(0, 3) if rng.random() < 0.5 else 0.0) if kills else np.inf
            begins.append(now)

            def work(now=now, at=at, dies_s=dies_s, own=int(rng.integers(2**60))) -> None:  # noqa: B008
                world = World(faults, now, dies_s, np.random.default_rng(own))
                world.take_over()
                process(folder, traffic, faults, world, at)

            code = forked(work)
            ended[code] += 1
            if code == BROKEN:
                raise RuntimeError(f"a process of {folder} failed")
            now = now + 5.0 if code == REFUSED else at + pause_s
    return ended, begins


def counted(folder: Path, traffic: Traffic, faults: Faults) -> tuple[list[tuple[int, str, str, float]], np.ndarray]:
    """(vehicle, gate, direction, time) of all crossings in the files, and (S, 2) what was watched; wall clock."""
    vehicles: dict[int, list[int]] = {}
    for line in (folder / "whose").read_text().splitlines():
        track, vehicle = map(int, line.split(","))
        vehicles.setdefault(track, []).append(vehicle)
    found, spans = [], [np.empty((0, 2))]
    for day in map(read_day, day_folders(folder / "out" / COUNTS)):
        spans.append(day.watched - BEGIN_S)
        for row in day.crossings.to_pylist():
            wall = row["utc"].timestamp() - BEGIN_S

            def error(vehicle, gate=row["gate"], wall=wall) -> float:
                t = traffic.crossing[vehicle, gate]
                return abs(t + faults.offset(t) - wall)

            vehicle = min(vehicles[row["track_id"]], key=error)
            found.append((vehicle, row["gate"], row["direction"], wall))
    return found, np.concatenate(spans)


def compared(reference, faulty, traffic: Traffic, faults: Faults, begins: list[float], seconds: float) -> Counter:
    """How often what happened. `missed` and `invented` must not."""
    expected = Counter(row[:3] for row in reference)
    (rows, watched), result = faulty, Counter(reference=sum(expected.values()), counted=len(faulty[0]))
    there = Counter(row[:3] for row in rows)
    bounds = [begin for begin, _ in faults.steps]
    passes = [
        (begin + offset, end + offset)
        for (begin, offset), end in zip(faults.steps, [*bounds[1:], seconds], strict=True)
    ]  # the times that the wall clock told

    def unwatched(vehicle: int, gate: str) -> bool:
        t = traffic.crossing[vehicle, gate]
        wall = t + faults.offset(t) + np.linspace(-NEAR_S, NEAR_S, 9)
        covers = ((watched[:, :1] <= wall) & (wall < watched[:, 1:])).sum(axis=0)
        told = sum(((begin <= wall) & (wall < end)).astype(int) for begin, end in passes)
        return bool((covers < told).any())

    disturbed = [*begins, *(end for _, end in faults.lost), *bounds, *(end for _, end in faults.full)]
    for key, times in expected.items():
        if there[key] == 0:
            result["in a stated gap" if unwatched(*key[:2]) else "missed"] += times
            if not unwatched(*key[:2]):
                print("missed", key, traffic.crossing[key[:2]], flush=True)
        else:
            result["once"] += there[key] == times
    for key, times in there.items():
        if times > expected[key]:
            t = traffic.crossing[key[:2]]
            warm = any(-NEAR_S < t - begin < WARM_S for begin in disturbed)
            result["in a warm-up" if warm else "invented"] += times - expected[key]
            if not warm:
                print("invented", key, times, expected[key], t, flush=True)
    result["seconds watched"] = round(float((watched[:, 1] - watched[:, 0]).sum()))
    return result


def camera_day(folder: Path, traffic: Traffic, faults: Faults, seconds: float, seed: int) -> Counter:
    """The comparison of one camera."""
    live(folder / "sound", traffic, no_faults(), seconds, seed)
    ended, begins = live(folder / "hurt", traffic, faults, seconds, seed)
    reference, _ = counted(folder / "sound", traffic, no_faults())
    result = compared(reference, counted(folder / "hurt", traffic, faults), traffic, faults, begins, seconds)
    result.update({"seconds": round(seconds), "processes": sum(ended.values()), "kills": ended[KILLED]})
    result.update({"ends": ended[STOPPED], "refused starts": ended[REFUSED], "outages": len(faults.lost)})
    result.update({"full disks": len(faults.full), "clock steps": len(faults.steps) - 1})
    return result


def drawn_day(folder: Path, seed: int, seconds: float, camera: int) -> Counter:
    """The comparison of one camera, with traffic and faults of the seed."""
    faults = faults_of(seed, camera, seconds)
    return camera_day(folder / f"camera{camera}", Traffic(seed, camera, seconds), faults, seconds, 1000 * seed + camera)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cameras", type=int, default=16)
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--folder", type=Path, help="where the results stay; best on a disk in memory")
    options = parser.parse_args()
    total: Counter = Counter()
    with tempfile.TemporaryDirectory() as temporary, get_context("fork").Pool(options.processes, load_kernels) as pool:
        work = partial(drawn_day, options.folder or Path(temporary), options.seed, 3600 * options.hours)
        for done, result in enumerate(pool.imap_unordered(work, range(options.cameras)), 1):
            total += result
            print(f"{done} cameras: {dict(total)}", flush=True)
    for name, value in total.items():
        print(f"{name:16} {value}")
    return int(total["missed"] + total["invented"] > 0)


if __name__ == "__main__":
    sys.exit(main())
