"""Time a whole run against decoding alone and against MOG2 with SORT on the same files, and score both.

    python tools/benchmark_pipeline.py --peers-in DIR --clips DIR [--sizes 320x240 ...] [--rounds 5]

The clips are the simulated junction at 25 frames/s in H.264, MJPEG and MPEG-4 (XVID), drawn once into
--clips. In each round the following take turns on each clip:

  decode    PyAV with all threads it wants, nothing converted: the limit
  vidtrack  a run into a folder as `vidtrack track CLIP` makes it, from opening the clip to the last file
            closed; the compiled code is loaded before
  MOG2      OpenCV's VideoCapture, MOG2 and connected components with roboflow SORT (peers/video.py), in
            an environment that pip makes in --peers-in; nothing is written

Times are medians of the rounds, ratios medians of the rounds' ratios. MOTA is that of the written tracks
against the simulated truth, at IoU 0.5 and 0.3. The second table says where the time of a run goes.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from time import perf_counter

import av
import numpy as np
from peers.environment import python_of

from vidtrack import formats, score
from vidtrack.config.settings import Settings
from vidtrack.formats import Table
from vidtrack.run.files import run_file
from vidtrack.simulate import Clip, simulate

FPS = 25
SEED = 1
BITS_PER_PIXEL = 0.1  # H.264: 2.3 Mbit/s at 1280x720, 5.2 Mbit/s at 1920x1080, as traffic cameras send it
CODECS: dict[str, tuple[str, str, str, dict[str, str]]] = {  # file ending, encoder, pixel format, options
    "h264": ("mp4", "libx264", "yuv420p", {}),
    "mjpg": ("avi", "mjpeg", "yuvj420p", {"qmin": "3", "qmax": "3"}),
    "xvid": ("avi", "mpeg4", "yuv420p", {"qmin": "3", "qmax": "3"}),
}
NAMES = ("decode", "vidtrack", "MOG2")
STAGES = ("open", "read", "detect", "blobs", "track", "write", "close")


@dataclass
class Record:
    """What the rounds on one clip gave; seconds of a whole clip in each round."""

    seconds: dict[str, list[float]] = field(default_factory=dict)
    stages: list[dict[str, float]] = field(default_factory=list)
    result: dict[str, Table] = field(default_factory=dict)

    def add(self, name: str, seconds: float, result: Table | None = None) -> None:
        self.seconds.setdefault(name, []).append(seconds)
        if result is not None:
            self.result[name] = result

    def ratio(self, name: str, other: str) -> float:
        """Median of `name` over `other`, round by round."""
        return median(np.divide(self.seconds[name], self.seconds[other]))


def encode(clip: Clip, folder: Path) -> None:
    """The clip in all codecs that are not there yet; its frames are drawn once."""
    paths = {codec: path_of(clip, codec, folder) for codec in CODECS}
    parts = {path: path.with_name("part-" + path.name) for path in paths.values() if not path.is_file()}
    streams = [open_stream(parts[path], codec, clip.size) for codec, path in paths.items() if path in parts]
    for image in clip if streams else ():
        for container, stream in streams:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="bgr24")))
    for container, stream in streams:
        container.mux(stream.encode())
        container.close()
    for path, part in parts.items():
        part.rename(path)


def open_stream(path: Path, codec: str, size: tuple[int, int]) -> tuple[av.container.OutputContainer, av.VideoStream]:
    """A file to be written."""
    _, encoder, pixels, options = CODECS[codec]
    container = av.open(str(path), "w")
    stream = container.add_stream(encoder, rate=FPS, options=options)
    assert isinstance(stream, av.VideoStream)
    stream.width, stream.height = size
    stream.pix_fmt = pixels
    if codec == "h264":
        stream.bit_rate = round(BITS_PER_PIXEL * FPS * size[0] * size[1])
    elif codec == "xvid":
        stream.codec_context.codec_tag = "XVID"
    return container, stream


def path_of(clip: Clip, codec: str, folder: Path) -> Path:
    """Where the clip is stored."""
    width, height = clip.size
    return folder / f"junction-{width}x{height}-{codec}.{CODECS[codec][0]}"


def decode(path: Path) -> float:
    """Seconds to decode a file."""
    begin = perf_counter()
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        for _ in container.decode(stream):
            pass
    return perf_counter() - begin


def run_ours(path: Path, folder: Path) -> tuple[float, dict[str, float], Table]:
    """Seconds of a run into `folder`, and of its stages, and its tracks."""
    begin = perf_counter()
    with run_file(str(path), Settings(), folder) as run:
        opened = perf_counter()
        for _ in run:
            pass
        ended = perf_counter()
    closed = perf_counter()
    stages = json.loads((folder / "summary.json").read_text())["stages"]
    stages |= {"open": opened - begin, "write": ended - opened - sum(stages.values()), "close": closed - ended}
    return closed - begin, stages, formats.read(folder)


def run_mog2(path: Path, python: Path, result: Path) -> tuple[float, Table]:
    """Seconds of the pipeline of peers/video.py, and its tracks."""
    subprocess.run([python, Path(__file__).parent / "peers" / "video.py", path, result], check=True)
    with np.load(result) as stored:
        return float(stored["seconds"]), formats.box_table(stored["frame"], stored["id"], stored["box"])


def take_turns(path: Path, python: Path, record: Record) -> None:
    """One round on one file."""
    with tempfile.TemporaryDirectory() as place:
        record.add("decode", decode(path))
        seconds, stages, ours = run_ours(path, Path(place) / "run")
        record.add("vidtrack", seconds, ours)
        record.stages.append(stages)
        record.add("MOG2", *run_mog2(path, python, Path(place) / "mog2.npz"))


def quality(result: Table, clip: Clip) -> str:
    """MOTA at IoU 0.5 and 0.3, and the switches at the second."""
    truth = formats.box_table(clip.truth.frame, clip.truth.id, clip.truth.box)
    matchup = score.match_boxes(result, truth)
    tight, loose = score.clear(matchup, 0.5), score.clear(matchup, 0.3)
    return f"{tight.mota:7.3f}{loose.mota:7.3f}{loose.switches:5d}"


def named(clip: Clip, codec: str) -> str:
    """The head of a row."""
    return f"{clip.size[0]:4d}x{clip.size[1]:<4d} {codec}"


def width_height(text: str) -> tuple[int, int]:
    """A size from WIDTHxHEIGHT."""
    width, height = text.split("x")
    return int(width), int(height)


def main() -> None:
    """Draw what is missing, run the rounds, print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peers-in", type=Path, required=True, metavar="DIR", help="folder of the environment")
    parser.add_argument("--clips", type=Path, required=True, metavar="DIR", help="folder of the clips")
    parser.add_argument("--sizes", type=width_height, nargs="+", default=[(320, 240), (1280, 720), (1920, 1080)])
    parser.add_argument("--codecs", nargs="+", choices=CODECS, default=list(CODECS))
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    options.clips.mkdir(parents=True, exist_ok=True)
    python = python_of("numpy2", options.peers_in)

    clips = [simulate("junction", seed=SEED, fps=FPS, size=size) for size in options.sizes]
    records = {(clip, codec): Record() for clip in clips for codec in options.codecs}
    for clip in clips:
        encode(clip, options.clips)
    with tempfile.TemporaryDirectory() as place:  # compiles, and imports what is imported late
        first, codec = next(iter(records))
        run_ours(path_of(first, codec, options.clips), Path(place) / "run")
    for _ in range(options.rounds):
        for (clip, codec), record in records.items():
            take_turns(path_of(clip, codec, options.clips), python, record)

    print("                         ms/frame                 vidtrack/    MOG2/  vidtrack at IoU       MOG2 at IoU")
    print("              Mbit/s   decode vidtrack     MOG2   decode vidtrack     0.5    0.3 IDSW      0.5    0.3 IDSW")
    for (clip, codec), record in records.items():
        rate = 8e-6 * path_of(clip, codec, options.clips).stat().st_size * FPS / len(clip)
        times = "".join(f"{1e3 * median(record.seconds[name]) / len(clip):9.3f}" for name in NAMES)
        ratios = f"{record.ratio('vidtrack', 'decode'):9.2f}{record.ratio('MOG2', 'vidtrack'):9.2f}"
        scores = "  ".join(quality(record.result[name], clip) for name in NAMES[1:])
        print(f"{named(clip, codec)}{rate:7.1f}{times}{ratios} {scores}")

    print("\nms/frame      " + "".join(f"{stage:>9s}" for stage in STAGES))
    for (clip, codec), record in records.items():
        parts = (1e3 * median(stages[stage] for stages in record.stages) / len(clip) for stage in STAGES)
        print(named(clip, codec) + "".join(f"{part:9.3f}" for part in parts))


if __name__ == "__main__":
    main()
