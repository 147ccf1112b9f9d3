"""Affine maps of the plane, (2, 3) matrices, between the scene, the picture and a detector's canvas."""

from __future__ import annotations

import math

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.compiled import kernel

IDENTITY: Floats = np.eye(2, 3)


def is_identity(plane: Floats) -> bool:
    """Whether a map moves nothing; IDENTITY itself, which most maps are, needs no look."""
    return plane is IDENTITY or bool((plane == IDENTITY).all())


@kernel
def after(second: Floats, first: Floats) -> Floats:
    """The composition: `first`, then `second`."""
    both = np.empty((2, 3))
    for i in range(2):
        for j in range(3):
            both[i, j] = second[i, 0] * first[0, j] + second[i, 1] * first[1, j]
        both[i, 2] += second[i, 2]
    return both


@kernel
def inverse(plane: Floats) -> Floats:
    """The inverse map."""
    (a, b, x), (c, d, y) = plane
    determinant = a * d - b * c
    back = np.empty((2, 3))
    back[0, 0], back[0, 1], back[0, 2] = d / determinant, -b / determinant, (b * y - d * x) / determinant
    back[1, 0], back[1, 1], back[1, 2] = -c / determinant, a / determinant, (c * x - a * y) / determinant
    return back


def shift(x: float, y: float) -> Floats:
    """The translation by (x, y)."""
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y]])


@kernel
def rescaled(plane: Floats, factor: float) -> Floats:
    """The same map for pixels divided into factor x factor smaller ones; pixels are unit squares."""
    offset = (factor - 1) / 2
    fine = plane.copy()
    for i in range(2):
        fine[i, 2] = factor * plane[i, 2] + offset * (1 - plane[i, 0] - plane[i, 1])
    return fine


def points(plane: Floats, xy: Floats) -> Floats:
    """(N, 2) images of points (N, 2)."""
    return xy @ plane[:, :2].T + plane[:, 2]


@kernel
def boxes(plane: Floats, box: Floats) -> Floats:
    """(N, 4) boxes left, top, width, height: centres are mapped, sides are scaled and stay axis-parallel."""
    moved, factor = np.empty((len(box), 4)), scale(plane)
    for i in range(len(box)):
        x, y = box[i, 0] + (box[i, 2] - 1) / 2, box[i, 1] + (box[i, 3] - 1) / 2  # a box covers whole pixels
        for axis in range(2):
            size = box[i, 2 + axis] * factor
            centre = x * plane[axis, 0] + y * plane[axis, 1] + plane[axis, 2]
            moved[i, axis], moved[i, 2 + axis] = centre - (size - 1) / 2, size
    return moved


@kernel
def scale(plane: Floats) -> float:
    """The scale factor of lengths."""
    return math.sqrt(abs(plane[0, 0] * plane[1, 1] - plane[0, 1] * plane[1, 0]))


def corners(width: float, height: float) -> Floats:
    """(4, 2) centres of the corner pixels of a picture."""
    return np.array([[0.0, 0.0], [width - 1, 0.0], [0.0, height - 1], [width - 1, height - 1]])


@kernel
def displacement(plane: Floats, width: float, height: float, since: Floats) -> float:
    """px; largest displacement of a picture's corner between this map and `since`."""
    off = np.empty((2, 3))
    for i in range(2):
        for j in range(3):
            off[i, j] = plane[i, j] - since[i, j]
    most = 0.0
    for i in range(2):
        for j in range(2):
            x, y = i * (width - 1), j * (height - 1)
            across, down = off[0, 0] * x + off[0, 1] * y + off[0, 2], off[1, 0] * x + off[1, 1] * y + off[1, 2]
            most = max(most, across * across + down * down)
    return np.sqrt(most)
