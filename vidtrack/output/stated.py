"""The errors that tables state of vehicles in the picture: other ones than the filter calculates with.

The filter takes the lasting errors of blobs for larger independent ones (`estimate.noise`). That is right for what it
learns from many pictures, and keeps its gates wide. But a position is then too uncertain while a blob shows the
vehicle, and too certain where the blob differs from it for long. With P of the filter a table states

    P' = (P^-1 + W^-1)^-1 + L

W   error of this picture's measurement that does not last: `_PIXEL` for a blob of the vehicle's own, the edges' error
    for a shared one; a track that coasts is not measured
L   lasting error of the outline of a blob of its own. Of the blob's area A a part may be missing or added at one end:
    what the majority in the detector's window decides (`_PATCH`), and a share of the extent, by shadow and by what
    looks like the road (`_SHARE`). Where the border of the picture cuts the box, what is outside may lie to one side
    (`_BESIDE`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.output.sink import Step
from vidtrack.tracking.picture.border import Border
from vidtrack.tracks import Tracks

_PIXEL = 0.45
"""Processed pixels; standard deviation of a centroid from picture to picture."""
_PATCH = 7 * 7 / 4
"""Processed pixels. Ends that fill less than half of the detector's window of 7 x 7 are lost: from none to half of it.
The mean is the same at both ends; the rest, uniform within a quarter of the window, moves the centroid by its share of
the area times the standard deviation of the extent."""
_SHARE = 0.05
"""Standard deviation of a centroid per standard deviation of the extent."""
_BESIDE = 0.1
"""Standard deviation, per side of a cut box, of the middle along the border."""
_EDGE_SHARE, _EDGE_PIXEL = 0.085, 0.85
"""Standard deviation of the middle between two edges of a shared blob: shares of the vehicle's side, and pixels."""


def stated(step: Step) -> Step:
    """The step with covariances as they are stated, in pixels of the scene; as it is where blobs have no outlines."""
    if not step.scan.rim or not len(step.tracks):
        return step
    return replace(step, tracks=_restated(step))


def _restated(step: Step) -> Tracks:
    tracks = step.tracks
    pixel, rim = step.scan.pixel, step.scan.rim
    place = list(tracks.position)
    P = tracks.P[:, place][:, :, place]
    shared, own = tracks.group >= 0, tracks.measurement >= 0
    side = np.maximum(tracks.box[:, 2:] - 2 * rim, 2 * pixel)
    edges = (_EDGE_SHARE * side) ** 2 + (_EDGE_PIXEL * pixel) ** 2
    measured = np.where(shared[:, None], 1 / edges, np.where(own[:, None], (_PIXEL * pixel) ** -2, 0.0))
    lasting = np.where(shared[:, None], 0.0, _outline(side, pixel) + _beside(step, side))
    cov = np.linalg.inv(np.linalg.inv(P) + _diagonal(measured)) + _diagonal(lasting)
    return replace(tracks, P=_with_position(tracks.P, place, cov))


def _outline(side: Floats, pixel: float) -> Floats:
    """(T, 2) variances of the middles of boxes with these sides (T, 2), whose outlines are wrong for long."""
    patch = _PATCH * pixel**2 / side.prod(axis=1)
    return side**2 / 12 * (patch**2 + _SHARE**2)[:, None]


def _beside(step: Step, side: Floats) -> Floats:
    """(T, 2) variances along the border of the picture, where it cuts boxes."""
    cut = Border().of(step.scan).sides(step.tracks.box)
    return (_BESIDE * side) ** 2 * np.column_stack([cut[:, 1] | cut[:, 3], cut[:, 0] | cut[:, 2]])


def _diagonal(values: Floats) -> Floats:
    return values[:, :, None] * np.eye(values.shape[1])


def _with_position(P: Floats, place: list[int], cov: Floats) -> Floats:
    """P (T, n, n) with the covariances cov (T, d, d) of the positions, which are the columns `place`.

    Velocities keep their covariance, and their correlations with the whitened positions: the whole stays a covariance.
    """
    turn = np.broadcast_to(np.eye(P.shape[1]), P.shape).copy()
    old = np.linalg.cholesky(P[:, place][:, :, place])
    turn[:, np.array(place)[:, None], place] = np.linalg.cholesky(cov) @ np.linalg.inv(old)
    return turn @ P @ np.swapaxes(turn, 1, 2)
