"""Convex hulls: where a calibration has been checked by its points."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Mask


def hull(points: Floats) -> Floats:
    """(M, 3) half planes a x + b y + c <= 0, (a, b) of unit length, that hold the points (N, 2); NaN if on one line."""
    from scipy.spatial import ConvexHull, QhullError  # slow to import, and few runs need it

    try:
        return np.asarray(ConvexHull(points).equations)
    except QhullError:
        return np.full((1, 3), np.nan)


def within(planes: Floats, xy: Floats, margin: float) -> Mask:
    """(N,) whether points (N, 2) lie in the hull or at most `margin` outside each of its sides."""
    return np.asarray((xy @ planes[:, :2].T + planes[:, 2] <= margin).all(axis=1))
