"""Tracks as a tracker would show them, made of their boxes."""

import numpy as np

from vidtrack.tracks import CONFIRMED, Tracks


def tracks_of(t, box=(), ids=None, status=CONFIRMED, travel=1e3, age_s=1.0):
    """Tracks at t with boxes (T, 4) left, top, width, height, alone and seen."""
    box = np.asarray(box, float).reshape(-1, 4)
    count = len(box)
    x = np.zeros((count, 4))
    x[:, [0, 2]] = box[:, :2] + box[:, 2:] / 2
    nan, none = np.full(count, np.nan), np.full(count, -1)
    return Tracks(
        t, np.arange(count) if ids is None else np.asarray(ids), np.full(count, status, np.int8), x,
        np.tile(np.eye(4), (count, 1, 1)), box, none, nan, np.full(count, age_s), np.full(count, travel),
        np.ones(count), none, nan,
    )  # fmt: skip


def drive(learn, size, vehicles, rows=(60, 200), step=20, x=160.0, first=0):
    """Let vehicles drive down a picture one after another; learn takes the tracks, size(y) is width and height."""
    for vehicle in range(first, first + vehicles):
        for k, bottom in enumerate(range(*rows, step)):
            width, height = size(bottom)
            box = [x - width / 2, bottom - height, width, height]
            learn(tracks_of(10.0 * vehicle + 0.2 * k, [box], ids=[vehicle]))
    learn(tracks_of(10.0 * (first + vehicles)))
