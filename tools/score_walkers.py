"""Positions, speeds and classes of the walkers of PETS 2009, against their truth in metres.

    python tools/score_walkers.py pets09 -o DIR

The folder has video.avi (7 frames/s) and gt.txt, whose columns 8 and 9 are metres. The site is calibrated by a dozen of
its rows, the middles of the boxes' lower edges. The video is tracked (`vidtrack track --fps 7 --site`); a row of a
track is of the walker whose box has the largest intersection over union with its own, at least 0.5. Speeds are asked
for every second, and compared with the truth's over two seconds.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.site import read_site
from vidtrack.traffic.vehicles.classes import named
from vidtrack.traffic.vehicles.vehicles import Vehicles

SIZE, FPS, PAIRS, SPAN_S = (768, 576), 7.0, 12, 1.0


def write_site(path: Path, feet: np.ndarray, metres: np.ndarray) -> None:
    """A site calibrated by points that lie far apart: each next one is farthest from those before."""
    chosen = [int(feet[:, 1].argmax())]
    for _ in range(PAIRS - 1):
        chosen.append(int(np.linalg.norm(feet[:, None] - feet[chosen], axis=2).min(axis=1).argmax()))
    points = [feet[chosen].round(2).tolist(), metres[chosen].round(3).tolist()]
    path.write_text(
        f'[site]\nname = "pets"\nwidth = {SIZE[0]}\nheight = {SIZE[1]}\n[calibration]\npicture = {points[0]}\n'
        f"ground = {points[1]}\nsigma_picture_px = 1.0\nsigma_ground_m = 0.05\n"
        "[gates.middle]\nline = [[384, 200], [384, 500]]\n"
    )


def common(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(A, B) intersection over union of boxes left, top, width, height."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, :2] + a[:, None, 2:], b[None, :, :2] + b[None, :, 2:])
    both = np.prod(np.maximum(high - low, 0), axis=2)
    return both / (np.prod(a[:, None, 2:], axis=2) + np.prod(b[None, :, 2:], axis=2) - both)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("-o", dest="folder", type=Path, required=True)
    options = parser.parse_args()
    truth = np.loadtxt(options.data / "gt.txt", delimiter=",")
    frame, who, box, metres = truth[:, 0] - 1, truth[:, 1], truth[:, 2:6] - [1, 1, 0, 0], truth[:, 7:9]
    whole = (box[:, 0] > 2) & (box[:, 0] + box[:, 2] < SIZE[0] - 2) & (box[:, 1] + box[:, 3] < SIZE[1] - 2)
    feet = np.column_stack([box[:, 0] + (box[:, 2] - 1) / 2, box[:, 1] + box[:, 3] - 0.5])
    options.folder.mkdir(parents=True, exist_ok=True)
    site_file, run = options.folder / "site.toml", options.folder / "run"
    write_site(site_file, feet[whole], metres[whole])
    if not run.exists():
        track = ["track", str(options.data / "video.avi"), "--fps", "7", "--site", str(site_file), "-o", str(run), "-q"]
        subprocess.run([sys.executable, "-m", "vidtrack", *track], check=True)
    ground = calibrated(read_site(site_file))
    table = pq.read_table(run / "tracks.parquet")
    column = {name: table[name].to_numpy() for name in table.column_names if name != "status"}
    boxes = np.column_stack([column[f"{name}_px"] for name in ("left", "top", "width", "height")])
    of = np.full(len(boxes), -1)
    for k in np.unique(column["frame"]):
        mine, true = np.flatnonzero(column["frame"] == k), np.flatnonzero(frame == k)
        overlap = common(boxes[mine], box[true])
        best = overlap.argmax(axis=1)
        of[mine] = np.where(overlap.max(axis=1) >= 0.5, true[best], -1)
    place = np.column_stack([column["x_m"], column["y_m"]])
    known = (of >= 0) & np.isfinite(place[:, 0])
    off = np.linalg.norm(place[known] - metres[of[known]], axis=1)
    print(f"{known.sum()} positions: median error {np.median(off):.2f} m, 95 % {np.quantile(off, 0.95):.2f} m")

    ids, track = np.unique(column["track_id"], return_inverse=True)
    edge = np.column_stack([column[f"seen_{name}_px"] for name in ("left", "top", "right", "bottom")])
    vehicles = Vehicles(ground)
    vehicles.add(track, column["time_s"], place, edge)
    asked = np.flatnonzero((of >= 0) & (column["frame"] % round(FPS) == 0))
    found = vehicles.fitted(np.arange(len(ids)), track[asked], column["time_s"][asked])
    assert found is not None
    true = np.array([speed_of(frame, who, metres, row) for row in of[asked]])
    for name, speed in (("a track's fit", found.speeds.speed), ("the row itself", column["speed_kmh"][asked] / 3.6)):
        both = np.isfinite(speed) & np.isfinite(true)
        error = speed[both] - true[both]
        print(
            f"speed by {name}: {both.sum()} of {np.isfinite(true).sum()}; mean absolute error "
            f"{3.6 * np.abs(error).mean():.2f} km/h, median {3.6 * np.median(np.abs(error)):.2f}, mean "
            f"{3.6 * error.mean():+.2f}; true mean {3.6 * true[both].mean():.2f}"
        )
    both = np.isfinite(found.speeds.speed) & np.isfinite(true)
    sigma = np.hypot(found.speeds.own, found.speeds.shared)[both]
    print(f"within 95 % interval: {np.mean(np.abs(found.speeds.speed - true)[both] <= 1.96 * sigma):.3f}")
    walkers = np.unique(track[asked])
    names, _ = named(found.classes)
    print("classes of tracks:", dict(Counter(names[k] for k in walkers)), "scale:", found.scale)


def speed_of(frame: np.ndarray, who: np.ndarray, metres: np.ndarray, row: int) -> float:
    """m/s; of the walker of a row of the truth, from a second before to a second after it; NaN at the ends."""
    span = round(SPAN_S * FPS)
    own = np.flatnonzero(who == who[row])
    before, after = (own[frame[own] == frame[row] + step] for step in (-span, span))
    if len(before) == 0 or len(after) == 0:
        return np.nan
    path = own[(frame[own] >= frame[row] - span) & (frame[own] <= frame[row] + span)]
    ends = metres[path[np.argsort(frame[path])]][[0, -1]]
    return float(np.linalg.norm(ends[1] - ends[0]) / (2 * SPAN_S))


if __name__ == "__main__":
    main()
