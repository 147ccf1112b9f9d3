"""Tracks that are parts of a larger vehicle, because they keep their place in its box while it drives."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.compiled import inlined, kernel
from vidtrack.tracking.births import FRAGMENT
from vidtrack.tracking.boxes import common
from vidtrack.tracking.register import REST

LARGER = 2.0
"""A track that another one is a part of is at least so many times as large."""


@kernel
def go_along(
    box: Floats, name: Ints, confirmed: Mask, seen: Mask, born_s: Floats, rest_s: Floats, host: Ints, seat: Floats,
    t: float, least_s: float, share: float,
) -> Mask:  # fmt: skip
    """(T,) confirmed tracks that go along with a larger one, for least_s [s] and this share of their lives or longer.

    box   (T, 4) in the picture at time t [s], of tracks with a name (T,)
    confirmed, seen, born_s, rest_s   (T,) whether each is confirmed, whether the scan shows it, when it began [s], and
          when it last moved on by REST of its size
    host  (T,) name of the track whose box holds FRAGMENT of each, which is LARGER; -1: none. Changed in place
    seat  (T, 5) since when [s] the track has not moved by REST of its size in that box; where in the box its middle
          was then, as shares of the sides; where in the picture the middle of the box was. Changed in place

    The share is that of the whole life. Those who stand in a queue keep their places, too: the time begins anew for who
    has not moved on for twice least_s, and nobody goes along until the host has driven by REST of the track's size.
    """
    along = np.zeros(len(box), np.bool_)
    for i in range(len(box)):
        k = _host(box, i)
        if k < 0:
            host[i] = -1
            continue
        moved = driven = 0.0
        for axis in range(2):
            middle, place = _seat(box, i, k, axis)
            moved = max(moved, abs(place - seat[i, 1 + axis]) * box[k, 2 + axis] / box[i, 2 + axis])
            driven += (middle - seat[i, 3 + axis]) ** 2
        sat = t - seat[i, 0]
        stood = np.sqrt(driven) <= REST * max(box[i, 2], box[i, 3])
        if host[i] != name[k] or not moved <= REST or t - rest_s[i] > 2 * least_s:
            host[i], seat[i, 0] = name[k], t
            for axis in range(2):
                seat[i, 3 + axis], seat[i, 1 + axis] = _seat(box, i, k, axis)
            continue
        along[i] = confirmed[i] and seen[k] and not stood and sat > least_s and sat > share * (t - born_s[i])
    return along


@inlined
def _host(box: Floats, i: int) -> int:
    """The box that holds the most of box i, of those that are LARGER; -1: none holds FRAGMENT of it."""
    area = box[i, 2] * box[i, 3]
    best, most = -1, FRAGMENT * area
    for k in range(len(box)):
        if not box[k, 2] * box[k, 3] >= LARGER * area:
            continue
        inside = common(box[i], box[k])
        if inside > most:
            best, most = k, inside
    return best


@inlined
def _seat(box: Floats, i: int, k: int, axis: int) -> tuple[float, float]:
    """Along an axis: the middle of box k, and how far from it that of box i is, as a share of k's side."""
    middle = box[k, axis] + box[k, 2 + axis] / 2
    return middle, (box[i, axis] + box[i, 2 + axis] / 2 - middle) / box[k, 2 + axis]
