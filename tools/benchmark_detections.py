"""Track stored detections of MOT15, KITTI and AI City with ours and with common trackers, and score all alike.

    python tools/benchmark_detections.py --peers-in DIR [--ours NAME=VALUE,... ...] [--half developed|aside]
                                         [--sequences] [--truth Car Van]

Detections and truth are those of VIDTRACK_DATA/mot15 (pedestrians; truth rows with conf 0 are left out),
VIDTRACK_DATA/kitti (PointRCNN cars; truth are the labels named by --truth, everything else is background for all) and
VIDTRACK_DATA/aicity (a junction at 10 frames/s with the boxes of three detectors; moving vehicles count, rows matched
to a parked one at an IoU of a half are dropped, one to one).
Ours is `vidtrack track det.txt` with its defaults for all sequences, scored by its mot.txt; --ours adds lines with
other settings, as in --ours tracker.method=jpda,output.link=false. The peers are SORT, ByteTrack and OC-SORT of
roboflow `trackers` and norfair, given boxes, scores and frame rate, with their own defaults; and, since their
thresholds are made for scores from 0 to 1, once more with the threshold for new tracks (see peers/detections.py) that
gives most HOTA on each data set, on each detector of AI City most IDF1, of the 0.1, 0.2, ... 0.9 quantiles of its
scores: "best". That choice is made with the truth; ours is not.

Ours was developed on one half, "developed": frames 1 to 500 of AI City with ssd512 and mask_rcnn, three sequences of
MOT15 and those of KITTI with even numbers. The other half was looked at when all was done.

Scores are pooled: every object counts once, whatever the length of its sequence. `vidtrack.score` gives what TrackEval
gives (tools/compare_scores.py).
"""

from __future__ import annotations

import argparse
import csv
import os
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from peers.environment import python_of
from scipy.optimize import linear_sum_assignment

from vidtrack import formats, score
from vidtrack.config.load import load
from vidtrack.formats import Table
from vidtrack.run.files import run_file
from vidtrack.score.matching import box_iou

PEERS = ("sort", "bytetrack", "ocsort", "norfair")
QUANTILES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
KITTI_FPS, KITTI_SIZE = 10.0, (1242, 375)
AICITY_FPS, AICITY_FRAMES, AICITY_SIZE = 10.0, 1000, (1920, 1080)
DETECTORS = ("ssd512", "yolo3", "mask_rcnn")
DEVELOPED = ("ADL-Rundle-6", "KITTI-13", "PETS09-S2L1", "ssd512", "mask_rcnn")
"""Sequences of which at least a half was developed on, beside the even numbers of KITTI."""

INFO = "[Sequence]\nframeRate={}\nseqLength={}\nimWidth={}\nimHeight={}\n"


@dataclass(frozen=True)
class Sequence:
    """Detections and truth of one sequence, seqinfo.ini as text, and objects that count neither way."""

    dataset: str
    name: str
    detections: Table
    truth: Table
    fps: float
    frames: int
    info: str
    neutral: Table | None = None


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
        info = INFO.format(KITTI_FPS, frames, width, height)
        detections = formats.box_table(found[:, 0], np.full(len(found), -1), _sides(found[:, 1:5]), found[:, 5])
        truth = formats.box_table(rows[:, 0], rows[:, 1], _sides(rows[:, 2:]))
        yield Sequence(folder.name, path.stem, detections, truth, KITTI_FPS, frames, info)


def aicity(folder: Path) -> Iterable[Sequence]:
    """The junction of AI City by each detector, each a data set of its own."""
    with (folder / "truth.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    frame, identity, parked = (np.array([int(row[name]) for row in rows]) for name in ("frame", "id", "parked"))
    box = np.array([[float(row[name]) for name in "xywh"] for row in rows])
    truth = formats.box_table(frame - 1, identity, box)
    info = INFO.format(AICITY_FPS, AICITY_FRAMES, *AICITY_SIZE)
    for name in DETECTORS:
        found = formats.read(folder / f"det_{name}.txt")
        moving, standing = truth.select(parked == 0), truth.select(parked == 1)
        yield Sequence(f"aicity {name}", name, found, moving, AICITY_FPS, AICITY_FRAMES, info, standing)


def counted(result: Table, sequence: Sequence) -> Table:
    """The rows of a result that count: those that are matched to a neutral object do not."""
    if sequence.neutral is None or not len(result):
        return result
    keep = np.ones(len(result), bool)
    for k in np.unique(result.frame):
        rows = np.flatnonzero(result.frame == k)
        neutral, wanted = (table.box[table.frame == k] for table in (sequence.neutral, sequence.truth))
        theirs = np.concatenate([neutral, wanted])
        i, j = np.indices((len(rows), len(theirs))).reshape(2, -1)
        iou = box_iou(result.box[rows][i], theirs[j]).reshape(len(rows), -1)
        iou[iou < 0.5] = 0
        i, j = linear_sum_assignment(iou, maximize=True)
        keep[rows[i[(iou[i, j] > 0) & (j < len(neutral))]]] = False
    return result.select(keep)


def half_of(sequences: list[Sequence], results: list[Table], half: str) -> tuple[list[Sequence], list[Table]]:
    """The half of all sequences and results that was developed on, or the one kept aside."""
    chosen = []
    for sequence, result in zip(sequences, results, strict=True):
        known = sequence.name in DEVELOPED or (sequence.dataset == "kitti" and int(sequence.name) % 2 == 0)
        if sequence.neutral is None:
            if known == (half == "developed"):
                chosen.append((sequence, result))
        elif known or half == "aside":
            early, late = (0, AICITY_FRAMES // 2), (AICITY_FRAMES // 2, AICITY_FRAMES)
            part = partial(_span, *(early if half == "developed" else late))
            neutral, truth = part(sequence.neutral), part(sequence.truth)
            chosen.append((replace(sequence, truth=truth, neutral=neutral), part(result)))
    return [sequence for sequence, _ in chosen], [result for _, result in chosen]


def _span(begin: int, end: int, table: Table) -> Table:
    return table.select((table.frame >= begin) & (table.frame < end))


def _sides(corners: np.ndarray) -> np.ndarray:
    return np.hstack([corners[:, :2], corners[:, 2:] - corners[:, :2]])


def track_ours(sequence: Sequence, settings: str, folder: Path) -> Table:
    """`vidtrack track det.txt` with these settings, NAME=VALUE,..."""
    place = folder / sequence.dataset / sequence.name
    place.mkdir(parents=True, exist_ok=True)
    formats.write_mot(place / "det.txt", sequence.detections)
    (place / "seqinfo.ini").write_text(sequence.info)
    with run_file(
        str(place / "det.txt"), load(None, filter(None, settings.split(","))), place / "out", force=True
    ) as run:
        for _ in run:
            pass
    return formats.read(place / "out")


def track_peers(sequences: list[Sequence], environments: Path, folder: Path) -> dict[tuple[str, int], list[Table]]:
    """Results of each sequence by peer and number of the threshold; the first is the peer's own."""
    folder.mkdir()
    for number, sequence in enumerate(sequences):
        scores = np.concatenate([s.detections.conf for s in sequences if s.dataset == sequence.dataset])
        found = sequence.detections
        np.savez(
            folder / f"{number}.npz", box=found.box, frame=found.frame, score=found.conf, fps=sequence.fps,
            frames=sequence.frames, threshold=[np.nan, *np.quantile(scores, QUANTILES)],
        )  # fmt: skip
    for environment, script in (("numpy2", "detections.py"), ("numpy1", "norfair_detections.py")):
        python = python_of(environment, environments)
        subprocess.run([python, Path(__file__).parent / "peers" / script, folder], check=True)

    def result(number: int, peer: str, k: int) -> Table:
        frame, identity, detection = np.load(folder / f"{number}-{peer}-{k}.npy").T
        return formats.box_table(frame, identity, sequences[number].detections.box[detection])

    return {
        (peer, k): [result(number, peer, k) for number in range(len(sequences))]
        for peer in PEERS
        for k in range(1 + len(QUANTILES))
    }


def best(sequences: list[Sequence], by_threshold: list[list[Table]]) -> list[Table]:
    """Results with the threshold that gives most HOTA on each data set, on those of AI City most IDF1."""
    chosen = {
        dataset: max(
            by_threshold,
            key=lambda results: scores_of(sequences, results, {dataset}.__contains__)[
                "idf1" if dataset.startswith("aicity") else "hota"
            ],
        )
        for dataset in {sequence.dataset for sequence in sequences}
    }
    return [chosen[sequence.dataset][number] for number, sequence in enumerate(sequences)]


def scores_of(sequences: list[Sequence], results: list[Table], wanted: Callable[[str], bool]) -> dict[str, float]:
    """Pooled scores of the data sets that are wanted."""
    pairs = [(counted(r, s), s.truth) for s, r in zip(sequences, results, strict=True) if wanted(s.dataset)]
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
    parser.add_argument("--ours", nargs="+", default=[], metavar="NAME=VALUE,...", help="ours with these settings too")
    parser.add_argument("--half", choices=("developed", "aside"), help="score one half only")
    parser.add_argument("--sequences", action="store_true", help="also every sequence by itself")
    parser.add_argument("--truth", nargs="+", default=["Car", "Van"], help="labels of KITTI (default Car Van)")
    options = parser.parse_args()
    if "VIDTRACK_DATA" not in os.environ:
        parser.error("set VIDTRACK_DATA to the folder that holds mot15/, kitti/ and aicity/")
    data = Path(os.environ["VIDTRACK_DATA"])
    whole = [*mot15(data / "mot15"), *kitti(data / "kitti", options.truth), *aicity(data / "aicity")]

    results: dict[str, list[Table]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for settings in ("", *options.ours):
            results[settings or "ours"] = [track_ours(sequence, settings, Path(folder)) for sequence in whole]
        found = track_peers(whole, options.peers_in, Path(folder) / "peers") if options.peers_in else {}
    sequences = half_of(whole, [s.truth for s in whole], options.half)[0] if options.half else whole
    if options.half:
        results = {name: half_of(whole, tables, options.half)[1] for name, tables in results.items()}
        found = {name: half_of(whole, tables, options.half)[1] for name, tables in found.items()}
    for peer in PEERS if found else ():
        results[peer] = found[peer, 0]
        results[f"{peer}, best"] = best(sequences, [found[peer, k + 1] for k in range(len(QUANTILES))])

    names = dict.fromkeys(sequence.dataset for sequence in sequences)
    tables: dict[str, Callable[[str], bool]] = {"mot15 and kitti": {"mot15", "kitti"}.__contains__}
    tables |= {name: {name}.__contains__ for name in names}
    heading = "".join(f"{key:>9s}" for key in ("HOTA", "IDF1", "MOTA", "DetA", "AssA")) + f"{'switches':>10s}"
    for title, wanted in tables.items():
        print(f"\n{title:24s}{heading}")
        for name, tables_of in results.items():
            print_line(name, scores_of(sequences, tables_of, wanted))
    for number, sequence in enumerate(sequences if options.sequences else []):
        print(f"\n{sequence.dataset + ' ' + sequence.name:24s}{heading}")
        for name, tables_of in results.items():
            print_line(name, scored(counted(tables_of[number], sequence), sequence.truth))


if __name__ == "__main__":
    main()
