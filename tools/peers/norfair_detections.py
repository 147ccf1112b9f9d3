"""Run norfair over stored detections as detections.py runs the others; started by a benchmark in its environment.

    python norfair_detections.py FOLDER

A threshold t is the least score that norfair is given; by itself it takes all. Boxes are compared by IoU, which must
be above 0.3 as for the others.
"""

from __future__ import annotations

import sys
from pathlib import Path

import norfair
import numpy as np

MIN_IOU = 0.3


def run(box: np.ndarray, frame: np.ndarray, frames: int) -> np.ndarray:
    """Rows frame, id, detection (R, 3) of the established tracks, in the frames that show them."""
    tracker = norfair.Tracker(distance_function="iou", distance_threshold=1 - MIN_IOU)
    rows: list[tuple[int, int, int]] = []
    for k in range(frames):
        corners = {int(i): np.array([box[i, :2], box[i, :2] + box[i, 2:]]) for i in np.flatnonzero(frame == k)}
        for track in tracker.update([norfair.Detection(c, data=(k, i)) for i, c in corners.items()]):
            seen, i = track.last_detection.data
            if seen == k:
                rows.append((k, track.id, i))
    return np.array(rows, np.int64).reshape(-1, 3)


def main(folder: Path) -> None:
    """Every threshold over every file."""
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as data:
            box, frame, score, frames = data["box"], data["frame"], data["score"], int(data["frames"])
            for k, threshold in enumerate(data["threshold"]):
                given = np.flatnonzero(score >= (-np.inf if np.isnan(threshold) else threshold))
                rows = run(box[given], frame[given], frames)
                rows[:, 2] = given[rows[:, 2]]
                np.save(folder / f"{path.stem}-norfair-{k}.npy", rows)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
