"""A day of a counting station in fast motion, without pixels: its counts with faults, beside those without.

    python tools/station_day.py [--cameras 16] [--first 0] [--hours 24] [--seed 0] [--processes 2] [--folder DIR]

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
import os
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from station_world import GATES, KILLED, RATE, SIZE, Faults, Traffic, World, faults_of, no_faults

from vidtrack.config.load import load
from vidtrack.errors import Error
from vidtrack.output.confirmed import LIVE_HOLD_S, Confirmed
from vidtrack.output.intervals.day import day_folders, read_day
from vidtrack.recording.reserve import Reserve
from vidtrack.recording.retention import Limits, Retention
from vidtrack.run.live.checkpoint import Checkpoint, CheckpointFile
from vidtrack.run.live.counting import COUNTS, counting_of
from vidtrack.run.live.parts import Parts
from vidtrack.run.sinks import Subject, line_counter
from vidtrack.run.steps import scan_steps
from vidtrack.run.trackers import build_box_tracker
from vidtrack.scan import Scan
from vidtrack.video.frame import Frame

WARM_S = 15.0
"""s after a fault in which a vehicle may be counted twice: the one on the line has got a new track"""
NEAR_S = 1.0
"""s by which the times of a crossing differ in two runs: two scans"""
STOPPED, REFUSED, BROKEN = 0, 75, 70
SETTINGS = (
    *("live.zone=Europe/Berlin", "live.roll_s=3600", "output.level=counts", "tracker.coast_s=2"),
    ("output.lines", [f"{name}:{x},0,{x},239" for name, x in GATES.items()]),
)


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
    if world.dies_s <= until_s:
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
        spans.append(day.watched - faults.begin_s)
        for row in day.crossings.to_pylist():
            wall = row["utc"].timestamp() - faults.begin_s

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
    parser.add_argument("--first", type=int, default=0, help="number of the first camera")
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--folder", type=Path, help="where the results stay; best on a disk in memory")
    options = parser.parse_args()
    total: Counter = Counter()
    with tempfile.TemporaryDirectory() as temporary, get_context("fork").Pool(options.processes, load_kernels) as pool:
        work = partial(drawn_day, options.folder or Path(temporary), options.seed, 3600 * options.hours)
        for done, result in enumerate(
            pool.imap_unordered(work, range(options.first, options.first + options.cameras)), 1
        ):
            total += result
            print(f"{done} cameras: {dict(total)}", flush=True)
    for name, value in total.items():
        print(f"{name:16} {value}")
    return int(total["missed"] + total["invented"] > 0)


if __name__ == "__main__":
    sys.exit(main())
