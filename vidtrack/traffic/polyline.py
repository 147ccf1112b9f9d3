"""Lines of several segments, and polygons, in the plane."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Mask


def turn(a: Floats, b: Floats, c: Floats) -> Floats:
    """(...,) twice the signed area of the triangles a, b, c (..., 2); its sign is the side of a, b on which c lies."""
    along, to = b - a, c - a
    return np.asarray(along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0])


def touching(a: Floats, b: Floats, c: Floats, d: Floats) -> Mask:
    """(...,) whether the segments a, b and c, d (..., 2) have a point in common."""
    apart = np.sign(turn(a, b, c)) * np.sign(turn(a, b, d)) > 0
    apart |= np.sign(turn(c, d, a)) * np.sign(turn(c, d, b)) > 0
    for k in (0, 1):  # on one line, one after the other
        apart |= np.maximum(a[..., k], b[..., k]) < np.minimum(c[..., k], d[..., k])
        apart |= np.maximum(c[..., k], d[..., k]) < np.minimum(a[..., k], b[..., k])
    return np.asarray(~apart)


def crosses_itself(points: Floats, closed: bool) -> bool:
    """Whether the line through the points (N, 2) meets itself; `closed`: it goes on from the last to the first.

    Two segments that follow each other share a corner. They meet elsewhere only where the line turns back on itself.
    """
    start, end = (points, np.roll(points, -1, axis=0)) if closed else (points[:-1], points[1:])
    count = len(start)
    i, j = np.triu_indices(count, 2)
    if closed:
        i, j = i[(i > 0) | (j < count - 1)], j[(i > 0) | (j < count - 1)]
    if touching(start[i], end[i], start[j], end[j]).any():
        return True
    before, after = (start, np.roll(end, -1, axis=0)) if closed else (start[:-1], end[1:])
    corner = end if closed else end[:-1]
    back = np.sum((corner - before) * (after - corner), axis=1) < 0
    return bool((back & (turn(before, corner, after) == 0)).any())
