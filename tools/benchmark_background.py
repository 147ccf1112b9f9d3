"""Quality and time of the detectors on the CDnet highway sequence.

    VIDTRACK_DATA=... python tools/benchmark_background.py [--rounds N] [--quick]

Quality: F-measure of the masks of frames 470-1085, run from the first frame, scored as the benchmark scores
(unknown and outside do not count, shadow is background); the disturbance map also with each step left out.
Time: medians of interleaved rounds over the same frames, at three sizes (enlarged pictures: no new detail).
MOG2 is timed on ready BGR pictures and without the median that cleans its mask.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import cv2
import numpy as np

from vidtrack.config.settings import SourceSettings
from vidtrack.config.video import BlobSettings, DetectorSettings
from vidtrack.video.background import create
from vidtrack.video.blobs.blobs import find_blobs
from vidtrack.video.frame import Frame, Image
from vidtrack.video.source import open_source

FIRST, LAST = 470, 1085  # image numbers with truth
VEHICLE = 255
NOT_SCORED = (85, 170)  # outside the region of interest, unknown
NONE_KNOWN = np.empty((0, 4))
SIZES = ((320, 240), (1280, 720), (1920, 1080))
WITHOUT = {
    "no noise": {"noise_factor": 0},
    "no colour": {"chroma": False},
    "no majority": {"majority_px": 1},
    "majority 5": {"majority_px": 5},
    "no shadow test": {"shadow": False},
    "shadow amid vehicles": {"amid": True},
    "dark vehicles may be shadow": {"dark": False},
    "one threshold for all": {"contrast": False},
    "no hole filling": {"holes": False},
    "no ghost healing": {"ghosts": False},
    "no guard band": {"guard_px": 0},
    "learns everywhere": {"selective": False},
    "no exposure": {"exposure": False},
}


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7, help="interleaved rounds of timing (default 7)")
    parser.add_argument("--quick", action="store_true", help="without the steps left out one by one")
    options = parser.parse_args()
    if "VIDTRACK_DATA" not in os.environ:
        parser.error("set VIDTRACK_DATA to the folder that holds highway/")
    folder = Path(os.environ["VIDTRACK_DATA"]) / "highway"
    frames = list(pictures(folder))
    quality(frames, folder, {} if options.quick else WITHOUT)
    for size in SIZES:
        times([enlarged(frame, size) for frame in frames[700:740]], options.rounds)


def pictures(folder: Path) -> Iterator[Frame]:
    """Frames up to the last one with truth."""
    with open_source(str(folder / "input"), SourceSettings(fps=25)) as source:
        for frame in source:
            if frame.index >= LAST:
                return
            yield frame


def quality(frames: list[Frame], folder: Path, without: dict[str, dict[str, object]]) -> None:
    """Print F, precision and recall of every detector."""
    truths = [
        cv2.imread(str(folder / f"groundtruth/gt{k:06d}.png"), cv2.IMREAD_GRAYSCALE) for k in range(FIRST, LAST + 1)
    ]
    region = cv2.imread(str(folder / "ROI.bmp"), cv2.IMREAD_GRAYSCALE) > 0
    print(f"{'detector':24s} {'F':>7s} {'precision':>10s} {'recall':>7s}")
    kinds = {kind: {"kind": kind} for kind in ("disturbance", "paper", "mog2", "knn")}
    steps = {f"  {name}": {"kind": "disturbance", "disturbance": changed} for name, changed in without.items()}
    for name, settings in (kinds | steps).items():
        detector = create(DetectorSettings.model_validate(settings))
        masks = [detector.apply(frame, NONE_KNOWN).full_size(frame.shape) for frame in frames][FIRST - 1 :]
        f, precision, recall = f_measure(masks, truths, region)
        print(f"{name:24s} {f:7.4f} {precision:10.4f} {recall:7.4f}", flush=True)


def f_measure(masks: Iterable[Image], truths: Iterable[Image], region: Image) -> tuple[float, float, float]:
    """F, precision, recall over all scored pixels."""
    found = true = both = 0
    for mask, truth in zip(masks, truths, strict=True):
        scored = region & ~np.isin(truth, NOT_SCORED)
        vehicle, seen = (truth == VEHICLE) & scored, (mask > 0) & scored
        found, true, both = found + seen.sum(), true + vehicle.sum(), both + (seen & vehicle).sum()
    precision, recall = both / found, both / true
    return 2 * precision * recall / (precision + recall), precision, recall


def enlarged(frame: Frame, size: tuple[int, int]) -> Frame:
    """The frame at another size (width, height)."""
    half = (size[0] // 2, size[1] // 2)
    y, u, v = (cv2.resize(plane, to) for plane, to in ((frame.y, size), (frame.u, half), (frame.v, half)))
    return Frame(frame.index, frame.time_s, y, u, v, frame.full_range)


def times(frames: list[Frame], rounds: int) -> None:
    """Print ms a frame of the map, the map with blobs, and MOG2 with one and with all threads, and the ratios."""
    threads = cv2.getNumThreads()
    mapper, finder = create(DetectorSettings()), create(DetectorSettings())
    model = cv2.createBackgroundSubtractorMOG2()

    def mog2(played: list[Frame], bgr: list[Image]) -> None:
        for picture in bgr:
            model.apply(picture)

    def only_map(played: list[Frame], bgr: list[Image]) -> None:
        for frame in played:
            mapper.apply(frame, NONE_KNOWN)

    def map_and_blobs(played: list[Frame], bgr: list[Image]) -> None:
        for frame in played:
            find_blobs(finder.apply(frame, NONE_KNOWN), BlobSettings())

    jobs: dict[str, tuple[int, Callable[[list[Frame], list[Image]], None]]] = {
        "map": (1, only_map),
        "map + blobs": (1, map_and_blobs),
        "MOG2 1 thread": (1, mog2),
        f"MOG2 {threads} threads": (threads, mog2),
    }
    measured: dict[str, list[float]] = {name: [] for name in jobs}
    for turn in range(rounds + 1):  # the first round compiles and warms up
        order = frames if turn % 2 == 0 else frames[::-1]  # back and forth: no jump where the frames begin again
        played = [replace(frame, time_s=(turn * len(frames) + k) / 25) for k, frame in enumerate(order)]
        bgr = [frame.bgr() for frame in played]
        for name, (used, job) in jobs.items():
            cv2.setNumThreads(used)
            began = perf_counter()
            job(played, bgr)
            if turn:
                measured[name].append((perf_counter() - began) / len(frames) * 1e3)
    cv2.setNumThreads(threads)
    h, w = frames[0].shape
    print(f"\n{w}x{h}" + "".join(f" {name:>16s}" for name in measured))
    print("ms       " + "".join(f" {np.median(ms):16.3f}" for ms in measured.values()))
    for name in [name for name in measured if name.startswith("MOG2")]:
        ratios = [np.median(np.divide(ms, measured[name])) for ms in measured.values()]
        print(f"x {name}: " + ", ".join(f"{part} {ratio:.3f}" for part, ratio in zip(measured, ratios, strict=True)))


if __name__ == "__main__":
    main()
