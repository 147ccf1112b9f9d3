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
    return _inside(edge, _NEAR * size[0], size[0] - _NEAR * size[0], size[1] - _NEAR * size[0])


def cut(box: Floats, size: tuple[int, int]) -> Mask:
    """(N,) whether the left, right or lower border of a picture (width, height) cuts boxes (N, 4)."""
    return ~np.isnan(cut_ones(box, size)[:, 0])


def cut_ones(box: Floats, size: tuple[int, int]) -> Floats:
    """(N, 4) the boxes that the left, right or lower border of a picture (width, height) cuts; NaN of others."""
    return _at_border(box, 0.5, size[0] - 0.5, size[1] - 0.5)


@kernel
def _inside(edge: Floats, near: float, right: float, bottom: float) -> Floats:
    """The edges without left and top ones up to `near`, and without right and lower ones from `right` and `bottom`."""
    inside = np.empty((len(edge), 4))
    for i in range(len(edge)):
        for side in range(2):
            inside[i, side] = edge[i, side] if edge[i, side] > near else np.nan
        inside[i, 2] = edge[i, 2] if edge[i, 2] < right else np.nan
        inside[i, 3] = edge[i, 3] if edge[i, 3] < bottom else np.nan
    return inside


@kernel
def _at_border(box: Floats, left: float, right: float, bottom: float) -> Floats:
    """The boxes that reach beyond `left`, `right` or `bottom`; NaN of others."""
    cut = np.empty((len(box), 4))
    for i in range(len(box)):
        beside = box[i, 0] < left or box[i, 0] + box[i, 2] > right
        beyond = beside or box[i, 1] + box[i, 3] > bottom
        for side in range(4):
            cut[i, side] = box[i, side] if beyond else np.nan
    return cut


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
