"""The errors that tables state of vehicles in the picture: other ones than the filter calculates with.

The filter takes the lasting errors of blobs for larger independent ones (`estimate.noise`). That is right for what it
learns from many pictures, and keeps its gates wide. But a position is then too uncertain while a blob shows the
vehicle, and too certain where the blob differs from it for long. With P of the filter a table states

    P' = (P^-1 + W^-1)^-1 + L

W   error of this picture's measurement that does not last: `_PIXEL` for a blob of the vehicle's own, the edges' error
    for a shared one; a track that coasts is not measured
L   what lasts, and what this picture contradicts:

    outline  of the blob's area a part may be missing or added at one end: what the majority in the detector's window
             decides about (`_PATCH`), and a share of the extent (`_SHARE`), by shadow and by what looks like the road.
             The share is larger for larger vehicles, which are higher: their shadows reach farther
    border   where the border of the picture cuts the box, what is outside may lie to one side (`_BESIDE`). Across the
             border the centroid is not the middle of what is seen, and is off by the difference at least
    blob     a blob of another size than the vehicle lacks the difference at one end, or has too much there; and where
             its middle is not that of the vehicle's box, the truth may be anywhere between: uniform errors. A shared
             blob that is smaller than the vehicle lacks the difference at one end
    middle   a body seen at a slant does not fill its box evenly, and a shared blob's centroid is not the vehicle's:
             where that is in the box is remembered, also while the box grows. That the middle of the box is the truth
             is as likely as that the centroid is
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from vidtrack.arrays.types import Floats, Mask
from vidtrack.output.sink import HALF_PX, Step
from vidtrack.tracking.picture.border import Border

_PIXEL = 0.15
"""Processed pixels; standard deviation of a centroid from picture to picture."""
_PATCH = 15.0
"""Processed pixels. Ends that fill less than half of the detector's window of 7 x 7 are lost: from none to half of it.
The mean is the same at both ends; the rest moves the centroid by its share of the area times the standard deviation of
the extent."""
_SHARE, _SIZE, _MOST = 0.04, 22.0, 2.0
"""Standard deviation of a centroid per standard deviation of the extent, for vehicles of this size (root of the area,
processed pixels); in proportion for others, up to so many times as much."""
_BESIDE = 0.13
"""Standard deviation, per side of a cut box, of the middle along the border."""
_EDGE_SHARE, _EDGE_PIXEL = 0.05, 0.6
"""Standard deviation of the middle between two edges of a shared blob: shares of the vehicle's side, and pixels."""
_UNIFORM = 1 / 12
"""Variance of what is uniform over an interval of one."""
_EITHER = 1 / 2
"""Mean square of what is nought or one, either as likely."""


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
    whole, box, xy, group, measurement = (
        np.concatenate([getattr(step.tracks, name) for step in steps])
        for name in ("P", "box", "xy", "group", "measurement")
    )
    P = whole[:, place][:, :, place]
    shared, own = group >= 0, measurement >= 0
    side = np.maximum(box[:, 2:] - 2 * scan.rim, 2 * pixel)
    edges = (_EDGE_SHARE * side) ** 2 + (_EDGE_PIXEL * pixel) ** 2
    measured = np.where(shared[:, None], 1 / edges, np.where(own[:, None], (_PIXEL * pixel) ** -2, 0.0))
    differs, lacks = (np.concatenate(parts) for parts in zip(*map(_contradicted, steps), strict=True))
    cut, off = Border().of(scan).sides(box), np.square(box[:, :2] + box[:, 2:] / 2 - HALF_PX - xy)
    lasting = _outline(side, pixel) + np.where(shared[:, None], lacks, differs + _beside(cut, side)) + _EITHER * off
    eye = np.eye(len(place))
    updated = np.linalg.solve(eye + P * measured[:, None, :], P)  # (P^-1 + W^-1)^-1, for a singular P too
    updated = (updated + np.swapaxes(updated, 1, 2)) / 2
    cov = updated + _diagonal(lasting)
    cov += _diagonal(np.maximum(off * (cut[:, :2] | cut[:, 2:]) - np.einsum("tii->ti", cov), 0.0))
    return _with_position(whole, place, cov, pixel)


def _outline(side: Floats, pixel: float) -> Floats:
    """(T, 2) variances of the middles of boxes with these sides (T, 2), whose outlines are wrong for long."""
    area = side.prod(axis=1) / pixel**2
    share = _SHARE * np.minimum(np.sqrt(area) / _SIZE, _MOST)
    return side**2 * (_UNIFORM * ((_PATCH / area) ** 2 + share**2))[:, None]


def _contradicted(step: Step) -> tuple[Floats, Floats]:
    """(T, 2) variances by the boxes of measurements: with a blob of its own, and with a shared one."""
    tracks, scan = step.tracks, step.scan
    seen = tracks.measurement >= 0
    if scan.box is None or not seen.any():
        return np.zeros((len(tracks), 2)), np.zeros((len(tracks), 2))
    taken = np.maximum(tracks.measurement, 0)
    blob = scan.box[taken]
    more = np.where(seen[:, None], blob[:, 2:] - tracks.box[:, 2:], 0.0)
    middle = scan.z[taken, :2] + blob[:, :2] + blob[:, 2:] / 2
    off = np.where(seen[:, None], middle - tracks.box[:, :2] - tracks.box[:, 2:] / 2, 0.0)
    return _UNIFORM * (more**2 + off**2), np.minimum(more, 0.0) ** 2 / 4


def _beside(cut: Mask, side: Floats) -> Floats:
    """(T, 2) variances along the border of the picture, which cuts these sides (T, 4) of boxes."""
    return (_BESIDE * side) ** 2 * np.column_stack([cut[:, 1] | cut[:, 3], cut[:, 0] | cut[:, 2]])


def _diagonal(values: Floats) -> Floats:
    return values[:, :, None] * np.eye(values.shape[1])


def _with_position(P: Floats, place: list[int], cov: Floats, pixel: float) -> Floats:
    """P (T, n, n) with the covariances cov (T, d, d) of the positions, which are the columns `place`.

    Velocities keep their covariance, and their correlations with the whitened positions: the whole stays a covariance.
    A filter's error below a millionth of a pixel counts as that.
    """
    turn = np.broadcast_to(np.eye(P.shape[1]), P.shape).copy()
    old = np.linalg.cholesky(P[:, place][:, :, place] + (1e-6 * pixel) ** 2 * np.eye(len(place)))
    turn[:, np.array(place)[:, None], place] = np.linalg.cholesky(cov) @ np.linalg.inv(old)
    whole = turn @ P @ np.swapaxes(turn, 1, 2)
    whole[:, np.array(place)[:, None], place] = cov
    return np.asarray(whole)
