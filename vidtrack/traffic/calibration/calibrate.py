"""From the points of a site to its road plane, and what the points say about each other."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from vidtrack.arrays.types import Floats
from vidtrack.errors import ConfigError
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.calibration.homography import Fit, Normal, by_k, by_point, depth, fitted, picture_of, plane_of
from vidtrack.traffic.calibration.hull import hull
from vidtrack.traffic.calibration.lens import lens_of
from vidtrack.traffic.calibration.straight_road import straight_road
from vidtrack.traffic.epsg import metric_system
from vidtrack.traffic.site import Calibration, Site

_log = logging.getLogger(__name__)

_FALSE_ALARM = 0.01
_OFF_LINE = 1e-3
"""Probability that errors alone put points on one line as far off it as that."""
_LEAST_SHARE = 1e-6
"""Smallest singular value over the largest, of the fit: below it the points determine no homography."""


@dataclass(frozen=True, slots=True)
class Pairs:
    """Points on the road and in the picture, normalised, with their covariances.

    plane, picture           the normalised coordinates
    X, p                     (N, 2)
    plane_cov, picture_cov   (N, 2, 2)
    """

    plane: Normal
    picture: Normal
    X: Floats
    p: Floats
    plane_cov: Floats
    picture_cov: Floats

    def fit(self, kept: Floats | slice = slice(None)) -> Fit:
        """The homography through some of the pairs."""
        return fitted(self.X[kept], self.p[kept], self.plane_cov[kept], self.picture_cov[kept])

    def residual_cov(self, k: Floats) -> Floats:
        """(N, 2, 2) of both points, in the normalised picture."""
        J = by_point(k, self.X)
        return np.asarray(self.picture_cov + J @ self.plane_cov @ np.swapaxes(J, 1, 2))


@dataclass(frozen=True, slots=True)
class Check:
    """What the pairs of a calibration say about each other.

    residual_px, residual_m   (N,) distance of each point from where the fit puts it
    without_px, without_m     (N,) the same where the fit did not know the point; NaN with four pairs
    d2                        (N,) those errors squared over their covariance, chi-square with 2 degrees; NaN with four
    chi2, spare               sum of squares of the fit, and its degrees of freedom, 2 N - 8
    wrong                     numbers of the pairs, from 0, that contradict the others
    contradiction             the pairs do not agree within their standard deviations, whether or not one is named
    """

    residual_px: Floats
    residual_m: Floats
    without_px: Floats
    without_m: Floats
    d2: Floats
    chi2: float
    spare: int
    wrong: tuple[int, ...]
    contradiction: bool


def metres_of(calibration: Calibration) -> Floats:
    """(N, 2) ground points in metres."""
    ground = np.array(calibration.ground, float)
    if not calibration.geographic or calibration.epsg is None:
        return ground
    import pyproj

    to_metres = pyproj.Transformer.from_crs(4326, metric_system(calibration.epsg), always_xy=True)
    return np.column_stack(to_metres.transform(ground[:, 0], ground[:, 1]))


def pairs_of(site: Site) -> Pairs:
    """The pairs of a site's calibration. Raises ConfigError where no homography can go through them."""
    calibration = site.calibration
    assert calibration is not None
    lens = lens_of(site)
    ground, picture = metres_of(calibration), np.array(calibration.picture, float)
    bend = np.repeat(np.eye(2)[None], len(picture), axis=0)
    if lens is not None:
        picture = lens.straight(picture)
        if not np.isfinite(picture).all():
            raise ConfigError("calibration.distortion folds the picture back inside its own points; check k1 and k2")
        bend = np.asarray(np.linalg.inv(lens.jacobian(picture)))
    _refuse_lines(picture, ground, calibration)
    plane, view = Normal.of(ground), Normal.of(picture)
    return Pairs(
        plane,
        view,
        plane.into(ground),
        view.into(picture),
        np.repeat(np.eye(2)[None] * (calibration.sigma_ground_m / plane.scale) ** 2, len(ground), axis=0),
        bend @ np.swapaxes(bend, 1, 2) * (calibration.sigma_picture_px / view.scale) ** 2,
    )


def calibrated(site: Site) -> Ground:
    """The road plane of a site. Warns of pairs that contradict the others.

    Where the pairs do not agree within their standard deviations, these are taken to be larger by as much.
    Raises ConfigError for points that determine no plane, or that are mirrored.
    """
    assert site.calibration is not None
    if not site.calibration.picture:
        with site.named():
            found = straight_road(site)
        for line in found.doubts():
            _log.warning("%s", line)
        return found.ground
    with site.named():
        pairs = pairs_of(site)
        fit = solved(pairs)
    check = checked(pairs, fit)
    for line in doubts(site, check):
        _log.warning("%s", line)
    return road_plane(site, pairs, fit, check)


def solved(pairs: Pairs) -> Fit:
    """The homography through all pairs. Raises ConfigError where there is none that a camera above the road sees."""
    fit = pairs.fit()
    variance = np.linalg.eigvalsh(fit.cov)
    if not np.isfinite(fit.k).all() or variance[0] <= _LEAST_SHARE**2 * variance[-1]:
        raise ConfigError(
            "calibration: the points determine no plane: all but one lie on one line; spread them over the road"
        )
    if not (depth(fit.k, pairs.X) > 0).all():
        raise ConfigError(
            "calibration: no camera sees all these points as they are paired: some would be behind it; "
            "check that picture and ground list the same points in the same order"
        )
    turned = np.linalg.det(by_point(fit.k, pairs.X))
    if (turned > 0).all():
        raise ConfigError(
            "calibration: the points are mirrored: the road would be seen from below; in the picture x grows to the "
            "right and y downwards, on the ground x grows to the east and y to the north; check their order and signs"
        )
    if not (turned < 0).all():
        raise ConfigError("calibration: the points fold the plane over itself; check that the pairs are in order")
    return fit


def road_plane(site: Site, pairs: Pairs, fit: Fit, check: Check) -> Ground:
    """The road plane of a fit."""
    calibration = site.calibration
    assert calibration is not None
    wider = max(1.0, check.chi2 / check.spare) if check.contradiction else 1.0
    picture = pairs.picture.back(pairs.p)
    lens = lens_of(site)
    sigma = calibration.sigma_picture_px
    center = np.array(site.center)
    return Ground(
        pairs.plane, pairs.picture, fit.k, wider * fit.cov, lens, center, calibration.focal_px, hull(picture), sigma
    )


def checked(pairs: Pairs, fit: Fit) -> Check:
    """The fit's residuals, and each pair against the others."""
    count = len(pairs.X)
    spare = 2 * count - 8
    residual_px, residual_m = _distances(pairs, fit.k)
    without_px, without_m, d2 = np.full((3, count), np.nan)
    contradiction = bool(spare and fit.chi2 > chdtri(spare, _FALSE_ALARM))
    wrong: list[int] = []
    if count >= 5:
        for i in range(count):
            without_px[i], without_m[i], d2[i] = _left_out(pairs, np.delete(np.arange(count), i), i)
        wrong = _wrong(pairs)
    return Check(
        residual_px, residual_m, without_px, without_m, d2, fit.chi2, spare, tuple(wrong), contradiction or bool(wrong)
    )


def doubts(site: Site, check: Check) -> list[str]:
    """What the user should know about the calibration, in words."""
    calibration = site.calibration
    assert calibration is not None
    said = []
    if check.spare == 0:
        said.append("4 pairs of points leave nothing to check the calibration with; give a fifth, better eight")
    for i in check.wrong:
        (x, y), (east, north) = calibration.picture[i], calibration.ground[i]
        off = f"{check.without_px[i]:.1f} px ({check.without_m[i]:.2f} m)"
        said.append(
            f"pair {i + 1} of the calibration, picture ({x:g}, {y:g}) and ground ({east:g}, {north:g}), is {off} from "
            "where the other pairs put it; correct it or leave it out"
        )
    if check.contradiction and not check.wrong:
        blame = "too few to say which is wrong" if check.spare < 4 else "none stands out"
        said.append(
            f"the pairs of the calibration do not agree within their standard deviations (chi-square {check.chi2:.1f} "
            f"with {check.spare} degrees of freedom); {blame}; errors are given larger by as much"
        )
    return said


def _wrong(pairs: Pairs) -> list[int]:
    """Pairs that contradict the rest: while leaving one out helps most, and it is far from where the others put it.

    Among five pairs none can be named: whichever is left out, the other four agree exactly.
    """
    count = len(pairs.X)
    kept, wrong = np.arange(count), list[int]()
    limit = chdtri(2, _FALSE_ALARM / count)
    while len(kept) >= 6:
        rests = [kept[kept != i] for i in kept]
        best = int(np.argmin([pairs.fit(rest).chi2 for rest in rests]))
        if not _left_out(pairs, rests[best], int(kept[best]))[2] > limit:
            break
        wrong.append(int(kept[best]))
        kept = rests[best]
    return sorted(wrong)


def _left_out(pairs: Pairs, rest: Floats, i: int) -> tuple[float, float, float]:
    """Distance of a pair from where the rest puts it [px, m], and its square over its covariance."""
    fit = pairs.fit(rest)
    off = (picture_of(fit.k, pairs.X[[i]]) - pairs.p[[i]])[0]
    J = by_k(fit.k, pairs.X[[i]])[0]
    cov = pairs.residual_cov(fit.k)[i] + J @ fit.cov @ J.T
    px, m = _distances(pairs, fit.k)
    return px[i], m[i], float(off @ np.linalg.solve(cov, off))


def _distances(pairs: Pairs, k: Floats) -> tuple[Floats, Floats]:
    """(N,) px and m between the points and where a homography puts them."""
    in_picture = np.linalg.norm(picture_of(k, pairs.X) - pairs.p, axis=1) * pairs.picture.scale
    on_road = np.linalg.norm(plane_of(k, pairs.p) - pairs.X, axis=1) * pairs.plane.scale
    return in_picture, on_road


def _refuse_lines(picture: Floats, ground: Floats, calibration: Calibration) -> None:
    """Raise ConfigError for pairs of which all but one are on a line."""
    count = len(picture)
    for name, points, sigma in (
        ("picture", picture, calibration.sigma_picture_px),
        ("ground", ground, calibration.sigma_ground_m),
    ):
        for i in range(count):
            off, errors = _off_line(np.delete(points, i, axis=0)), sigma * math.sqrt(chdtri(count - 3, _OFF_LINE))
            if off <= max(errors, 1e-9 * np.ptp(points)):
                numbers = ", ".join(str(k + 1) for k in range(count) if k != i)
                raise ConfigError(
                    f"calibration: points {numbers} of the {count} in {name} lie on one line, within their errors; no "
                    "plane is determined; give 4 of which no 3 are in line, or more"
                )


def _off_line(points: Floats) -> float:
    """Root of the sum of squared distances of points (N, 2) from the line that fits them best."""
    off = points - points.mean(axis=0)
    return float(np.linalg.svd(off, compute_uv=False)[1])
