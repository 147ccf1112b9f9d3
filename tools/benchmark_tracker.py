"""Time one step of the tracker against other Python trackers on the same boxes, and count identity switches.

    python tools/benchmark_tracker.py --peers-in DIR [--objects 10 100 1000] [--rounds 5] [--only NAME ...]

Vehicles of 30 to 70 px move nearly straight at 50 to 250 px/s in all directions at 25 frames/s, one on
each 150 x 150 px, so the area grows with their number. Boxes shake by 3 % of their sides, 5 % are missing,
1 false box comes with 20 vehicles, and a tenth of the vehicles vanish and appear somewhere each second.

Peers (their settings: peers/track.py) run in environments that pip makes in DIR. Only the step is timed;
detections are made beforehand in the form that each tracker wants. Round k uses seed k, all trackers take
turns in it: times are medians of the rounds' median frames, ratios medians of the rounds' ratios, MOTA is
the mean and switches are the sum over rounds. A tracker is scored by the boxes that its established tracks
took, at IoU 0.5; "with first boxes" counts those before its confirmation, too, as a file of `vidtrack track`
has them. Ratios are to ours. The last rows show how our step grows up to 10,000 objects.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from statistics import mean, median
from time import perf_counter

import numpy as np
from peers.environment import python_of
from scipy.spatial import cKDTree

from vidtrack import formats, score
from vidtrack.arrays.types import Floats, Ints
from vidtrack.config.settings import Settings, SourceSettings
from vidtrack.detections.stored import open_detections
from vidtrack.run.trackers import build_box_tracker
from vidtrack.scan import Scan
from vidtrack.tracks import Status

FPS = 25.0
SPACING = 150.0  # px; one vehicle on each square of this side
WARM_UP = 10  # frames not timed
MOST = 10_000  # objects, ours only
ENVIRONMENT = {
    "sort": "numpy2",
    "bytetrack": "numpy2",
    "ocsort": "numpy2",
    "motpy": "numpy2",
    "similari": "numpy2",
    "stonesoup": "numpy2",
    "norfair-iou": "numpy1",
    "norfair-euclidean": "numpy1",
}
OURS, WITH_FIRST = "vidtrack", "with first boxes"


@dataclass(frozen=True)
class Traffic:
    """Boxes of a simulated detector and the truth behind them; boxes are left, top, width, height.

    side   px of the square area
    box    (N, 4) all detections, those of frame k are start[k]..start[k + 1]
    truth  what is really there
    """

    side: float
    box: Floats
    start: Ints
    truth: formats.Table

    @property
    def frames(self) -> list[Floats]:
        """Detections (M, 4) of each frame."""
        return np.split(self.box, self.start[1:-1])


@dataclass(frozen=True)
class Outcome:
    """What a tracker did: seconds of each step, and who (id) took which detection of which frame."""

    seconds: Floats
    frame: Ints
    id: Ints
    detection: Ints


def traffic(count: int, frames: int, seed: int) -> Traffic:
    """`count` vehicles for a number of frames."""
    rng = np.random.default_rng(seed)
    side = SPACING * np.sqrt(count)
    dt = 1 / FPS

    def new(count: int) -> tuple[Floats, Floats, Floats]:
        """Positions, velocities (count, 2), and length and width (count, 2)."""
        heading, speed = rng.uniform(0, 2 * np.pi, count), rng.uniform(50, 250, count)
        length = rng.uniform(30, 70, count)
        velocity = speed[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
        return rng.uniform(0, side, (count, 2)), velocity, length[:, None] * np.array([1.0, 0.45])

    place, velocity, shape = new(count)
    identity, made = np.arange(count), count
    boxes, truth_rows = [], []
    for frame in range(frames):
        box = _upright(place, velocity, shape)
        truth_rows.append((np.full(count, frame), identity.copy(), box))
        seen = box[rng.random(count) < 0.95]
        false = _upright(*new(rng.poisson(0.05 * count)))
        found = np.concatenate([_shaken(seen, rng), false])
        boxes.append(rng.permutation(found))

        place = place + velocity * dt
        velocity = velocity + rng.normal(0, 20 * np.sqrt(dt), (count, 2))
        gone = (rng.random(count) < 0.1 * dt) | ((place < 0) | (place > side)).any(axis=1)
        place[gone], velocity[gone], shape[gone] = new(int(gone.sum()))
        identity[gone] = made + np.arange(gone.sum())
        made += int(gone.sum())

    frame_of, id_of, box_of = (np.concatenate(column) for column in zip(*truth_rows, strict=True))
    start = np.cumsum([0, *map(len, boxes)])
    return Traffic(side, np.concatenate(boxes), start, formats.box_table(frame_of, id_of, box_of))


def _upright(place: Floats, velocity: Floats, shape: Floats) -> Floats:
    """Boxes (N, 4) around rectangles of length and width `shape` (N, 2) that point along their velocity."""
    u = np.abs(velocity / np.linalg.norm(velocity, axis=1, keepdims=True))
    size = shape[:, :1] * u + shape[:, 1:] * u[:, ::-1]
    return np.hstack([place - size / 2, size])


def _shaken(box: Floats, rng: np.random.Generator) -> Floats:
    """Centre and sides off by 3 % of the sides."""
    size = box[:, 2:] * (1 + rng.normal(0, 0.03, (len(box), 2)))
    centre = box[:, :2] + box[:, 2:] / 2 + box[:, 2:] * rng.normal(0, 0.03, (len(box), 2))
    return np.hstack([centre - size / 2, size])


def run_ours(data: Traffic) -> dict[str, Outcome]:
    """The tracker of `vidtrack track det.txt` with its default settings: what established tracks took, and what all
    took that were established at last."""
    settings = Settings(source=SourceSettings(fps=FPS))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "det.txt"
        frame = np.repeat(np.arange(len(data.start) - 1), np.diff(data.start))
        formats.write_mot(path, formats.box_table(frame, np.full(len(frame), -1), data.box))
        detections = open_detections(str(path), settings)
    tracker = build_box_tracker(settings.tracker, detections.settings, (data.side, data.side))
    scans = [scan for _, _, scan in detections]
    seconds, rows = np.empty(len(scans)), []
    for frame, scan in enumerate(scans):
        begin = perf_counter()
        tracks = tracker.step(scan)
        seconds[frame] = perf_counter() - begin
        took = tracks.measurement >= 0
        detection = detections_of(scan, data.frames[frame])[tracks.measurement[took]]
        rows.append((np.full(took.sum(), frame), tracks.id[took], detection, tracks.status[took] != Status.TENTATIVE))
    frames, ids, detections, established = (np.concatenate(column) for column in zip(*rows, strict=True))
    chosen = {OURS: established, WITH_FIRST: np.isin(ids, ids[established])}
    return {name: Outcome(seconds, frames[some], ids[some], detections[some]) for name, some in chosen.items()}


def detections_of(scan: Scan, box: Floats) -> Ints:
    """Index of each measurement's detection, of boxes (M, 4); those that show an object once more are in no scan."""
    return np.asarray(cKDTree(box[:, :2] + box[:, 2:] / 2).query(scan.z)[1])


def run_peer(name: str, data: Traffic, folder: Path) -> Outcome:
    """A peer in its own environment and process."""
    worker = Path(__file__).parent / "peers" / "track.py"
    with tempfile.TemporaryDirectory() as place:
        given, result = Path(place) / "data.npz", Path(place) / "result.npz"
        np.savez(given, box=data.box, start=data.start, fps=FPS)
        subprocess.run([python_of(ENVIRONMENT[name], folder), worker, name, given, result], check=True)
        with np.load(result) as stored:
            return Outcome(*(stored[key] for key in ("seconds", "frame", "id", "detection")))


def scored(outcome: Outcome, data: Traffic) -> score.Clear:
    """CLEAR of the boxes that the tracks took."""
    box = data.box[data.start[outcome.frame] + outcome.detection]
    return score.clear(score.match_boxes(formats.box_table(outcome.frame, outcome.id, box), data.truth))


def main() -> None:
    """Run the rounds and print a table for each number of objects."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peers-in", type=Path, required=True, metavar="DIR", help="folder of the environments")
    parser.add_argument("--objects", type=int, nargs="+", default=[10, 100, 1000])
    parser.add_argument("--rounds", type=int, default=5, help="each with a seed of its own (default 5)")
    parser.add_argument("--frames", type=int, default=60, help="of each round (default 60)")
    parser.add_argument("--only", nargs="+", choices=ENVIRONMENT, default=list(ENVIRONMENT), help="these peers")
    options = parser.parse_args()
    for name in {ENVIRONMENT[peer] for peer in options.only}:
        python_of(name, options.peers_in)
    run_ours(traffic(100, 20, seed=0))  # compiles

    for count in options.objects:
        times: dict[str, list[float]] = {}
        scores: dict[str, list[score.Clear]] = {}
        for seed in range(options.rounds):
            data = traffic(count, options.frames, seed)
            outcomes = run_ours(data) | {name: run_peer(name, data, options.peers_in) for name in options.only}
            for name, outcome in outcomes.items():
                times.setdefault(name, []).append(median(outcome.seconds[WARM_UP:]))
                scores.setdefault(name, []).append(scored(outcome, data))
        print(f"\n{count} objects, {options.frames} frames, {options.rounds} rounds")
        print(f"{'':18s}{'ms/frame':>10s}{'/ ours':>9s}{'MOTA':>9s}{'switches':>10s}")
        for name in sorted(times, key=lambda name: median(times[name])):
            ratio = median(np.divide(times[name], times[OURS]))
            switches = sum(clear.switches for clear in scores[name])
            mota = mean(clear.mota for clear in scores[name])
            print(f"{name:18s}{1e3 * median(times[name]):10.3f}{ratio:9.1f}{mota:9.4f}{switches:10d}")

    print(f"\n{OURS} alone, median frame")
    steps: dict[int, list[float]] = {count: [] for count in (10, 100, 1000, MOST)}
    for seed in range(options.rounds):
        for count in steps:
            steps[count].append(median(run_ours(traffic(count, 4 * WARM_UP, seed))[OURS].seconds[WARM_UP:]))
    for count, seconds in steps.items():
        ratio = median(np.divide(seconds, steps[1000]))
        print(f"{count:6d} objects {1e3 * median(seconds):9.3f} ms  {ratio:7.3f} times 1000 objects")


if __name__ == "__main__":
    main()
