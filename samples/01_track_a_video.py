"""Track the vehicles of a video: where each one was first and last seen, and how fast it went.

python samples/01_track_a_video.py [VIDEO]
"""

import sys
from pathlib import Path

import numpy as np

import vidtrack as vt

video = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "junction.avi"

paths: dict[int, list[np.ndarray]] = {}
for _frame, tracks in vt.track(video):
    for i in np.flatnonzero(tracks.status != vt.Status.TENTATIVE):
        paths.setdefault(int(tracks.id[i]), []).append(np.array([tracks.t, *tracks.xy[i], *tracks.v[i]]))

for track_id, path in paths.items():
    rows = np.array(path)
    (t0, x0, y0), (t1, x1, y1) = rows[[0, -1], :3]
    speed = np.median(np.hypot(rows[:, 3], rows[:, 4]))
    print(
        f"track {track_id}: {t0:.1f} s at ({x0:.0f}, {y0:.0f}) to {t1:.1f} s at ({x1:.0f}, {y1:.0f}), {speed:.0f} px/s"
    )
print(f"{len(paths)} vehicles")
