"""Tracks that are parts of a larger vehicle, because they stand still in its box while it drives."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import inlined, kernel
from vidtrack.tracking.births import FRAGMENT
from vidtrack.tracking.boxes import common
from vidtrack.tracking.register import REST

LARGER = 2.0
"""A vehicle that another track is aboard is at least so many times as large."""


@kernel
def go_along(
    box: Floats, name: Ints, confirmed: Mask, seen: Mask, born_s: Floats, host: Ints, seat: Floats, t: float,
    least_s: float, share: float,
) -> Mask:  # fmt: skip
    """(T,) confirmed tracks that go along with a larger one that is seen, for at least least_s [s] and this share of their lives.

    box   (T, 4) in the picture at time t [s], of tracks with a name (T,), `confirmed` (T,), `seen` in this scan (T,), born at born_s (T,) [s]
    host  (T,) name of the vehicle whose box holds FRAGMENT of the track's; -1: none. Changed in place
    seat  (T, 5) since when [s] the track has not moved by REST of its size in that box; where in the box its middle
          was then, as shares of the sides; where in the picture the middle of the box was. Changed in place

    A track goes along only where the vehicle has driven by REST of the track's size meanwhile: those who stand in a
    queue do not.
    """
    along = np.zeros(len(box), np.bool_)
    for i in range(len(box)):
        k = _host(box, i)
        if k < 0:
            host[i] = -1
            continue
        moved = driven = 0.0
        for axis in range(2):
            side, larger = box[i, 2 + axis], box[k, 2 + axis]
            middle = box[k, axis] + larger / 2
            place = (box[i, axis] + side / 2 - middle) / larger
            moved = max(moved, abs(place - seat[i, 1 + axis]) * larger / side)
            driven += (middle - seat[i, 3 + axis]) ** 2
        if host[i] != name[k] or not moved <= REST:
            host[i], seat[i, 0] = name[k], t
            for axis in range(2):
                middle = box[k, axis] + box[k, 2 + axis] / 2
                seat[i, 1 + axis] = (box[i, axis] + box[i, 2 + axis] / 2 - middle) / box[k, 2 + axis]
                seat[i, 3 + axis] = middle
            continue
        sat = t - seat[i, 0]
        far = np.sqrt(driven) > REST * max(box[i, 2], box[i, 3])
        along[i] = confirmed[i] and seen[k] and far and sat > least_s and sat > share * (t - born_s[i])
    return along


@inlined
def _host(box: Floats, i: int) -> int:
    """The box that holds the most of box i, of those that are LARGER; -1: none holds FRAGMENT of it."""
    area = box[i, 2] * box[i, 3]
    best, most = -1, FRAGMENT * area
    for k in range(len(box)):
        if box[k, 2] * box[k, 3] < LARGER * area:
            continue
        inside = common(box[i], box[k])
        if inside > most:
            best, most = k, inside
    return best
