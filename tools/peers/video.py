"""Track a video as one would by hand: OpenCV's MOG2, connected components, SORT of roboflow `trackers`.

    python video.py VIDEO RESULT.npz

Started by a benchmark in the peers' own environment. RESULT holds seconds, from opening the video to its
last frame, and the rows frame, id (N,), box (N, 4) left, top, width, height.
"""

from __future__ import annotations

import sys
from time import perf_counter

import cv2
import numpy as np
import supervision
import trackers

FOREGROUND = 255  # MOG2 marks shadows with 127
MIN_AREA_SHARE = 1e-4


def main(video: str, result: str) -> None:
    """Track and store what was found and how long it took."""
    begin = perf_counter()
    capture = cv2.VideoCapture(video)
    background = cv2.createBackgroundSubtractorMOG2()
    tracker = trackers.SORTTracker(frame_rate=capture.get(cv2.CAP_PROP_FPS))
    opening = np.ones((3, 3), np.uint8)
    frames, ids, boxes = [], [], []
    frame = 0
    while True:
        more, picture = capture.read()
        if not more:
            break
        mask = np.where(background.apply(picture) == FOREGROUND, np.uint8(255), np.uint8(0))
        mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, opening)
        _, _, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
        blobs = stats[1:]
        blobs = blobs[blobs[:, cv2.CC_STAT_AREA] >= MIN_AREA_SHARE * mask.size, :4].astype(float)
        corners = np.hstack([blobs[:, :2], blobs[:, :2] + blobs[:, 2:]])
        tracked = tracker.update(supervision.Detections(xyxy=corners, confidence=np.ones(len(corners))))
        known = tracked.tracker_id >= 0
        frames.append(np.full(known.sum(), frame))
        ids.append(tracked.tracker_id[known])
        boxes.append(tracked.xyxy[known])
        frame += 1
    seconds = perf_counter() - begin
    corners = np.concatenate(boxes)
    box = np.hstack([corners[:, :2], corners[:, 2:] - corners[:, :2]])
    np.savez(result, seconds=seconds, frame=np.concatenate(frames), id=np.concatenate(ids), box=box)


if __name__ == "__main__":
    main(*sys.argv[1:])
