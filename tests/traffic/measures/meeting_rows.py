"""Rows of vehicles that meet, and their conflicts."""

import numpy as np

from vidtrack.traffic.measures.conflicts import Meeting
from vidtrack.traffic.measures.rows import Rows

ALWAYS = np.array([[0.0, 1e6]])


def rows_of(track, t, xy, v, length=4.0, width=2.0, heading=None, sigma=0.0, speed_sigma=0.0, length_sigma=0.0):
    """Rows (N,) in order of time; `heading` (N,) rad from east, None: the way of v (N, 2)."""
    track, t, xy, v = (np.asarray(one) for one in (track, t, xy, v))
    count = len(t)
    angle = np.arctan2(v[:, 1], v[:, 0]) if heading is None else np.asarray(heading)
    yes, full = np.ones(count, bool), lambda value: np.broadcast_to(np.asarray(value, float), count)
    sides = full(length), full(length_sigma), full(width)
    spread = np.column_stack([full(sigma**2), full(sigma**2), full(0)])
    ahead = np.column_stack([np.cos(angle), np.sin(angle)])
    rows = Rows(
        *(track, t, yes, ~yes, ~yes, xy.astype(float), full(sigma), full(1.0), v.astype(float)),
        *(np.hypot(*v.T), full(speed_sigma), full(0), *sides, ahead, spread, *2 * [np.full((count, 4), np.nan)]),
    )
    return rows.only(np.argsort(t, kind="stable"))


def driven(*ways, fps=25.0, seconds=8.0):
    """Tracks, times, places and velocities of vehicles that start at x, y with vx, vy."""
    t = np.arange(round(seconds * fps) + 1) / fps
    start = np.array(ways, float)
    xy = start[:, None, :2] + t[None, :, None] * start[:, None, 2:]
    v = np.broadcast_to(start[:, None, 2:], xy.shape)
    return np.repeat(np.arange(len(ways)), len(t)), np.tile(t, len(ways)), xy.reshape(-1, 2), v.reshape(-1, 2)


def found_in(rows, block=None, vehicle=None):
    meeting, block = Meeting(), block or max(1, len(rows))
    for first in range(0, len(rows), block):
        meeting.add(rows.only(np.arange(first, min(first + block, len(rows)))))
    tracks = int(rows.track.max(initial=0)) + 1
    return meeting.conflicts(np.arange(tracks) if vehicle is None else vehicle, ALWAYS)


def bend(track, start_s, turn_rad, speed=6.0, radius=7.0):
    """A vehicle that drives 30 m to the east, turns left by an angle, and goes straight on for 30 m."""
    s = np.arange(0, 60 + radius * turn_rad, speed / 25)
    angle = np.clip((s - 30) / radius, 0, turn_rad)
    heading = np.column_stack([np.cos(angle), np.sin(angle)])
    xy = np.cumsum(heading, axis=0) * speed / 25
    return np.full(len(s), track), start_s + s / speed, xy, speed * heading


def both(*ways):
    return rows_of(*(np.concatenate(column) for column in zip(*ways, strict=True)), width=1.8)
