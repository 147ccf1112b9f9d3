"""From the scene, in which is tracked, to the picture of a camera that moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats
from vidtrack.scan import Scan
from vidtrack.tracks import Tracks


def moved(tracks: Tracks, to_picture: Floats | None) -> Tracks:
    """The tracks as the picture shows them; to_picture (2, 3), None: they lie on it."""
    if to_picture is None:
        return tracks
    x, turn = tracks.x.copy(), np.eye(tracks.x.shape[1])
    for columns in (list(tracks.position), list(tracks.velocity)):
        turn[np.ix_(columns, columns)] = to_picture[:, :2]
    x = x @ turn.T
    x[:, list(tracks.position)] += to_picture[:, 2]
    return replace(tracks, x=x, P=turn @ tracks.P @ turn.T, box=affine.boxes(to_picture, tracks.box))


def seen(scan: Scan, to_picture: Floats) -> Scan:
    """The measurements of positions as the picture shows them."""
    z = affine.points(to_picture, scan.z)
    box = scan.box
    if box is not None:
        box = affine.boxes(to_picture, np.hstack([scan.z + box[:, :2], box[:, 2:]]))
        box[:, :2] -= z
    return replace(scan, z=z, R=to_picture[:, :2] @ scan.R @ to_picture[:, :2].T, box=box, lasting=None, surveyed=None)
