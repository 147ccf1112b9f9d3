"""The homography from a plane to its picture: eight numbers k and their covariance.

    p = (k0 X + k1 Y + k2, k3 X + k4 Y + k5) / w,   w = k6 X + k7 Y + 1

R. Hartley, A. Zisserman, Multiple View Geometry in Computer Vision, 2nd ed., chapters 4 and 5. All coordinates here
are normalised: their origin is the centre of the points, so that w = 1 there, and their scale is that of the points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.compiled import kernel

_REWEIGHTINGS = 4


@dataclass(frozen=True, slots=True)
class Normal:
    """Normalised coordinates: (x - origin) / scale."""

    origin: Floats
    scale: float

    @classmethod
    def of(cls, points: Floats) -> Normal:
        """Those in which the points (N, 2) have mean 0 and a mean square of 2."""
        origin = points.mean(axis=0)
        return cls(origin, float(np.sqrt(np.mean(np.sum((points - origin) ** 2, axis=1)) / 2)))

    def into(self, points: Floats) -> Floats:
        """(N, 2) normalised."""
        return (points - self.origin) / self.scale

    def back(self, points: Floats) -> Floats:
        """(N, 2) in their own units again."""
        return points * self.scale + self.origin


@dataclass(frozen=True, slots=True)
class Fit:
    """k (8,), its covariance (8, 8), and the sum of squares of the weighted residuals (chi-square, 2 N - 8).

    With k1 of the lens the covariance is (9, 9), and chi-square has 2 N - 9 degrees of freedom.
    """

    k: Floats
    cov: Floats
    chi2: float


def depth(k: Floats, X: Floats) -> Floats:
    """(N,) w, in proportion to the distance from the camera along its axis."""
    return np.asarray(k[6] * X[:, 0] + k[7] * X[:, 1] + 1)


def picture_of(k: Floats, X: Floats) -> Floats:
    """(N, 2) where points of the plane X (N, 2) are in the picture."""
    return _mapped(matrix(k), np.ascontiguousarray(X))


def by_point(k: Floats, X: Floats) -> Floats:
    """(N, 2, 2) derivative of `picture_of` with respect to X."""
    p = picture_of(k, X)
    return np.asarray((k[[[0, 1], [3, 4]]] - p[:, :, None] * k[6:]) / depth(k, X)[:, None, None])


def by_k(k: Floats, X: Floats) -> Floats:
    """(N, 2, 8) derivative of `picture_of` with respect to k."""
    p = picture_of(k, X)
    J = np.zeros((len(X), 2, 8))
    J[:, 0, :2] = J[:, 1, 3:5] = X
    J[:, 0, 2] = J[:, 1, 5] = 1
    J[:, :, 6:] = -p[:, :, None] * X[:, None, :]
    return J / depth(k, X)[:, None, None]


def plane_of(k: Floats, p: Floats) -> Floats:
    """(N, 2) where points of the picture p (N, 2) are on the plane; NaN on the horizon and above it."""
    back = np.linalg.inv(matrix(k))
    X = _mapped(back, np.ascontiguousarray(p))
    X[~(back[2, 0] * p[:, 0] + back[2, 1] * p[:, 1] + back[2, 2] > 0)] = np.nan
    return X


@kernel
def _mapped(H: Floats, points: Floats) -> Floats:
    """(N, 2) images of points (N, 2) by a homography (3, 3)."""
    image = np.empty((len(points), 2))
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        w = H[2, 0] * x + H[2, 1] * y + H[2, 2]
        for axis in range(2):
            image[i, axis] = (H[axis, 0] * x + H[axis, 1] * y + H[axis, 2]) / w
    return image


def matrix(k: Floats) -> Floats:
    """(3, 3), from the plane to the picture."""
    return np.append(k, 1.0).reshape(3, 3)


def start(X: Floats, p: Floats) -> Floats:
    """(8,) the direct linear transform: the k that makes w p = ... hold best, without weights."""
    rows = np.zeros((2 * len(X), 9))
    rows[::2, :2] = rows[1::2, 3:5] = X
    rows[::2, 2] = rows[1::2, 5] = 1
    rows[::2, 6:] = -p[:, :1] * np.column_stack([X, np.ones(len(X))])
    rows[1::2, 6:] = -p[:, 1:] * np.column_stack([X, np.ones(len(X))])
    h = np.linalg.svd(rows)[2][-1]
    return np.asarray(h[:8] / h[8])


def fitted(X: Floats, p: Floats, plane_cov: Floats, picture_cov: Floats) -> Fit:
    """Least squares over points on the plane X (N, 2) and in the picture p (N, 2), both with errors.

    plane_cov, picture_cov   (N, 2, 2) covariances. The residual in the picture has picture_cov + J plane_cov J', with
    J from the fit before: over the error of a point the map from the plane to the picture is nearly straight.
    """
    return Fit(
        *reweighted(
            start(X, p),
            lambda k: picture_of(k, X) - p,
            lambda k: by_k(k, X),
            lambda k: whitening(by_point(k, X), plane_cov, picture_cov),
        )
    )


def reweighted(
    theta: Floats,
    off: Callable[[Floats], Floats],
    derivative: Callable[[Floats], Floats],
    weights: Callable[[Floats], Floats],
) -> tuple[Floats, Floats, float]:
    """Least squares from theta (E,): the parameters, their covariance (E, E) and chi-square.

    off, derivative, weights   of theta: residuals (N, 2), their derivatives (N, 2, E), and the inverse square roots
                               (N, 2, 2) of their covariances, which are those of the fit before
    """
    from scipy.optimize import least_squares  # slow to import, and few runs need it

    for _ in range(_REWEIGHTINGS):
        root = weights(theta)
        theta = least_squares(
            lambda theta, root=root: np.einsum("nij,nj->ni", root, off(theta)).ravel(),
            theta,
            jac=lambda theta, root=root: (root @ derivative(theta)).reshape(-1, len(theta)),
            method="lm",
        ).x
    root = weights(theta)
    J = (root @ derivative(theta)).reshape(-1, len(theta))
    residual = np.einsum("nij,nj->ni", root, off(theta))
    return theta, np.asarray(np.linalg.pinv(J.T @ J, hermitian=True)), float(np.sum(residual**2))


def whitening(J: Floats, plane_cov: Floats, picture_cov: Floats) -> Floats:
    """(N, 2, 2) inverse square roots of the residuals' covariances; J (N, 2, 2) from the plane to the picture."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(picture_cov + J @ plane_cov @ np.swapaxes(J, 1, 2))))
