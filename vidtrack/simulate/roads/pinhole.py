"""A pinhole camera with a radial lens above the plane of the road."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vidtrack.arrays.types import Floats, Mask

NEAR_M = 0.5  # what is nearer to the camera's plane than this is not drawn
_NEWTON_STEPS = 12


@dataclass(frozen=True, slots=True, eq=False)
class Pinhole:
    """A camera. Pictures are continuous: the upper left corner is (0, 0), pixel k covers k..k+1.

    position  (3,) m
    axes      (3, 3) unit vectors right, down and forward, in rows
    focal     px
    centre    (2,) px; where the optical axis meets the picture
    k1        of Brown-Conrady on normalised coordinates: x (1 + k1 r^2)
    """

    position: Floats
    axes: Floats
    focal: float
    centre: Floats
    k1: float = 0.0

    def project(self, points: Floats) -> tuple[Floats, Floats]:
        """Points (..., 3) in the picture (..., 2) px, and their depths (...) m; right for depths above zero."""
        local = (points - self.position) @ self.axes.T
        depth = local[..., 2]
        ideal = local[..., :2] / np.maximum(depth, 1e-6)[..., None]
        return self.centre + self.focal * self._bent(ideal), depth

    def on_ground(self, xy: Floats) -> Floats:
        """Where the rays of picture points (..., 2) px meet the road, (..., 2) m; NaN from the horizon upwards."""
        ideal = self._straight((xy - self.centre) / self.focal)
        rays = np.concatenate([ideal, np.ones((*ideal.shape[:-1], 1))], axis=-1) @ self.axes
        falls = np.where(rays[..., 2] < -1e-9, -rays[..., 2], np.nan)
        return np.asarray(self.position[:2] + rays[..., :2] * (self.position[2] / falls)[..., None])

    def shows(self, ground: Floats, size: tuple[int, int]) -> Mask:
        """Which points (V, 2) m of the road lie in a picture of `size` (width, height)."""
        xy, depth = self.project(np.column_stack([ground, np.zeros(len(ground))]))
        return np.asarray((depth > 0) & (xy >= 0).all(axis=1) & (xy <= size).all(axis=1))

    def shifted(self, offset: Floats) -> Pinhole:
        """The same view with the picture moved by `offset` (2,) px."""
        return replace(self, centre=self.centre + offset)

    def px_per_m(self, points: Floats) -> Floats:
        """How large a metre appears at points (..., 3)."""
        return np.asarray(self.focal / np.maximum((points - self.position) @ self.axes[2], NEAR_M))

    def _bent(self, ideal: Floats) -> Floats:
        """Normalised coordinates (..., 2) after the lens; beyond its turning point a barrel lens stays at its rim."""
        if self.k1 == 0:
            return ideal
        r = np.maximum(np.linalg.norm(ideal, axis=-1, keepdims=True), 1e-12)
        inner = np.minimum(r, np.sqrt(-1 / (3 * self.k1))) if self.k1 < 0 else r
        return np.asarray(ideal / r * inner * (1 + self.k1 * inner**2))

    def _straight(self, bent: Floats) -> Floats:
        """Normalised coordinates (..., 2) before the lens, by Newton's method along the radius."""
        if self.k1 == 0:
            return bent
        goal = np.maximum(np.linalg.norm(bent, axis=-1, keepdims=True), 1e-12)
        r = goal.copy()
        for _ in range(_NEWTON_STEPS):
            r -= (r + self.k1 * r**3 - goal) / (1 + 3 * self.k1 * r**2)
        return np.asarray(bent / goal * r)


def pinhole(
    aim: tuple[float, float], azimuth: float, tilt: float, height: float, size: tuple[int, int], view: float, k1: float
) -> Pinhole:
    """A camera `height` m above the road whose axis meets the road in `aim` (m).

    azimuth  rad; of the axis, from east to north
    tilt     rad; of the axis below the horizon
    view     rad; from the left to the right edge of the picture
    """
    ahead = np.array([np.cos(azimuth), np.sin(azimuth)])
    forward = np.array([*(np.cos(tilt) * ahead), -np.sin(tilt)])
    right = np.array([ahead[1], -ahead[0], 0.0])
    position = np.array([*(aim - height / np.tan(tilt) * ahead), height])
    axes = np.stack([right, np.cross(forward, right), forward])
    return Pinhole(position, axes, size[0] / 2 / np.tan(view / 2), np.array(size) / 2, k1)
