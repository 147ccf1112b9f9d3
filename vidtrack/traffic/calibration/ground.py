"""The road plane: from the picture to metres and back, with the errors of the calibration."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.traffic.calibration.homography import Normal, by_k, by_point, depth, matrix, picture_of, plane_of
from vidtrack.traffic.calibration.hull import within
from vidtrack.traffic.calibration.lens import Lens
from vidtrack.traffic.calibration.pose import Pose, pose_of

_EDGE = 3.0
"""Standard deviations of a calibration point by which the hull is widened: so well are its corners known."""


@dataclass(frozen=True, slots=True)
class Ground:
    """A calibrated picture. Positions are in metres, x east, y north.

    plane, picture   normalised coordinates of the homography, metres and undistorted pixels
    k, cov           (8,), (8, 8) the homography and its covariance, which all positions share; (9, 9) with k1 of a
                     lens that was fitted with it
    lens             None: straight lines are straight
    center           (2,) where the optical axis meets the picture [px]
    focal_px         None: from the homography
    hull             (M, 3) of the calibration's points, in undistorted pixels
    sigma_px         standard deviation of those points
    """

    plane: Normal
    picture: Normal
    k: Floats
    cov: Floats
    lens: Lens | None
    center: Floats
    focal_px: float | None
    hull: Floats
    sigma_px: float

    def straight(self, xy: Floats) -> Floats:
        """(N, 2) picture points without the lens's distortion [px]."""
        return xy if self.lens is None else self.lens.straight(xy)

    def inside(self, xy: Floats) -> Floats:
        """(N, 2) picture points; NaN where the calibration says nothing, outside the hull of its points."""
        return np.where(within(self.hull, self.straight(xy), _EDGE * self.sigma_px)[:, None], xy, np.nan)

    def metres(self, xy: Floats) -> Floats:
        """(N, 2) positions on the road of picture points (N, 2); NaN above the horizon."""
        return self.plane.back(plane_of(self.k, self.picture.into(self.straight(xy))))

    def pixels(self, xy_m: Floats) -> Floats:
        """(N, 2) picture points of positions on the road (N, 2)."""
        xy = self.picture.back(picture_of(self.k, self.plane.into(xy_m)))
        return xy if self.lens is None else self.lens.bent(xy)

    def px_per_m(self, xy_m: Floats) -> Floats:
        """(N, 2, 2) derivative of `pixels`."""
        J = self.straight_px_per_m(xy_m)
        if self.lens is None:
            return J
        straight = self.picture.back(picture_of(self.k, self.plane.into(xy_m)))
        return self.lens.jacobian(straight) @ J

    def straight_px_per_m(self, xy_m: Floats) -> Floats:
        """(N, 2, 2) derivative of the undistorted picture points of positions on the road."""
        return by_point(self.k, self.plane.into(xy_m)) * (self.picture.scale / self.plane.scale)

    def depth(self, xy_m: Floats) -> Floats:
        """(N,) w of positions on the road, in proportion to their distance from the camera along its axis."""
        return depth(self.k, self.plane.into(xy_m))

    @property
    def receding(self) -> Floats:
        """(2,) the gradient of w [1/m]."""
        return np.asarray(self.k[6:] / self.plane.scale)

    @property
    def homography(self) -> Floats:
        """(3, 3) from metres to homogeneous undistorted picture points [px]."""
        moved = np.eye(3)
        moved[:2, 2] = -self.plane.origin
        return np.asarray(self.about_origin @ moved)

    def pose(self) -> Pose | None:
        """The camera; None where its focal length cannot be told from the homography."""
        return pose_of(self._from_plane(), self.plane.scale, self.center, self.focal_px)

    def _from_plane(self) -> Floats:
        """(3, 3) from the normalised plane to homogeneous undistorted picture points [px]."""
        view = np.diag([self.picture.scale, self.picture.scale, 1.0])
        view[:2, 2] = self.picture.origin
        return np.asarray(view @ matrix(self.k))

    def by_own_error(self, xy_m: Floats) -> Floats:
        """(N, 2, 2) derivative of positions with respect to their picture points [m/px]."""
        (a, b), (c, d) = self.px_per_m(xy_m).transpose(1, 2, 0)
        return np.stack([d, -b, -c, a], axis=1).reshape(-1, 2, 2) / (a * d - b * c)[:, None, None]

    def by_shared_error(self, xy_m: Floats) -> Floats:
        """(N, 2, E) derivative of positions, at fixed picture points, with respect to E independent errors of unit
        variance that the calibration makes: with D of two positions, their covariance is D1 D2'.
        """
        X, errors = self.plane.into(xy_m), self._errors()
        (a, b), (c, d) = by_point(self.k, X).transpose(1, 2, 0)[..., None]
        across, down = self._by_parameters(X).transpose(1, 0, 2)
        # picture_of(k, X) less the straightened point stays 0
        moved = np.stack([d * across - b * down, a * down - c * across], axis=1) / (a * d - b * c)[:, None]
        count = len(errors)
        return np.asarray(-self.plane.scale * (moved.reshape(-1, count) @ errors).reshape(-1, 2, count))

    def varied(self) -> Iterator[tuple[Ground, Ground]]:
        """Pairs of calibrations, each pair one of those errors above and below this one."""
        for error in self._errors().T:
            yield self._off_by(error), self._off_by(-error)

    @property
    def homography_cov(self) -> Floats:
        """(8, 8), or (9, 9) with k1, covariance of the first eight elements of `about_origin`, row by row."""
        J = np.eye(len(self.cov))
        J[:8, :8] = np.column_stack(
            [self._about_origin(matrix(e) - matrix(np.zeros(8))).ravel()[:8] for e in np.eye(8)]
        )
        return J @ self.cov @ J.T

    @property
    def about_origin(self) -> Floats:
        """(3, 3) from metres, less the origin of `plane`, to homogeneous undistorted picture points [px]; the last
        element is 1."""
        return self._about_origin(matrix(self.k))

    def _about_origin(self, normalised: Floats) -> Floats:
        view = np.diag([self.picture.scale, self.picture.scale, 1.0])
        view[:2, 2] = self.picture.origin
        return np.asarray(view @ normalised @ np.diag([1 / self.plane.scale, 1 / self.plane.scale, 1.0]))

    def _by_parameters(self, X: Floats) -> Floats:
        """(N, 2, E) derivative of the picture of X less the straightened point, in normalised coordinates."""
        by_homography = by_k(self.k, X)
        if self.lens is None or len(self.cov) == len(self.k):
            return by_homography
        straight = self.picture.back(picture_of(self.k, X))
        return np.concatenate(
            [by_homography, -self.lens.straightening(straight)[:, :, None] / self.picture.scale], axis=2
        )

    def _off_by(self, error: Floats) -> Ground:
        """The calibration with an error (E,) of its numbers."""
        lens = self.lens
        if lens is not None and len(error) > len(self.k):
            lens = replace(lens, k1=lens.k1 + float(error[-1]))
        return replace(self, k=self.k + error[: len(self.k)], lens=lens)

    def _errors(self) -> Floats:
        """(E, E) a square root of the covariance."""
        variance, direction = np.linalg.eigh(self.cov)
        return np.asarray(direction * np.sqrt(np.maximum(variance, 0)))
