"""Count vehicles over lines as one would by hand: OpenCV's background subtraction, SORT or ByteTrack, a line test.

    python count_lines.py JOBS.json

Started by a benchmark in the peers' own environment. JOBS is a list of
{"video", "lines": ["NAME:x1,y1,x2,y2"], "background": "MOG2" or "KNN", "tracker": "SORT" or "ByteTrack",
 "counts": a CSV of time_s, frame, line, direction, track_id to write,
 "tracks": an NPZ of frame, id (N,), box (N, 4) left, top, width, height to write,
 "masks": a folder for masks named as those of `vidtrack track --save-masks`, or null}.

Everything is at its default; blobs are kept from 0.08 % of the picture.
"""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import supervision
import trackers

FOREGROUND = 200  # shadows are marked with 127
MEDIAN_PX = 7
GROWTH_PX = 2
MIN_AREA_SHARE = 8e-4


class LineTest:
    """Counts a track once per way when its centre's signed distance changes sign between the line's ends."""

    def __init__(self, text: str) -> None:
        self.name, _, numbers = text.rpartition(":")
        x1, y1, x2, y2 = (float(number) for number in numbers.split(","))
        self.start = np.array([x1, y1])
        self.length = np.hypot(x2 - x1, y2 - y1)
        self.along = np.array([x2 - x1, y2 - y1]) / self.length
        self.normal = np.array([-self.along[1], self.along[0]])
        flat = abs(x2 - x1) > abs(y2 - y1)
        forwards = self.normal[1 if flat else 0] > 0
        names = ("up", "down") if flat else ("left", "right")
        self.ways = names if forwards else names[::-1]  # against the normal, along it
        self.distance: dict[int, float] = {}
        self.counted: set[tuple[int, str]] = set()

    def crossed(self, track: int, centre: np.ndarray) -> str | None:
        """The way in which a track has just crossed, if it has not been counted that way before."""
        distance, along = (centre - self.start) @ self.normal, (centre - self.start) @ self.along
        before = self.distance.get(track, 0.0)
        if distance:
            self.distance[track] = distance
        way = self.ways[int(distance > 0)]
        if before * distance >= 0 or not 0 <= along <= self.length or (track, way) in self.counted:
            return None
        self.counted.add((track, way))
        return way


def blobs(mask: np.ndarray) -> np.ndarray:
    """Corners (M, 4) of the components that are large enough."""
    grown = cv2.dilate(mask, None, iterations=GROWTH_PX)
    stats = cv2.connectedComponentsWithStats(grown)[2][1:]
    stats = stats[stats[:, cv2.CC_STAT_AREA] > MIN_AREA_SHARE * mask.size]
    return np.hstack([stats[:, :2], stats[:, :2] + stats[:, 2:4]]).astype(np.float32)


def detections(corners: np.ndarray) -> supervision.Detections:
    """The boxes in the tracker's form, all of the same score and class."""
    if not len(corners):
        return supervision.Detections.empty()
    return supervision.Detections(
        xyxy=corners, confidence=np.ones(len(corners), np.float32), class_id=np.zeros(len(corners), int)
    )


def count(job: dict[str, Any]) -> None:
    """Track one video and write what was found."""
    capture = cv2.VideoCapture(job["video"])
    background = getattr(cv2, f"createBackgroundSubtractor{job['background']}")()
    tracker = getattr(trackers, f"{job['tracker']}Tracker")()
    lines = [LineTest(text) for text in job["lines"]]
    rows: list[tuple[int, int, int, str, int]] = []
    tracked: list[tuple[int, int, float, float, float, float]] = []
    frame = 0
    while True:
        more, picture = capture.read()
        if not more:
            break
        mask = cv2.medianBlur((background.apply(picture) > FOREGROUND).astype(np.uint8) * 255, MEDIAN_PX)
        if job["masks"]:
            cv2.imwrite(str(Path(job["masks"]) / f"{frame:06d}.png"), mask)
        found = tracker.update(detections(blobs(mask)))
        ids = [] if found.tracker_id is None else found.tracker_id
        for track, (left, top, right, bottom) in zip(ids, found.xyxy.tolist(), strict=True):
            if track < 0:
                continue
            tracked.append((frame, track, left, top, right - left, bottom - top))
            centre = np.array([(left + right) / 2, (top + bottom) / 2])
            for line in lines:
                way = line.crossed(track, centre)
                if way is not None:
                    rows.append((0, frame, line.name, way, track))
        frame += 1
    if not frame:
        sys.exit(f"{job['video']}: no picture")
    with open(job["counts"], "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["time_s", "frame", "line", "direction", "track_id"])
        table.writerows(rows)
    stored = np.array(tracked, float).reshape(-1, 6)
    np.savez(job["tracks"], frame=stored[:, 0].astype(int), id=stored[:, 1].astype(int), box=stored[:, 2:])


if __name__ == "__main__":
    for each in json.loads(Path(sys.argv[1]).read_text()):
        count(each)
