"""The world of a counting station in fast motion: its traffic, what goes wrong, and clocks and disk in their place."""

from __future__ import annotations

import errno
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from vidtrack.estimate.noise import box_noise
from vidtrack.output import folder as folder_module
from vidtrack.run.live import checkpoint as checkpoint_module
from vidtrack.run.live import parts as parts_module
from vidtrack.scan import Scan

BEGIN_S = 1_792_888_200.0  # 2026-10-25 02:30 in Berlin
RATE, SIZE, BOX = 2.0, (320.0, 240.0), (36.0, 18.0)
LANES = ((40.0, 30.0), (90.0, 22.0), (150.0, -26.0), (200.0, -18.0))  # y [px], speed [px/s]
GATES = {"west": 110.0, "east": 210.0}
HEADWAY_S, VEHICLES_PER_S = 3.5, 1 / 15  # least time between two in a lane; mean rate of a lane
SEEN = 0.97
KILLED = 9
"""Exit code of a process that is killed"""


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
    begin_s   Unix time of the begin
    """

    lost: list[tuple[float, float]]
    full: list[tuple[float, float]]
    ends: list[tuple[float, float, bool]]
    steps: list[tuple[float, float]]
    begin_s: float = BEGIN_S

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

    now     seconds after the begin
    dies_s  time of the kill
    """

    def __init__(self, faults: Faults, now: float, dies_s: float, rng: np.random.Generator) -> None:
        self.now = now
        self.dies_s = dies_s
        self._faults, self._rng = faults, rng
        self._append = folder_module.append

    def take_over(self) -> None:
        """Replace them in this process, and have its threads run at once, so that a seed gives one day."""
        time.time = lambda: self._faults.begin_s + self.now + self._faults.offset(self.now)
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
        if self.now >= self.dies_s:
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
            if self.now >= self.dies_s:
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
