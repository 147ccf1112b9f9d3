"""Run the trackers of roboflow `trackers` over stored detections; started by a benchmark in the peers' environment.

    python detections.py FOLDER

FOLDER/*.npz          box (N, 4) left, top, width, height, frame (N,) from 0, score (N,), fps, frames, threshold (K,)
FOLDER/NAME-PEER-K.npy  rows frame, id, detection (R, 3): which track took which box, for threshold k; NaN is the
                        peer's own threshold

A threshold t is that of new tracks: `track_activation_threshold` of SORT and ByteTrack, whose
`high_conf_det_threshold` is then 0.1 lower as it is by default, and `high_conf_det_threshold` of OC-SORT.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import supervision
import trackers

PEERS: dict[str, tuple[Callable[..., Any], Callable[[float], dict[str, float]]]] = {
    "sort": (trackers.SORTTracker, lambda t: {"track_activation_threshold": t}),
    "bytetrack": (
        trackers.ByteTrackTracker,
        lambda t: {"track_activation_threshold": t, "high_conf_det_threshold": t - 0.1},
    ),
    "ocsort": (trackers.OCSORTTracker, lambda t: {"high_conf_det_threshold": t}),
}


def run(tracker: Any, frames: list[supervision.Detections]) -> np.ndarray:
    """Rows frame, id, detection (R, 3) of the established tracks."""
    rows: list[tuple[int, int, int]] = []
    for frame, detections in enumerate(frames):
        found = tracker.update(detections)
        pairs = zip(found.tracker_id, found.data.get("index", ()), strict=len(found) > 0)
        rows += [(frame, int(identity), int(index)) for identity, index in pairs if identity >= 0]
    return np.array(rows, np.int64).reshape(-1, 3)


def frames_of(data: Any) -> list[supervision.Detections]:
    """Detections of each frame in the peers' form, numbered through the file."""
    box = data["box"]
    corners = np.hstack([box[:, :2], box[:, :2] + box[:, 2:]])
    rows = [np.flatnonzero(data["frame"] == frame) for frame in range(int(data["frames"]))]
    return [
        supervision.Detections(xyxy=corners[i], confidence=data["score"][i], data={"index": i}) for i in rows
    ]  # fmt: skip


def main(folder: Path) -> None:
    """Every peer with every threshold over every file."""
    warnings.simplefilter("ignore")
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as data:
            frames = frames_of(data)
            for name, (make, options) in PEERS.items():
                for k, threshold in enumerate(data["threshold"]):
                    chosen = {} if np.isnan(threshold) else options(float(threshold))
                    tracker = make(frame_rate=float(data["fps"]), **chosen)
                    np.save(folder / f"{path.stem}-{name}-{k}.npy", run(tracker, frames))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
