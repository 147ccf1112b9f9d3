"""Track stored detections of MOT15 and KITTI with ours and with roboflow's trackers, and score all alike.

    python tools/benchmark_detections.py --peers-in DIR [--method gnn ...] [--sequences] [--truth Car Van]

Detections and truth are those of VIDTRACK_DATA/mot15 (pedestrians; truth rows with conf 0 are left out) and
VIDTRACK_DATA/kitti (PointRCNN cars; truth are the labels named by --truth, everything else is background for all).
Ours is `vidtrack track det.txt` with its defaults for all sequences, scored by its mot.txt; what --method names is
all that differs. The peers are SORT, ByteTrack and OC-SORT of roboflow `trackers`, given boxes, scores and frame
rate, with their own defaults; and, since their thresholds are made for scores from 0 to 1, once more with
the threshold for new tracks (see peers/detections.py) that gives most HOTA on each of the two data sets, of the
0.1, 0.2, ... 0.7 quantiles of its scores: "best". That choice is made with the truth; ours is not.

Scores are pooled: every object counts once, whatever the length of its sequence. `vidtrack.score` gives what TrackEval
gives (tools/compare_scores.py).
"""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from peers.environment import python_of

from vidtrack import formats, score
from vidtrack.config import load
from vidtrack.formats import Table
from vidtrack.run import Run

PEERS = ("sort", "bytetrack", "ocsort")
QUANTILES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)
KITTI_FPS, KITTI_SIZE = 10.0, (1242, 375)


@dataclass(frozen=True)
class Sequence:
    """Detections and truth of one sequence, and seqinfo.ini as text."""

    dataset: str
    name: str
    detections: Table
    truth: Table
    fps: float
    frames: int
    info: str


def mot15(folder: Path) -> Iterable[Sequence]:
    """The sequences of MOTChallenge 2015."""
    for path in sorted(folder.glob("*/seqinfo.ini")):
        info = path.read_text()
        values = dict(line.split("=", 1) for line in info.splitlines() if "=" in line)
        truth = formats.read(path.parent / "gt" / "gt.txt")
        yield Sequence(
            folder.name,
            path.parent.name,
            formats.read(path.parent / "det" / "det.txt"),
            truth.select(truth.conf != 0),
            float(values["frameRate"]),
            int(values["seqLength"]),
            info,
        )


def kitti(folder: Path, kinds: list[str]) -> Iterable[Sequence]:
    """The sequences of KITTI: label and detection files have right and bottom in place of width and height."""
    for path in sorted((folder / "pointrcnn_car").glob("*.txt")):
        found = np.loadtxt(path, delimiter=",", usecols=(0, 2, 3, 4, 5, 6))
        labels = [line.split() for line in (folder / "label" / path.name).read_text().splitlines()]
        frames = 1 + max(int(label[0]) for label in labels)
        wanted = [label for label in labels if label[2] in kinds]
        rows = np.array([[*label[:2], *label[6:10]] for label in wanted], float)
        width, height = KITTI_SIZE
        info = f"[Sequence]\nframeRate={KITTI_FPS}\nseqLength={frames}\nimWidth={width}\nimHeight={height}\n"
        detections = formats.box_table(found[:, 0], np.full(len(found), -1), _sides(found[:, 1:5]), found[:, 5])
        truth = formats.box_table(rows[:, 0], rows[:, 1], _sides(rows[:, 2:]))
        yield Sequence(folder.name, path.stem, detections, truth, KITTI_FPS, frames, info)


def _sides(corners: np.ndarray) -> np.ndarray:
    return np.hstack([corners[:, :2], corners[:, 2:] - corners[:, :2]])


def track_ours(sequence: Sequence, method: str, folder: Path) -> Table:
    """`vidtrack track det.txt --method METHOD`."""
    place = folder / sequence.dataset / sequence.name
    place.mkdir(parents=True, exist_ok=True)
    formats.write_mot(place / "det.txt", sequence.detections)
    (place / "seqinfo.ini").write_text(sequence.info)
    with Run(str(place / "det.txt"), load(None, [("tracker.method", method)]), place / method) as run:
        for _ in run:
            pass
    return formats.read(place / method)


def track_peers(sequences: list[Sequence], python: Path, folder: Path) -> dict[tuple[str, int], list[Table]]:
    """Results of each sequence by peer and number of the threshold; the first is the peer's own."""
    folder.mkdir()
    for number, sequence in enumerate(sequences):
        scores = np.concatenate([s.detections.conf for s in sequences if s.dataset == sequence.dataset])
        found = sequence.detections
        np.savez(
            folder / f"{number}.npz", box=found.box, frame=found.frame, score=found.conf, fps=sequence.fps,
            frames=sequence.frames, threshold=[np.nan, *np.quantile(scores, QUANTILES)],
        )  # fmt: skip
    subprocess.run([python, Path(__file__).parent / "peers" / "detections.py", folder], check=True)

    def result(number: int, peer: str, k: int) -> Table:
        frame, identity, detection = np.load(folder / f"{number}-{peer}-{k}.npy").T
        return formats.box_table(frame, identity, sequences[number].detections.box[detection])

    return {
        (peer, k): [result(number, peer, k) for number in range(len(sequences))]
        for peer in PEERS
        for k in range(1 + len(QUANTILES))
    }


def best(sequences: list[Sequence], by_threshold: list[list[Table]]) -> list[Table]:
    """Results with the threshold that gives most HOTA on each data set."""
    chosen = {
        dataset: max(by_threshold, key=lambda results: scores_of(sequences, results, {dataset}.__contains__)["hota"])
        for dataset in {sequence.dataset for sequence in sequences}
    }
    return [chosen[sequence.dataset][number] for number, sequence in enumerate(sequences)]


def scores_of(sequences: list[Sequence], results: list[Table], wanted: Callable[[str], bool]) -> dict[str, float]:
    """Pooled scores of the data sets that are wanted."""
    pairs = [(r, s.truth) for s, r in zip(sequences, results, strict=True) if wanted(s.dataset)]
    return scored(*score.pool(pairs))


def scored(result: Table, truth: Table) -> dict[str, float]:
    """The numbers of a line."""
    matchup = score.match_boxes(result, truth)
    clear, identity, hota = score.clear(matchup), score.identity(matchup), score.hota(matchup)
    return {"hota": hota.hota, "idf1": identity.idf1, "mota": clear.mota, "deta": hota.deta, "assa": hota.assa,
            "switches": clear.switches}  # fmt: skip


def print_line(name: str, values: dict[str, float]) -> None:
    """One row of a table."""
    fractions = "".join(f"{value:9.4f}" for key, value in values.items() if key != "switches")
    print(f"{name:24s}{fractions}{values['switches']:10d}")


def main() -> None:
    """Track, score, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peers-in", type=Path, metavar="DIR", help="of the peers' environment; none: ours only")
    parser.add_argument("--method", nargs="+", default=["gnn"], help="of ours (default gnn)")
    parser.add_argument("--sequences", action="store_true", help="also every sequence by itself")
    parser.add_argument("--truth", nargs="+", default=["Car", "Van"], help="labels of KITTI (default Car Van)")
    options = parser.parse_args()
    if "VIDTRACK_DATA" not in os.environ:
        parser.error("set VIDTRACK_DATA to the folder that holds mot15/ and kitti/")
    data = Path(os.environ["VIDTRACK_DATA"])
    sequences = [*mot15(data / "mot15"), *kitti(data / "kitti", options.truth)]

    results: dict[str, list[Table]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for method in options.method:
            results[method] = [track_ours(sequence, method, Path(folder)) for sequence in sequences]
        if options.peers_in:
            found = track_peers(sequences, python_of("numpy2", options.peers_in), Path(folder) / "peers")
            for peer in PEERS:
                results[peer] = found[peer, 0]
                results[f"{peer}, best"] = best(sequences, [found[peer, k + 1] for k in range(len(QUANTILES))])

    tables: dict[str, Callable[[str], bool]] = {
        "all": lambda dataset: True,
        "mot15": lambda dataset: dataset == "mot15",
        "kitti": lambda dataset: dataset == "kitti",
    }
    heading = "".join(f"{key:>9s}" for key in ("HOTA", "IDF1", "MOTA", "DetA", "AssA")) + f"{'switches':>10s}"
    for title, wanted in tables.items():
        print(f"\n{title:24s}{heading}")
        for name, tables_of in results.items():
            print_line(name, scores_of(sequences, tables_of, wanted))
    for number, sequence in enumerate(sequences if options.sequences else []):
        print(f"\n{sequence.dataset + ' ' + sequence.name:24s}{heading}")
        for name, tables_of in results.items():
            print_line(name, scored(tables_of[number], sequence.truth))


if __name__ == "__main__":
    main()
