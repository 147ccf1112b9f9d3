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
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from statistics import median
from time import perf_counter

import av
import numpy as np
from peers.environment import python_of

from vidtrack import formats, score
from vidtrack.config import Settings
from vidtrack.formats import Table
from vidtrack.run import Run
from vidtrack.simulate import Clip, simulate

FPS = 25
SEED = 1
CODECS = {  # file ending, encoder, pixel format, options
    "h264": ("mp4", "libx264", "yuv420p", {"crf": "23", "preset": "medium"}),
    "mjpg": ("avi", "mjpeg", "yuvj420p", {"qmin": "3", "qmax": "3"}),
    "xvid": ("avi", "mpeg4", "yuv420p", {"qmin": "3", "qmax": "3"}),
}
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
    missing = {codec: path_of(clip, codec, folder) for codec in CODECS if not path_of(clip, codec, folder).is_file()}
    if not missing:
        return
    outputs = []
    for codec, path in missing.items():
        _, encoder, pixels, options = CODECS[codec]
        part = path.with_name("part-" + path.name)
        container = av.open(str(part), "w")
        stream = container.add_stream(encoder, rate=Fraction(FPS), options=options)
        stream.width, stream.height, stream.pix_fmt = *clip.size, pixels
        if codec == "xvid":
            stream.codec_context.codec_tag = "XVID"
        outputs.append((container, stream, part, path))
    for image in clip:
        for container, stream, _, _ in outputs:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="bgr24")))
    for container, stream, part, path in outputs:
        container.mux(stream.encode())
        container.close()
        part.rename(path)


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
    with Run(str(path), Settings(), folder) as run:
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


def quality(result: Table, truth: Table) -> Iterator[str]:
    """MOTA at two IoU and the switches at the second."""
    for iou in (0.5, 0.3):
        clear = score.clear(score.match_boxes(result, truth), iou)
        yield f"{clear.mota:9.3f}"
    yield f"{clear.switches:4d}"


def size(text: str) -> tuple[int, int]:
    """WIDTHxHEIGHT."""
    width, height = text.split("x")
    return int(width), int(height)


def main() -> None:
    """Draw what is missing, run the rounds, print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peers-in", type=Path, required=True, metavar="DIR", help="folder of the environment")
    parser.add_argument("--clips", type=Path, required=True, metavar="DIR", help="folder of the clips")
    parser.add_argument("--sizes", type=size, nargs="+", default=[(320, 240), (1280, 720), (1920, 1080)])
    parser.add_argument("--codecs", nargs="+", choices=CODECS, default=list(CODECS))
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    options.clips.mkdir(parents=True, exist_ok=True)
    python = python_of("numpy2", options.peers_in)

    clips = {width_height: simulate("junction", seed=SEED, fps=FPS, size=width_height) for width_height in options.sizes}
    records = {(clip, codec): Record() for clip in clips.values() for codec in options.codecs}
    for clip in clips.values():
        encode(clip, options.clips)
    with tempfile.TemporaryDirectory() as place:  # compiles, and imports what is imported late
        first, codec = next(iter(records))
        run_ours(path_of(first, codec, options.clips), Path(place) / "run")
    for _ in range(options.rounds):
        for (clip, codec), record in records.items():
            take_turns(path_of(clip, codec, options.clips), python, record)

    print("ms/frame             decode  vidtrack      MOG2  vidtrack/  MOG2/     vidtrack              MOG2")
    print("                                                 decode     vidtrack  MOTA.5  MOTA.3 IDSW   MOTA.5  MOTA.3 IDSW")
    for (clip, codec), record in records.items():
        truth = formats.box_table(clip.truth.frame, clip.truth.id, clip.truth.box)
        row = [f"{clip.size[0]:4d}x{clip.size[1]:<4d} {codec}  "]
        row += [f"{1e3 * median(record.seconds[name]) / len(clip):9.3f} " for name in ("decode", "vidtrack", "MOG2")]
        row += [f"{record.ratio('vidtrack', 'decode'):8.2f}  {record.ratio('MOG2', 'vidtrack'):9.2f}  "]
        row += [part for name in ("vidtrack", "MOG2") for part in quality(record.result[name], truth)]
        print("".join(row))

    print("\nms/frame            " + "".join(f"{stage:>9s}" for stage in STAGES))
    for (clip, codec), record in records.items():
        parts = [1e3 * median(stages[stage] for stages in record.stages) / len(clip) for stage in STAGES]
        print(f"{clip.size[0]:4d}x{clip.size[1]:<4d} {codec}      " + "".join(f"{part:9.3f}" for part in parts))


if __name__ == "__main__":
    main()
