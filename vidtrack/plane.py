"""Maps of the plane, (2, 3) matrices: how the scene, the picture and a detector's canvas lie on each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vidtrack.scan import Floats, Scan, Tracks

IDENTITY: Floats = np.eye(2, 3)


def after(second: Floats, first: Floats) -> Floats:
    """The map that does `first`, then `second`."""
    return np.hstack([second[:, :2] @ first[:, :2], second[:, :2] @ first[:, 2:] + second[:, 2:]])


def inverse(plane: Floats) -> Floats:
    """The map back."""
    back = np.linalg.inv(plane[:, :2])
    return np.hstack([back, -back @ plane[:, 2:]])


def shift(x: float, y: float) -> Floats:
    """A displacement."""
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y]])


def rescaled(plane: Floats, factor: float) -> Floats:
    """The same map where each pixel is replaced by factor x factor smaller ones; pixels are unit squares."""
    offset = (factor - 1) / 2
    moved = factor * plane[:, 2] + offset - plane[:, :2] @ np.full(2, offset)
    return np.hstack([plane[:, :2], moved[:, None]])


def points(plane: Floats, xy: Floats) -> Floats:
    """(N, 2) where points go."""
    return xy @ plane[:, :2].T + plane[:, 2]


def boxes(plane: Floats, box: Floats) -> Floats:
    """(N, 4) boxes left, top, width, height: their centres are moved, their sides scaled and never turned."""
    size = box[:, 2:] * scale(plane)
    centre = points(plane, box[:, :2] + (box[:, 2:] - 1) / 2)  # a box covers whole pixels around their centres
    return np.hstack([centre - (size - 1) / 2, size])


def scale(plane: Floats) -> float:
    """By how much lengths grow."""
    return float(np.sqrt(abs(np.linalg.det(plane[:, :2]))))


def corners(width: float, height: float) -> Floats:
    """(4, 2) centres of the corner pixels of a picture."""
    return np.array([[0.0, 0.0], [width - 1, 0.0], [0.0, height - 1], [width - 1, height - 1]])


def displacement(plane: Floats, width: float, height: float, since: Floats = IDENTITY) -> float:
    """px; how far the map moves that corner of a picture which it moves most, compared with another map."""
    xy = corners(width, height)
    return float(np.linalg.norm(points(plane, xy) - points(since, xy), axis=1).max())


def moved(tracks: Tracks, plane: Floats | None) -> Tracks:
    """The tracks as the map shows them; None is the identity."""
    if plane is None:
        return tracks
    x, turn = tracks.x.copy(), np.eye(tracks.x.shape[1])
    for columns in (list(tracks.position), list(tracks.velocity)):
        turn[np.ix_(columns, columns)] = plane[:, :2]
    x = x @ turn.T
    x[:, list(tracks.position)] += plane[:, 2]
    return replace(tracks, x=x, P=turn @ tracks.P @ turn.T, box=boxes(plane, tracks.box))


def seen(scan: Scan, plane: Floats) -> Scan:
    """The measurements of positions as the map shows them."""
    z = points(plane, scan.z)
    box = scan.box
    if box is not None:
        box = boxes(plane, np.hstack([scan.z + box[:, :2], box[:, 2:]]))
        box[:, :2] -= z
    return replace(scan, z=z, R=plane[:, :2] @ scan.R @ plane[:, :2].T, box=box, lasting=None, surveyed=None)
