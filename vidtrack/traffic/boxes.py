"""What of a box in the picture is its vehicle's: without its rim, uncut by the border, and not hidden by others."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats, Mask
from vidtrack.compiled import kernel

_LEAST_PX = 1.0
"""px; sides of boxes, however wide their rims are"""
_NEAR = 0.01
"""Share of the picture's width; edges nearer to the border may be cut by it"""
_APART_PX = 3.0
"""px; boxes that are farther apart hide nothing of each other"""


def within(box: Floats, rim: Floats | float) -> Floats:
    """(N, 4) the boxes (left, top, width, height) without rims (N,) px on each side."""
    rim = np.broadcast_to(rim, len(box))[:, None]
    return np.hstack([box[:, :2] + rim, np.maximum(box[:, 2:] - 2 * rim, _LEAST_PX)])


def uncut(edge: Floats, size: tuple[int, int]) -> Floats:
    """(N, 4) left, top, right and lower edges [px]; NaN where the border of a picture (width, height) may cut them."""
    inside = edge.copy()
    _cut_off(inside, _NEAR * size[0], size[0] - _NEAR * size[0], size[1] - _NEAR * size[0])
    return inside


def cut(box: Floats, size: tuple[int, int]) -> Mask:
    """(N,) whether the left, right or lower border of a picture (width, height) cuts boxes (N, 4)."""
    (left, top, wide, high), (width, height) = box.T, size
    return np.asarray((left < 0.5) | (left + wide > width - 0.5) | (top + high > height - 0.5))


@kernel
def _cut_off(edge: Floats, near: float, right: float, bottom: float) -> None:
    """Forget left and top edges up to `near`, and right and lower ones from `right` and `bottom` on."""
    for i in range(len(edge)):
        for side in range(2):
            if not edge[i, side] > near:
                edge[i, side] = np.nan
        if not edge[i, 2] < right:
            edge[i, 2] = np.nan
        if not edge[i, 3] < bottom:
            edge[i, 3] = np.nan


def partly_hidden(t: Floats, box: Floats, merged: Mask) -> Mask:
    """(N,) whether the box of a row may not be that of its whole vehicle, and of it alone.

    It shares its blob, merged (N,), or touches a box of the same time t (N,) that reaches farther down in the picture:
    that vehicle is nearer to the camera and may hide a part of this one. Rows are in order of time.

    box (N, 4) left, top, width, height [px]
    """
    hidden = merged.copy()
    _hide(t, box, hidden)
    return hidden


@kernel
def _hide(t: Floats, box: Floats, hidden: Mask) -> None:
    """Mark rows whose boxes (N, 4) touch one of the same time with a lower edge farther down."""
    for i in range(len(t)):
        left, top, right, bottom = box[i, 0], box[i, 1], box[i, 0] + box[i, 2], box[i, 1] + box[i, 3]
        j = i - 1
        while j >= 0 and t[j] == t[i]:
            if (
                left < box[j, 0] + box[j, 2] + _APART_PX
                and box[j, 0] < right + _APART_PX
                and top < box[j, 1] + box[j, 3] + _APART_PX
                and box[j, 1] < bottom + _APART_PX
            ):
                hidden[i] |= box[j, 1] + box[j, 3] > bottom
                hidden[j] |= bottom > box[j, 1] + box[j, 3]
            j -= 1
