"""The camera behind a homography: its focal length, where up is in the picture, how high it hangs.

The columns of K^-1 H for east and north are at right angles and of one length (Z. Zhang, A flexible new technique for
camera calibration, 2000). With square pixels and a known centre these are two equations for the focal length alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats

_ROUNDING = 1e-9
"""Change of w over the calibration's points, as a share, that is no perspective: a camera that looks straight down"""


@dataclass(frozen=True, slots=True)
class Pose:
    """focal_px; up (3,), what a metre of height adds to the homogeneous picture point; height_m of the camera."""

    focal_px: float
    up: Floats
    height_m: float


def pose_of(H: Floats, scale: float, center: Floats, focal_px: float | None) -> Pose | None:
    """The camera of a homography; None where the focal length cannot be told, as looking straight down.

    H         (3, 3) from the plane, in units of `scale` metres, to the undistorted picture [px]
    center    (2,) where the optical axis meets the picture [px]
    focal_px  None: from the homography
    """
    xy, w = H[:2] - center[:, None] * H[2], H[2]
    focal = _focal(xy, w) if focal_px is None else focal_px
    if focal is None:
        return None
    east, north, origin = np.vstack([xy / focal, w]).T
    unit2 = np.linalg.norm(east) * np.linalg.norm(north)
    up = np.cross(east, north) / np.sqrt(unit2)
    return Pose(focal, np.append(focal * up[:2] + center * up[2], up[2]) / scale, float(-scale * (up @ origin) / unit2))


def _focal(xy: Floats, w: Floats) -> float | None:
    """The f for which (x, y)/f, w of east and north are at right angles and of one length, by least squares."""
    flat = np.array([2 * xy[:, 0] @ xy[:, 1], xy[:, 0] @ xy[:, 0] - xy[:, 1] @ xy[:, 1]])
    deep = np.array([2 * w[0] * w[1], w[0] ** 2 - w[1] ** 2])
    square = -(flat @ deep) / (deep @ deep) if np.hypot(w[0], w[1]) > _ROUNDING * abs(w[2]) else -1.0
    return float(np.sqrt(square)) if square > 0 else None
