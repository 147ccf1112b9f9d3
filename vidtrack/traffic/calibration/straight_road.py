"""A calibration without a map: a straight road seen by its edges, and known lengths on it.

Lines that are parallel on the road meet in one point of the picture. Those along the road and those across it, and
lengths on it, give the camera's pitch, yaw, roll, focal length and height (R. Cipolla, T. Drummond, D. Robertson,
Camera calibration from vanishing points in images of architectural scenes, 1999). On the road y goes along it, away
from the camera, and x to the right; the origin is under the camera. Without segments across, the camera is level: its
roll is zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.special import chdtri

from vidtrack.arrays.types import Floats, Mask
from vidtrack.errors import ConfigError
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.calibration.homography import Normal
from vidtrack.traffic.calibration.hull import hull
from vidtrack.traffic.calibration.lens import Lens, lens_of
from vidtrack.traffic.site import Site

_FALSE_ALARM = 0.01
_STARTS = (0.6, 1.0, 1.8, 3.0, 6.0)
"""Focal lengths in widths of the picture from which the fit starts; the best result counts."""
_ROUNDS = 3
_MOST_SIGMA = 0.5
"""Largest standard deviation of the logarithms of focal length and height that is of any use."""
_LEVEL = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
"""From the road (right, along, up) to a level camera that looks along it (right, down, forward)."""


@dataclass(frozen=True, slots=True)
class Segments:
    """Segments in the picture without distortion, relative to its centre [px].

    along, across   (N, 2, 2) ends of those parallel to the road, and of those square to it
    known, metres   (N, 2, 2), (N,) ends of those whose length is known, and the length
    """

    along: Floats
    across: Floats
    known: Floats
    metres: Floats

    @property
    def ends(self) -> Floats:
        """(N, 2) of all."""
        return np.concatenate([self.along, self.across, self.known]).reshape(-1, 2)


@dataclass(frozen=True, slots=True)
class RoadFit:
    """The road plane; the weighted sum of squares and its degrees of freedom; whether that is more than chance."""

    ground: Ground
    chi2: float
    spare: int
    contradiction: bool

    def doubts(self) -> list[str]:
        """What the user should know about the calibration, in words."""
        if self.spare == 0:
            return ["these segments leave nothing to check the calibration with; give more of them"]
        if self.contradiction:
            return [
                "the segments of the calibration do not agree within their standard deviations (chi-square "
                f"{self.chi2:.1f} with {self.spare} degrees of freedom); errors are given larger by as much"
            ]
        return []


def straight_road(site: Site) -> RoadFit:
    """The road plane from segments. Raises ConfigError where they do not determine it."""
    calibration, center = site.calibration, np.array(site.center)
    assert calibration is not None
    stated = lens_of(site)
    lens = stated if stated.bends else None
    segments = _segments(site, lens)
    free = np.array([True, True, bool(calibration.across), calibration.focal_px is None, True])
    focals = [calibration.focal_px or site.camera.width * share for share in _STARTS[: None if free[3] else 1]]
    starts = [_start(segments, focal) for focal in focals]
    sigmas = calibration.sigma_picture_px, calibration.sigma_ground_m
    try:
        fits = [_fitted(start, free, segments, *sigmas) for start in starts]
    except np.linalg.LinAlgError:  # the camera went down to the road
        raise ConfigError(
            "calibration: no camera above the road sees these segments: parallel ones meet in the distance, at the "
            "horizon above them; check directions, across and lengths"
        ) from None
    theta, cov, chi2, spare = min(fits, key=lambda fit: fit[2])
    if not (np.isfinite(cov).all() and np.sqrt(cov[3, 3]) < _MOST_SIGMA and np.sqrt(cov[4, 4]) < _MOST_SIGMA):
        raise ConfigError(
            "calibration: these segments do not tell the focal length and the height of the camera; give focal_px, "
            "or lengths both along the road and across it"
        )
    ends = segments.ends
    plane, view = Normal.of(_road(theta, ends)), Normal.of(ends + center)

    def k(theta: Floats) -> Floats:
        return _normalised(homography(theta), plane, Normal(view.origin - center, view.scale))

    steps = np.diag(1e-4 * np.sqrt(np.diag(cov)) + 1e-9)
    G = np.stack([(k(theta + step) - k(theta - step)) / (2 * step.sum()) for step in steps], axis=1)
    contradiction = bool(spare and chi2 > chdtri(spare, _FALSE_ALARM))
    wider = max(1.0, chi2 / spare) if contradiction else 1.0
    k_cov, focal, sigma = np.asarray(wider * G @ cov @ G.T), float(np.exp(theta[3])), calibration.sigma_picture_px
    ground = Ground(plane, view, k(theta), k_cov, lens, center, focal, hull(ends + center), sigma)
    return RoadFit(ground, chi2, spare, contradiction)


def homography(theta: Floats) -> Floats:
    """(3, 3) from the road [m] to the picture [px from its centre]: theta is pitch, yaw, roll, log f, log height."""
    (sp, sy, sr), (cp, cy, cr) = np.sin(theta[:3]), np.cos(theta[:3])
    focal, height = np.exp(theta[3:])
    yaw = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]])
    pitch = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
    roll = np.array([[cr, -sr, 0], [sr, cr, 0], [0, 0, 1]])
    R = roll @ pitch @ yaw @ _LEVEL
    return np.asarray(np.diag([focal, focal, 1.0]) @ np.column_stack([R[:, 0], R[:, 1], -height * R[:, 2]]))


def _segments(site: Site, lens: Lens | None) -> Segments:
    calibration, center = site.calibration, np.array(site.center)
    assert calibration is not None
    metres = np.array([metres for _, _, metres in calibration.lengths])

    def straight(ends: object) -> Floats:
        points = np.array(ends, float).reshape(-1, 2)
        points = points if lens is None else lens.straight(points)
        return (points - center).reshape(-1, 2, 2)

    known = straight([(first, second) for first, second, _ in calibration.lengths])
    return Segments(straight(calibration.directions), straight(calibration.across), known, metres)


def _start(segments: Segments, focal: float) -> Floats:
    """(5,) from where the segments along the road meet, for a camera without roll; the lengths scale it."""
    first, second = (np.column_stack([segments.along[:, i], np.full(len(segments.along), focal)]) for i in (0, 1))
    lines = np.cross(first, second)
    x, y, z = np.linalg.svd(lines / np.linalg.norm(lines, axis=1)[:, None])[2][-1]
    x, y, z = np.array([x, y, z]) * (1.0 if z >= 0 else -1.0)
    theta = np.array([np.arctan2(-y, np.hypot(x, z)), np.arctan2(-x, z), 0.0, np.log(focal), 0.0])
    ratios = segments.metres / _lengths(theta, segments.known)
    theta[4] = np.log(np.median(ratios)) if np.isfinite(ratios).all() else 0.0
    return theta


def _fitted(
    start: Floats, free: Mask, segments: Segments, sigma_px: float, sigma_m: float
) -> tuple[Floats, Floats, float, int]:
    """(5,) parameters, their covariance (5, 5), chi-square and its degrees of freedom."""
    theta = start.copy()
    for _ in range(_ROUNDS):
        sigma = np.hypot(sigma_m, sigma_px * _length_slope(theta, segments.known))

        def residual(some: Floats, whole: Floats = theta, sigma: Floats = sigma) -> Floats:
            return _residual(_filled(whole, free, some), segments, sigma_px, sigma)

        found = least_squares(residual, theta[free], x_scale="jac")
        theta = _filled(theta, free, found.x)
    singular = np.linalg.svd(found.jac, compute_uv=False)
    cov = np.zeros((5, 5))
    enough = len(found.fun) >= len(found.x) and singular[-1] > 1e-9 * singular[0]
    cov[np.ix_(free, free)] = np.linalg.inv(found.jac.T @ found.jac) if enough else np.inf
    return theta, cov, 2 * float(found.cost), len(found.fun) - len(found.x)


def _filled(theta: Floats, free: Mask, some: Floats) -> Floats:
    whole = theta.copy()
    whole[free] = some
    return whole


def _residual(theta: Floats, segments: Segments, sigma_px: float, sigma: Floats) -> Floats:
    """Over their standard deviations: how far segments point beside where they should, and errors of the lengths."""
    H = homography(theta)
    beside = [
        _beside(ends, toward) / sigma_px for ends, toward in ((segments.along, H[:, 1]), (segments.across, H[:, 0]))
    ]
    return np.concatenate([*beside, (_lengths(theta, segments.known) - segments.metres) / sigma])


def _beside(ends: Floats, toward: Floats) -> Floats:
    """(N,) px; by how much segments miss the vanishing point (3,): the difference of their ends across the way from
    their middle to it, over the root of 2, which has the standard deviation of one end."""
    middle = np.column_stack([ends.mean(axis=1), np.ones(len(ends))])
    normal = np.cross(middle, toward)[:, :2]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return np.asarray(np.sum(normal * (ends[:, 1] - ends[:, 0]), axis=1) / np.sqrt(2))


def _road(theta: Floats, xy: Floats) -> Floats:
    """(N, 2) positions on the road; NaN above the horizon."""
    X = np.column_stack([xy, np.ones(len(xy))]) @ np.linalg.inv(homography(theta)).T
    return np.asarray(X[:, :2] / np.where(X[:, 2:] > 0, X[:, 2:], np.nan))


def _lengths(theta: Floats, ends: Floats) -> Floats:
    """(N,) m; lengths on the road of segments (N, 2, 2), a kilometre where they reach above the horizon."""
    road = _road(theta, ends.reshape(-1, 2)).reshape(-1, 2, 2)
    return np.nan_to_num(np.linalg.norm(road[:, 1] - road[:, 0], axis=1), nan=1e3)


def _length_slope(theta: Floats, ends: Floats) -> Floats:
    """(N,) m/px; standard deviation of lengths on the road for ends that are uncertain by a pixel."""
    shifts = [sign * np.eye(4)[i].reshape(2, 2) for i in range(4) for sign in (0.5, -0.5)]
    found = np.array([_lengths(theta, ends + shift) for shift in shifts])
    return np.asarray(np.linalg.norm(found[::2] - found[1::2], axis=0))


def _normalised(H: Floats, plane: Normal, view: Normal) -> Floats:
    """(8,) the homography between normalised coordinates."""
    onto = np.array([[plane.scale, 0, plane.origin[0]], [0, plane.scale, plane.origin[1]], [0, 0, 1]])
    back = np.array([[1, 0, -view.origin[0]], [0, 1, -view.origin[1]], [0, 0, view.scale]]) / view.scale
    h = (back @ H @ onto).ravel()
    return np.asarray(h[:8] / h[8])
