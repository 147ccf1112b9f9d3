"""Resident memory of a run over a video that repeats 20 times: it must not grow.

    python tools/benchmark_memory.py [VIDEO] [--loops 20]

The frames of VIDEO (default: the bundled junction) go round after round through detector, tracker and all
files of a run, their times going on. What the process holds is printed after each round, and at the end the
slope over the rounds after the first four, in MB a round, with its standard error: what the C library
keeps free goes up and down by some MB.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np

from vidtrack.config.settings import Settings
from vidtrack.run.files import run_file

SAMPLE = Path(__file__).parent.parent / "samples" / "junction.avi"
WARM_UP = 4  # rounds in which caches fill


def repeated(video: Path, loops: int, folder: Path) -> tuple[Path, int]:
    """The packets of a video, `loops` times over, in a file of the same kind, and the frames of one round."""
    path = folder / f"looped{video.suffix}"
    with av.open(str(path), "w") as output:
        stream, shift, frames = None, 0, 0
        for _ in range(loops):
            with av.open(str(video)) as source:
                given = source.streams.video[0]
                stream = stream or output.add_stream_from_template(given)
                packets = [packet for packet in source.demux(given) if packet.size]
                frames = len(packets)
                step = max(packet.duration or 0 for packet in packets)
                for packet in packets:
                    packet.pts = None if packet.pts is None else packet.pts + shift
                    packet.dts = None if packet.dts is None else packet.dts + shift
                    packet.stream = stream
                    output.mux(packet)
                shift += frames * step
    return path, frames


def resident_mb() -> float:
    """What this process holds, in MB."""
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0]) / 1024


def held(path: Path, frames: int, folder: Path) -> Iterator[float]:
    """Resident MB each time another `frames` frames are through."""
    with run_file(str(path), Settings(), folder) as run:
        for count, _ in enumerate(run, 1):
            if count % frames == 0:
                yield resident_mb()


def main() -> None:
    """Print memory round by round."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("video", type=Path, nargs="?", default=SAMPLE)
    parser.add_argument("--loops", type=int, default=20)
    options = parser.parse_args()
    if options.loops < WARM_UP + 4:
        parser.error(f"--loops must be at least {WARM_UP + 4}: the first {WARM_UP} do not count for the slope")
    with tempfile.TemporaryDirectory() as place:
        path, frames = repeated(options.video, options.loops, Path(place))
        memory = []
        for loop, megabytes in enumerate(held(path, frames, Path(place) / "run"), 1):
            memory.append(megabytes)
            print(f"round {loop:2d}  {frames * loop:6d} frames  {megabytes:7.1f} MB")
    settled = memory[WARM_UP:]
    line, covariance = np.polyfit(np.arange(len(settled)), settled, 1, cov=True)
    print(f"slope {line[0]:.3f} MB a round of {frames} frames (standard error {np.sqrt(covariance[0, 0]):.3f})")


if __name__ == "__main__":
    main()
