"""Count vehicles over a line drawn in the picture, by direction.

    python samples/03_count_over_a_line.py

`vidtrack track --line NAME:x1,y1,x2,y2` does the same with a margin against jitter and writes counts.csv.
"""

from collections import Counter
from pathlib import Path

import numpy as np

import vidtrack as vt

start, end = np.array([200.0, 0.0]), np.array([200.0, 240.0])  # a line from top to bottom, in pixels
along = (end - start) / np.hypot(*(end - start))

counts: Counter[str] = Counter()
before: dict[int, float] = {}  # distance of each track from the line, signed by side
for _frame, tracks in vt.track(Path(__file__).parent / "crossing.avi"):
    offset = tracks.xy - start
    distance = along[0] * offset[:, 1] - along[1] * offset[:, 0]
    for track_id, now, known in zip(tracks.id, distance, tracks.status != vt.Status.TENTATIVE, strict=True):
        last = before.get(track_id, now)
        if known and last * now < 0:
            direction = "to the right" if now < 0 else "to the left"
            counts[direction] += 1
            print(f"{tracks.t:.2f} s: track {track_id} {direction}")
        before[track_id] = now

print(f"crossings: {dict(counts)}")
