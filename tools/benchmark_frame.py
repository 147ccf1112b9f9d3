"""Where the processor's time of one frame goes, beside decoding and beside MOG2 with components.

    python tools/benchmark_frame.py CLIP ... [--rounds 3] [--set KEY=VALUE ...]
    python tools/benchmark_frame.py CLIP ... --over detector.disturbance.registration=false

Each round runs on each clip, one after the other: decoding alone; a whole run into a folder, as `vidtrack track CLIP`
makes it; the same stages without results, each on a clock of its own; and OpenCV's MOG2 with connected components, in
one thread, on the same pictures. All times are processor time in ms a frame, user and system, of all threads for
decoding, run and MOG2, and of the main thread for the stages: other processes on the machine do not count, apart from
the caches that they share. Medians of the rounds. With --set source.max_fps=N a frame is a picture of the file, looked
at or not. `beyond` is the run less decoding, `ratio` the duration of the run, with all cores, over that of decoding in
one thread; other processes count there. `over` is the time of the detector over that with the settings of `--over`, of
the same round.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from statistics import median
from time import perf_counter, thread_time

import av
import cv2
import numpy as np

from vidtrack.config.load import load
from vidtrack.config.settings import Settings
from vidtrack.run.files import run_file
from vidtrack.run.trackers import build_blob_tracker
from vidtrack.run.video import build_detector, has_driven
from vidtrack.video.blobs.explain import explain
from vidtrack.video.resources import frame_by_frame
from vidtrack.video.source import open_source

STAGES = ("predict", "detect", "blobs", "track")


def used() -> float:
    """Processor time of this process so far [s]."""
    usage = getrusage(RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def decode(path: Path, threads: int = 0) -> int:
    """Decode all, in so many threads, 0: as many as FFmpeg wants; returns the number of pictures."""
    with av.open(str(path)) as container:
        container.streams.video[0].thread_type = "AUTO"
        container.streams.video[0].codec_context.thread_count = threads
        return sum(1 for _ in container.decode(video=0))


def whole_run(path: Path, settings: Settings) -> None:
    """A run into a folder."""
    with tempfile.TemporaryDirectory() as place, run_file(str(path), settings, Path(place) / "run") as run:
        for _ in run:
            pass


def mog2(path: Path) -> None:
    """Decode, subtract the background, find components."""
    model = cv2.createBackgroundSubtractorMOG2()
    with av.open(str(path)) as container:
        for picture in container.decode(video=0):
            mask = model.apply(picture.to_ndarray(format="bgr24"))
            cv2.connectedComponentsWithStats(np.where(mask == 255, np.uint8(255), np.uint8(0)))


def stages(path: Path, settings: Settings) -> dict[str, float]:
    """Seconds of the main thread in each stage."""
    spent = dict.fromkeys(STAGES, 0.0)
    with open_source(str(path), settings.source) as source, frame_by_frame(settings.detector.kind):
        tracker, detector = (
            build_blob_tracker(settings.tracker, (source.width, source.height)),
            build_detector(settings),
        )
        for frame in source:
            clock = [thread_time()]
            expected = tracker.predict(frame.time_s)
            clock.append(thread_time())
            foreground = detector.apply(frame, expected.box[has_driven(expected)])
            clock.append(thread_time())
            scan = explain(foreground, expected, tracker.road, settings.blobs).scan(frame.time_s)
            clock.append(thread_time())
            tracker.step(scan)
            clock.append(thread_time())
            for stage, seconds in zip(STAGES, np.diff(clock).tolist(), strict=True):
                spent[stage] += seconds
    return spent


def cost(what: Callable[[Path], object], path: Path) -> float:
    """Processor time of a call [s]."""
    begin = used()
    what(path)
    return used() - begin


def ratio(path: Path, settings: Settings) -> float:
    """Duration of a run over that of decoding in one thread."""
    begin = perf_counter()
    whole_run(path, settings)
    middle = perf_counter()
    decode(path, threads=1)
    return (middle - begin) / (perf_counter() - middle)


def main() -> None:
    """Run the rounds, print a row for each clip."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path, nargs="+", metavar="CLIP")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--set", dest="assignments", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--over", default="", metavar="SETTINGS", help="separated by semicolons; adds `over`")
    options = parser.parse_args()
    settings = load(assignments=options.assignments)
    other = load(assignments=options.over.split(";")) if options.over else None
    found: dict[Path, list[dict[str, float]]] = {clip: [] for clip in options.clips}
    sizes: dict[Path, tuple[int, int]] = {}
    cv2.setNumThreads(1)
    whole_run(options.clips[0], settings)  # compiles, and imports what is imported late
    for _ in range(options.rounds):
        for clip, rows in found.items():
            frames = decode(clip)
            with open_source(str(clip), settings.source) as source:
                sizes[clip] = source.width, source.height
            run = partial(whole_run, settings=settings)
            row = {"decode": cost(decode, clip), "run": cost(run, clip), "MOG2": cost(mog2, clip)}
            row |= stages(clip, settings)
            rows.append(
                {name: 1e3 * seconds / frames for name, seconds in row.items()} | {"ratio": ratio(clip, settings)}
            )
            if other is not None:
                rows[-1]["over"] = row["detect"] / stages(clip, other)["detect"]
    names = ["decode", "run", *STAGES, "MOG2", "beyond", "ratio", *(["over"] if other is not None else [])]
    print("ms a frame          " + "".join(f"{name:>9s}" for name in names))
    for clip, rows in found.items():
        width, height = sizes[clip]
        for row in rows:
            row["beyond"] = row["run"] - row["decode"]
        cells = "".join(f"{median(row[name] for row in rows):9.2f}" for name in names)
        print(f"{clip.stem[:14]:14s} {width:4d}x{height:<4d}"[:20].ljust(20) + cells)


if __name__ == "__main__":
    main()
