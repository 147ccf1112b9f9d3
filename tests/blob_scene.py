"""Scans of rectangles as a detector sees them: vehicles that touch are one blob."""

import numpy as np
from scipy.sparse.csgraph import connected_components

from vidtrack.config.settings import TrackerSettings
from vidtrack.run.trackers import build_blob_tracker
from vidtrack.scan import Scan

SIZE = (320.0, 240.0)


def default_tracker(bounds=SIZE, **settings):
    """The tracker that `vidtrack track` uses."""
    return build_blob_tracker(TrackerSettings(**settings), bounds)


def centred(x, y, width, height):
    """left, top, width, height of a box around (x, y)."""
    return [x - width / 2, y - height / 2, width, height]


def scan_of(t, boxes, jitter=0.0, rng=None):
    """Scan at t of boxes (N, 4): left, top, width, height. Overlapping ones are one blob with one centroid."""
    boxes = np.asarray(boxes, float).reshape(-1, 4)
    low, high = boxes[:, :2], boxes[:, :2] + boxes[:, 2:]
    touch = (low[:, None] < high[None]).all(axis=2) & (low[None] < high[:, None]).all(axis=2)
    count, label = connected_components(touch) if len(boxes) else (0, np.empty(0, int))
    z, box = np.empty((count, 2)), np.empty((count, 4))
    for blob in range(count):
        on = label == blob
        corner, end = low[on].min(axis=0), high[on].max(axis=0)
        z[blob] = np.average((low[on] + high[on]) / 2, axis=0, weights=boxes[on, 2:].prod(axis=1))
        if jitter:
            z[blob] += jitter * rng.normal(size=2)
            corner, end = corner + jitter * rng.normal(size=2), end + jitter * rng.normal(size=2)
        box[blob] = *(corner - z[blob]), *(end - corner)
    sigma = 0.5 + 0.03 * box[:, 2:]
    return Scan(t, z, sigma[:, :, None] ** 2 * np.eye(2), box=box)


def play(tracker, vehicles, seconds, fps=25.0, jitter=0.0, seed=0):
    """Snapshots of a scene; vehicles(t) gives the boxes at t."""
    rng = np.random.default_rng(seed)
    times = np.arange(round(seconds * fps)) / fps
    return [tracker.step(scan_of(t, vehicles(t), jitter, rng)) for t in times]


def events(snapshots, kind):
    """(time, track id) of all events of a kind."""
    return [(event.t, event.track_id) for tracks in snapshots for event in tracks.events if event.kind == kind]


def confirmed_ids(snapshots):
    """Ids of all tracks that were ever confirmed."""
    return {track for _, track in events(snapshots, "confirmed")}


def nearest_id(tracks, x, y):
    """Id of the track nearest to a point."""
    return int(tracks.id[np.argmin(np.hypot(*(tracks.xy - [x, y]).T))])
