"""A live run for as many frames as fit into some minutes: memory, threads and file handles must stay flat.

    python tools/soak_live.py [--minutes 10] [--frames N] [--lost 5000] [--roll 5]

A camera made of the junction's pictures delivers every frame as fast as it is tracked, its connection is lost
after every 5,000 of them, and results go to parts of 5 s with --keep, --state and a counting line: the memory is
as large as it gets only after dozens of parts. Once in about 2,000 frames a line is printed: frames, frames/s,
resident MB, threads, file handles. At the end their slopes over the second half, per 100,000 frames with standard
errors. `--frames` ends it earlier.
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from threading import active_count

import av
import numpy as np

from vidtrack.config.load import load
from vidtrack.errors import SourceError
from vidtrack.run.live.leave import run_and_leave
from vidtrack.run.live.outputs import LiveExtras
from vidtrack.run.live.run import LiveRun
from vidtrack.video.live import source
from vidtrack.video.live.clock import CaptureClock

SAMPLE = Path(__file__).parent.parent / "samples" / "junction.avi"
LOOK = 2000


class StampClock(CaptureClock):
    """The camera's own time, however fast it runs here."""

    def time_s(self, stamp_s: float | None, arrived_s: float) -> float:
        assert stamp_s is not None
        return stamp_s


class Packet:
    """A decoded picture in place of a packet."""

    size = 1
    is_keyframe = True
    opaque = None

    def __init__(self, picture: av.VideoFrame) -> None:
        self.picture = picture


class Camera:
    """Pictures round and round, a 15th of a second apart by their stamps, lost after so many."""

    fps, codec, is_raw = 15.0, "soak", False
    numbers = itertools.count()

    def __init__(self, pictures: list[av.VideoFrame], lost: int) -> None:
        self._pictures = pictures
        self._lost = lost

    def packets(self) -> Iterator[Packet]:
        time.sleep(0.01)  # the first one is live
        for _ in range(self._lost):
            self._number = next(self.numbers)
            yield Packet(self._pictures[self._number % len(self._pictures)])
        raise SourceError("the cable was pulled")

    def decode(self, packet: Packet) -> list[av.VideoFrame]:
        return [packet.picture]

    def stamp_s(self, picture: av.VideoFrame) -> float:
        return self._number / self.fps

    def close(self) -> None:
        """Nothing is open."""


def look() -> tuple[float, int, int]:
    """Resident MB, threads, file handles of this process."""
    status = Path("/proc/self/status").read_text()
    resident = int(status.split("VmRSS:")[1].split()[0]) / 1024
    return resident, active_count(), len(list(Path("/proc/self/fd").iterdir()))


def slope(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Of a straight line through y(x), with its standard error."""
    dx = x - x.mean()
    b = (dx @ y) / (dx @ dx)
    rest = y - y.mean() - b * dx
    return float(b), float(np.sqrt(rest @ rest / max(len(x) - 2, 1) / (dx @ dx)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--frames", type=int, default=10**9)
    parser.add_argument("--lost", type=int, default=5000)
    parser.add_argument("--roll", type=float, default=5.0, metavar="SECONDS")
    options = parser.parse_args()
    with av.open(str(SAMPLE)) as film:
        pictures = list(film.decode(video=0))
    settings = load(
        assignments=[
            "live.every_frame=true",
            "live.backoff_s=0.01",
            f"live.roll_s={options.roll}",
            "live.keep_bytes=50_000_000",
            ("output.lines", ["gate:120,0,120,180"]),
        ]
    )
    source.CaptureClock = StampClock  # type: ignore[misc]
    seen = []
    with tempfile.TemporaryDirectory() as folder:
        extras = LiveExtras(state=Path(folder) / "state")
        camera = lambda: Camera(pictures, options.lost)  # noqa: E731
        began = time.monotonic()
        with LiveRun("http://soak/", settings, Path(folder) / "out", extras, connect=camera) as run:
            for count, _ in enumerate(run, 1):
                elapsed = time.monotonic() - began
                if count % LOOK == 0:
                    seen.append((count, *look()))
                    print(f"{count:8d} frames {count / elapsed:6.0f}/s  {seen[-1][1]:7.1f} MB  "
                          f"{seen[-1][2]} threads  {seen[-1][3]} handles", flush=True)  # fmt: skip
                if elapsed > 60 * options.minutes or count >= options.frames:
                    break
            status = run.board.now()
    late = np.array(seen[len(seen) // 2 :], float)
    for column, name in enumerate(("MB", "threads", "handles"), 1):
        b, error = slope(late[:, 0], late[:, column])
        print(f"{name}: {1e5 * b:+.3f} +- {1e5 * error:.3f} per 100,000 frames")
    print(f"reconnects {status.reading['reconnects']}, dropped {status.reading['frames_dropped']}, "
          f"lost {status.reading['lost']}, counts {status.counts}")  # fmt: skip


if __name__ == "__main__":
    run_and_leave(main)
