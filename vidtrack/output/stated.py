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

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.output.sink import Step
from vidtrack.scan import Scan
from vidtrack.tracking.picture.border import Border

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
    return all_stated([step])[0]


def all_stated(steps: Sequence[Step]) -> list[Step]:
    """Each step as it is stated; those whose scans are alike are calculated together."""
    done: list[Step] = []
    for outlined, alike in groupby(steps, _outlines):
        some = list(alike)
        if outlined is None:
            done += some
            continue
        ends = np.cumsum([len(step.tracks) for step in some])
        for step, P in zip(some, np.split(_restated(some), ends[:-1]), strict=True):
            done.append(replace(step, tracks=replace(step.tracks, P=P)))
    return done


def _outlines(step: Step) -> tuple[float, ...] | None:
    """What the stated errors depend on besides the tracks; None where blobs have no outlines."""
    scan = step.scan
    if not scan.rim or not len(step.tracks):
        return None
    return (scan.rim, scan.pixel, *(() if scan.surveyed is None else scan.surveyed.tolist()))


def _restated(steps: Sequence[Step]) -> Floats:
    """(N, n, n) stated covariances of the tracks of steps with scans that are alike."""
    scan, place = steps[0].scan, list(steps[0].tracks.position)
    pixel = scan.pixel
    whole, box, group, measurement = (
        np.concatenate([getattr(step.tracks, name) for step in steps]) for name in ("P", "box", "group", "measurement")
    )
    P = whole[:, place][:, :, place]
    shared, own = group >= 0, measurement >= 0
    side = np.maximum(box[:, 2:] - 2 * scan.rim, 2 * pixel)
    edges = (_EDGE_SHARE * side) ** 2 + (_EDGE_PIXEL * pixel) ** 2
    measured = np.where(shared[:, None], 1 / edges, np.where(own[:, None], (_PIXEL * pixel) ** -2, 0.0))
    lasting = np.where(shared[:, None], 0.0, _outline(side, pixel) + _beside(scan, box, side))
    cov = np.linalg.inv(np.linalg.inv(P) + _diagonal(measured)) + _diagonal(lasting)
    return _with_position(whole, place, cov)


def _outline(side: Floats, pixel: float) -> Floats:
    """(T, 2) variances of the middles of boxes with these sides (T, 2), whose outlines are wrong for long."""
    patch = _PATCH * pixel**2 / side.prod(axis=1)
    return side**2 / 12 * (patch**2 + _SHARE**2)[:, None]


def _beside(scan: Scan, box: Floats, side: Floats) -> Floats:
    """(T, 2) variances along the border of the picture, where it cuts boxes (T, 4)."""
    cut = Border().of(scan).sides(box)
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
