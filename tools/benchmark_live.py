"""How many cameras one core watches, and how late their tracks are.

    python tools/benchmark_live.py CLIP ... [--fps 10 25] [--cameras 1 2 4] [--seconds 20] [--core 0]
        [--set KEY=VALUE ...]

Each clip becomes an H.264 stream without B-frames, as cameras send it, in MPEG-TS over HTTP, round and round in real
time. It is watched by so many live runs at once, each a process of its own, as `vidtrack live` starts them, all on one
core; what sends the stream is on the others. Nothing counts until 15 s after the first tracks of the last camera:
kernels are loaded until then.

A row for each clip, rate and number of cameras: the mean number of vehicles, processor time per camera and picture sent
(user and system, all threads, with decoding), the share of the core that they need, frames that were dropped, and the
time from a picture's arrival to its tracks: median, and the 99th percentile of the worst camera. `a core` is how many
cameras the processor time of one leaves room for. Latencies hold on a machine that does nothing else.
"""

from __future__ import annotations

import argparse
import io
import math
import os
import tempfile
import time
from dataclasses import dataclass
from fractions import Fraction
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Semaphore
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from typing import NoReturn

import av
import numpy as np

from vidtrack.config.load import load
from vidtrack.config.settings import Settings
from vidtrack.run.live.leave import run_and_leave
from vidtrack.run.live.run import LiveRun
from vidtrack.tracks import TENTATIVE

SETTLING_S = 15.0


@dataclass(frozen=True)
class Watched:
    """One camera's run: duration and processor time [s], frames, dropped ones, mean number of vehicles, latencies."""

    seconds: float
    used_s: float
    frames: int
    dropped: int
    vehicles: float
    median_ms: float
    late_ms: float


def stream_of(clip: Path, fps: int) -> list[bytes]:
    """The pictures of a clip at this rate as H.264, one bytes object each; the first is a key picture."""
    encoder = av.CodecContext.create("libx264", "w")
    with av.open(str(clip)) as film:
        video = film.streams.video[0]
        encoder.width, encoder.height, encoder.pix_fmt = video.width, video.height, "yuv420p"
        encoder.time_base, encoder.framerate = Fraction(1, fps), Fraction(fps)
        encoder.options = {"preset": "veryfast", "tune": "zerolatency", "g": str(2 * fps)}
        sent, packets = 0, []
        for picture in film.decode(video):
            if picture.time is None or picture.time * fps < sent - 1e-6:
                continue
            shown = picture.reformat(format="yuv420p")
            shown.pts, shown.time_base = sent, Fraction(1, fps)
            sent += 1
            packets += encoder.encode(shown)
    return [bytes(packet) for packet in [*packets, *encoder.encode(None)]]


def send(pictures: list[bytes], size: tuple[int, int], fps: int, told: Connection) -> None:
    """Serve the stream over HTTP until the process ends; tells the port."""

    class Camera(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "video/mp2t")
            self.end_headers()
            try:
                self._stream()
            except OSError:  # the viewer has gone
                return

        def _stream(self) -> None:
            buffer = io.BytesIO()
            with av.open(buffer, "w", format="mpegts") as out:
                video = out.add_stream("libx264", rate=fps)
                video.width, video.height, video.pix_fmt = *size, "yuv420p"
                begin = time.monotonic()
                for k in range(10**9):
                    packet = av.Packet(pictures[k % len(pictures)])
                    packet.stream, packet.time_base = video, Fraction(1, fps)
                    packet.pts = packet.dts = k
                    packet.is_keyframe = k % len(pictures) == 0
                    out.mux_one(packet)
                    self.wfile.write(buffer.getvalue())
                    buffer.seek(0)
                    buffer.truncate()
                    time.sleep(max(0.0, begin + (k + 1) / fps - time.monotonic()))

        def log_message(self, *_: object) -> None:
            """Nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Camera)
    told.send(server.server_port)
    server.serve_forever()


def watch(address: str, settings: Settings, seconds: float, starting: Semaphore, told: Connection) -> NoReturn:
    """The process of a live run, which takes one of the cameras that start; tells what it needed."""
    run_and_leave(lambda: told.send(_watched(address, settings, seconds, starting)))


def _watched(address: str, settings: Settings, seconds: float, starting: Semaphore) -> Watched:
    vehicles, latencies, since_s = [], [], math.inf
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,  # late results may still be written into it
        LiveRun(address, settings, Path(folder) / "run") as run,
    ):
        for number, step in enumerate(run):
            now_s = time.monotonic()
            if number == 0:
                starting.acquire()
            if since_s == math.inf and starting.get_value() == 0:
                since_s = now_s + SETTLING_S
            if now_s < since_s:
                begin_s, begin_used_s, begin_dropped = now_s, _used(), run.board.now().reading["frames_dropped"]
                continue
            vehicles.append(np.count_nonzero(step.tracks.status != TENTATIVE))
            latencies.append(run.board.latency_s(step.time_s))
            if now_s > since_s + seconds:
                break
        used_s = _used() - begin_used_s
        dropped = run.board.now().reading["frames_dropped"] - begin_dropped
    median_ms, late_ms = 1e3 * np.percentile(latencies, [50, 99])
    return Watched(now_s - begin_s, used_s, len(vehicles), dropped, float(np.mean(vehicles)), median_ms, late_ms)


def _used() -> float:
    usage = getrusage(RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def measure(clip: Path, settings: Settings, fps: int, cameras: int, seconds: float, core: int) -> list[Watched]:
    """So many cameras at once. Raises EOFError if one of the runs fails."""
    context = get_context("spawn")
    with av.open(str(clip)) as film:
        size = film.streams.video[0].width, film.streams.video[0].height
    here, there = context.Pipe()
    sender = context.Process(target=send, args=(stream_of(clip, fps), size, fps, there), daemon=True)
    sender.start()
    address = f"http://127.0.0.1:{here.recv()}/"
    pipes = [context.Pipe() for _ in range(cameras)]
    starting = context.Semaphore(cameras)
    runs = [context.Process(target=watch, args=(address, settings, seconds, starting, told)) for _, told in pipes]
    every_core = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {core})  # inherited by what starts now, with all its threads
    for run in runs:
        run.start()
    os.sched_setaffinity(0, every_core)
    for _, told in pipes:
        told.close()  # so that the end of a run that failed is heard
    found = [heard.recv() for heard, _ in pipes]
    for run in runs:
        run.join()
    sender.terminate()
    return found


def main() -> None:
    """A row for each clip, rate and number of cameras."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path, nargs="+", metavar="CLIP")
    parser.add_argument("--fps", type=int, nargs="+", default=[10, 25])
    parser.add_argument("--cameras", type=int, nargs="+", default=[1, 2, 4])
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--core", type=int, default=0)
    parser.add_argument("--set", dest="assignments", action="append", default=[], metavar="KEY=VALUE")
    options = parser.parse_args()
    settings = load(assignments=options.assignments)
    print("clip             fps  cameras  vehicles  ms/frame  a core   load  dropped    p50    p99 ms")
    for clip in options.clips:
        for fps in options.fps:
            for cameras in options.cameras:
                found = measure(clip, settings, fps, cameras, options.seconds, options.core)
                of_core = sum(each.used_s / each.seconds for each in found)
                ms = 1e3 * of_core / cameras / fps
                vehicles = float(np.mean([each.vehicles for each in found]))
                middle, late = np.median([each.median_ms for each in found]), max(each.late_ms for each in found)
                print(
                    f"{clip.stem[:16]:16s} {fps:3d} {cameras:8d} {vehicles:9.1f} {ms:9.2f} {1e3 / (ms * fps):7.1f}"
                    f" {of_core:6.0%} {sum(each.dropped for each in found):8d} {middle:6.0f} {late:6.0f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
