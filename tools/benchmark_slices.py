"""How far the tracks of a video that was cut into slices differ from those of a single run.

    python tools/benchmark_slices.py VIDEO... [--slice 60 300] [--warm-up 0 30 120] [--set A.B=VALUE]

Each video is tracked once whole, in slices that go on from each other, and in slices with each warm-up. A track differs
if no track of the other run agrees with it, one to one, in 90 % of the frames that either has (boxes with an
intersection over union of at least 0.5).
Crossings are those of three lines across and three down the picture; they are paired by line and direction within 2 s,
and are shifted from 0.1 s on. CPU time is that of this process.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyarrow.parquet as pq
from scipy.optimize import linear_sum_assignment

from vidtrack.config.load import load
from vidtrack.run.files import run_file
from vidtrack.run.run import Run
from vidtrack.run.slices.cuts import cuts
from vidtrack.run.slices.stitch import stitched_pipeline
from vidtrack.run.slices.track import track_slice
from vidtrack.score.matching import box_iou
from vidtrack.video.source import duration_s, open_source

SAME, AGREE, NEAR_S, SHIFTED_S = 0.9, 0.5, 2.0, 0.1


def spread_lines(width: int, height: int) -> list[str]:
    """Three lines across the picture and three down."""
    across = [f"y{k}:0,{k * height / 4},{width},{k * height / 4}" for k in (1, 2, 3)]
    return across + [f"x{k}:{k * width / 4},0,{k * width / 4},{height}" for k in (1, 2, 3)]


def tracks_differ(one: Path, other: Path) -> tuple[int, int]:
    """Number of tracks of the first run without an equal one in the other, and number of its tracks."""
    names = ("frame", "track_id", "left_px", "top_px", "width_px", "height_px")
    tables = [pq.read_table(run / "tracks.parquet", columns=list(names)) for run in (one, other)]
    frame, ids, box = zip(
        *(
            (t["frame"].to_numpy(), t["track_id"].to_numpy(), np.column_stack([t[n].to_numpy() for n in names[2:]]))
            for t in tables
        ),
        strict=True,
    )
    (known, row, length), (known_b, row_b, length_b) = (
        np.unique(each, return_inverse=True, return_counts=True) for each in ids
    )
    start = [np.searchsorted(f, np.arange(max(frame[0].max(), frame[1].max()) + 2)) for f in frame]
    agree = np.zeros((len(known), len(known_b)), np.int64)
    for k in range(len(start[0]) - 1):
        a, b = np.arange(start[0][k], start[0][k + 1]), np.arange(start[1][k], start[1][k + 1])
        i, j = np.repeat(a, len(b)), np.tile(b, len(a))
        same = box_iou(box[0][i], box[1][j]) >= AGREE
        np.add.at(agree, (row[i[same]], row_b[j[same]]), 1)
    share = agree / (length[:, None] + length_b[None] - agree)
    rows, columns = linear_sum_assignment(-share)
    return len(known) - int(np.count_nonzero(share[rows, columns] >= SAME)), len(known)


def crossings(run: Path) -> dict[tuple[str, str], np.ndarray]:
    """Times of the crossings by line and direction [s]."""
    with open(run / "counts.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    ways = {(row["line"], row["direction"]) for row in rows}
    return {way: np.array([float(r["time_s"]) for r in rows if (r["line"], r["direction"]) == way]) for way in ways}


def crossings_differ(one: Path, other: Path) -> tuple[int, int, int, int]:
    """Crossings of the first run, those that the other lost, those that it has besides, those shifted in time."""
    a, b = crossings(one), crossings(other)
    lost = more = shifted = 0
    for way in {*a, *b}:
        s, t = a.get(way, np.empty(0)), b.get(way, np.empty(0))
        apart = np.abs(s[:, None] - t[None])
        rows, columns = linear_sum_assignment(np.where(apart <= NEAR_S, apart, 1e6))
        found = apart[rows, columns]
        found = found[found <= NEAR_S]
        lost, more = lost + len(s) - len(found), more + len(t) - len(found)
        shifted += int(np.count_nonzero(found > SHIFTED_S))
    return sum(map(len, a.values())), lost, more, shifted


def main() -> None:
    """Print a table, one row for a video and a pair of lengths."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("videos", nargs="+")
    parser.add_argument("--slice", type=float, nargs="+", default=[60.0, 300.0])
    parser.add_argument("--warm-up", type=float, nargs="+", default=[30.0, 120.0])
    parser.add_argument("--set", action="append", default=[])
    given = parser.parse_args()
    print("video,slice_s,warm_up_s,slices,tracks,differ,crossings,lost,more,shifted,single_s,slices_s,stitch_s,mb")
    for video in given.videos:
        with TemporaryDirectory() as name:
            compare(video, Path(name), given)


def compare(video: str, folder: Path, given: argparse.Namespace) -> None:
    """The rows of one video."""
    with open_source(video, load().source) as source:
        lines = spread_lines(source.width, source.height)
    settings = load(assignments=[("output.lines", lines), *given.set])
    begun = time.process_time()
    with run_file(video, settings, folder / "single") as run:
        for _ in run:
            pass
    single_s = time.process_time() - begun
    for slice_s in given.slice:
        for warm_s in (None, *given.warm_up):
            cut = cuts(settings.source.start_s, settings.source.end_s, duration_s(video) or 0.0, slice_s, warm_s)
            with TemporaryDirectory(dir=folder) as name:
                parts = [Path(name, f"{one.number}") for one in cut]
                begun = time.process_time()
                for one, part in zip(cut, parts, strict=True):
                    part.mkdir()
                    track_slice(
                        video, settings, one, part, parts[one.number - 1] if one.goes_on else None, lambda: None
                    )
                tracked = time.process_time()
                with Run(stitched_pipeline(video, cut, parts, settings), Path(name, "whole")) as run:
                    for _ in run:
                        pass
                stitched = time.process_time()
                size = sum(file.stat().st_size for part in parts for file in part.iterdir())
                differ = tracks_differ(folder / "single", Path(name, "whole"))
                crossed = crossings_differ(folder / "single", Path(name, "whole"))
            costs = f"{single_s:.1f},{tracked - begun:.1f},{stitched - tracked:.1f},{size / 1e6:.0f}"
            lengths = f"{slice_s:g},{'handed on' if warm_s is None else warm_s},{len(cut)}"
            found = f"{differ[1]},{differ[0]},{','.join(map(str, crossed))}"
            print(f"{Path(video).parent.name}/{Path(video).name},{lengths},{found},{costs}")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
