"""Steps made by hand, to drive sinks without a detector or a tracker."""

from __future__ import annotations

import numpy as np

from vidtrack.output.sink import Step
from vidtrack.scan import Scan
from vidtrack.tracks import Status, Tracks
from vidtrack.video.foreground import Foreground
from vidtrack.video.frame import Frame

WORDS = {"t": Status.TENTATIVE, "c": Status.CONFIRMED, "o": Status.COASTING, "m": Status.MERGED}


class Kept:
    """A sink that keeps what it is given."""

    def __init__(self):
        self.steps, self.closed = [], False

    def step(self, step):
        self.steps.append(step)

    def close(self):
        self.closed = True


def make_tracks(t, rows, **extra):
    """Tracks at time t from rows (id, letter of the status, x, y); coasting ones have no measurement."""
    ids = np.array([row[0] for row in rows], np.int64)
    status = np.array([WORDS[row[1]] for row in rows], np.int8)
    xy = np.array([row[2:4] for row in rows], float).reshape(-1, 2)
    count = len(ids)
    x = np.zeros((count, 4))
    x[:, [0, 2]] = xy
    x[:, 1] = 50.0
    P = np.tile(np.diag([4.0, 9.0, 1.0, 9.0]), (count, 1, 1))
    P[:, 0, 2] = P[:, 2, 0] = 0.2
    coasting = status == Status.COASTING
    merged = status == Status.MERGED
    measured = ~coasting & ~merged
    return Tracks(
        t=t,
        id=ids,
        status=status,
        x=x,
        P=P,
        box=np.hstack([xy - [10, 5], np.full((count, 2), [20.0, 10.0])]).reshape(-1, 4),
        group=np.where(merged, 3, -1),
        group_since_s=np.where(merged, t, np.nan),
        age_s=np.full(count, t),
        travel=np.zeros(count),
        existence=np.full(count, 0.9),
        measurement=np.where(measured, np.cumsum(measured) - 1, -1),
        nis=np.where(measured, 1.5, np.nan),
        **extra,
    )


def make_step(index, rows, fps=25.0, shape=None, time_s=None, **extra):
    """Step `index` with tracks from rows; with `shape` (H, W) it has a picture and a mask of its boxes."""
    t = index / fps if time_s is None else time_s
    tracks = make_tracks(t, rows, **extra)
    seen = tracks.measurement >= 0
    box = np.tile([-10.0, -5.0, 20.0, 10.0], (int(seen.sum()), 1))
    scan = Scan(t, tracks.xy[seen], 2.0 * np.eye(2), box=box)
    frame = foreground = None
    if shape is not None:
        luma = np.tile(np.linspace(60, 180, shape[1], dtype=np.uint8), (shape[0], 1))
        mask = np.zeros(shape, np.uint8)
        for left, top, width, height in tracks.box.astype(int).tolist():
            area = np.s_[max(top, 0) : max(top + height, 0), max(left, 0) : max(left + width, 0)]
            luma[area] = 220
            mask[area] = 255
        frame = Frame(index, t, luma)
        foreground = Foreground(mask, mask / np.float32(255), 1)
    return Step(index, t, scan, tracks, frame, foreground, {"detect": 0.002, "track": 0.001})
