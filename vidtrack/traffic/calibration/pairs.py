"""The pairs of points of a calibration, and the homography through them, with the lens or without."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import ConfigError
from vidtrack.traffic.calibration.homography import Fit, Normal, by_k, by_point, fitted
from vidtrack.traffic.calibration.lens import Lens, lens_of
from vidtrack.traffic.calibration.lens_fit import fitted_with_lens
from vidtrack.traffic.epsg import metric_system
from vidtrack.traffic.site import Calibration, Site

_OFF_LINE = 1e-3
"""Probability that errors alone put points on one line as far off it as that."""


@dataclass(frozen=True, slots=True)
class Pairs:
    """Points on the road and in the picture, normalised, with their covariances.

    plane, picture           the normalised coordinates
    X, p                     (N, 2); p without the lens's distortion
    plane_cov, picture_cov   (N, 2, 2)
    shown, sigma_px          (N, 2) px; points as the lens shows them, and their standard deviation
    lens, free               the lens, and whether its k1 is fitted with the homography
    """

    plane: Normal
    picture: Normal
    X: Floats
    p: Floats
    plane_cov: Floats
    picture_cov: Floats
    shown: Floats
    sigma_px: float
    lens: Lens
    free: bool

    @property
    def parameters(self) -> int:
        """How many numbers a fit has."""
        return 9 if self.free else 8

    def best(self, kept: Ints | slice = slice(None)) -> tuple[Pairs, Fit]:
        """The fit through some of the pairs, and all pairs as its lens straightens them."""
        X, plane_cov = self.X[kept], self.plane_cov[kept]
        if not self.free:
            return self, fitted(X, self.p[kept], plane_cov, self.picture_cov[kept])
        lens, fit = fitted_with_lens(X, self.shown[kept], plane_cov, self.sigma_px, self.picture, self.lens)
        return self.through(lens), fit

    def through(self, lens: Lens) -> Pairs:
        """The same pairs seen through another lens; p is NaN where it would fold the picture back."""
        straight = lens.straight(self.shown)
        bend = np.linalg.inv(lens.jacobian(straight))
        cov = np.asarray(bend @ np.swapaxes(bend, 1, 2) * (self.sigma_px / self.picture.scale) ** 2)
        return replace(self, p=self.picture.into(straight), picture_cov=cov, lens=lens)

    def with_free_lens(self) -> Pairs:
        """The same pairs, whose lens is yet to be fitted."""
        return replace(self, free=True)

    def residual_cov(self, k: Floats) -> Floats:
        """(N, 2, 2) of both points, in the normalised picture."""
        J = by_point(k, self.X)
        return np.asarray(self.picture_cov + J @ self.plane_cov @ np.swapaxes(J, 1, 2))

    def by_fit(self, k: Floats) -> Floats:
        """(N, 2, E) derivative of the residuals, in the normalised picture, with respect to the numbers of the fit."""
        by_homography = by_k(k, self.X)
        if not self.free:
            return by_homography
        by_lens = self.lens.straightening(self.picture.back(self.p)) / self.picture.scale
        return np.concatenate([by_homography, -by_lens[:, :, None]], axis=2)


def pairs_of(site: Site) -> Pairs:
    """The pairs of a site's calibration. Raises ConfigError where no homography can go through them."""
    calibration = site.calibration
    assert calibration is not None
    lens = lens_of(site)
    ground, shown = metres_of(calibration), np.array(calibration.picture, float)
    straight = lens.straight(shown) if lens.bends else shown
    if not np.isfinite(straight).all():
        raise ConfigError("calibration.distortion folds the picture back inside its own points; check k1 and k2")
    _refuse_lines(straight, ground, calibration)
    plane, view = Normal.of(ground), Normal.of(straight)
    one, sigma_px = np.repeat(np.eye(2)[None], len(ground), axis=0), calibration.sigma_picture_px
    pairs = Pairs(
        plane, view, plane.into(ground), view.into(straight), one * (calibration.sigma_ground_m / plane.scale) ** 2,
        one * (sigma_px / view.scale) ** 2, shown, sigma_px, lens, free=False,
    )  # fmt: skip
    if calibration.distortion == "fit":
        return pairs.with_free_lens().best()[0]
    return pairs.through(lens) if lens.bends else pairs


def metres_of(calibration: Calibration) -> Floats:
    """(N, 2) ground points in metres."""
    ground = np.array(calibration.ground, float)
    if not calibration.geographic or calibration.epsg is None:
        return ground
    import pyproj

    to_metres = pyproj.Transformer.from_crs(4326, metric_system(calibration.epsg), always_xy=True)
    return np.column_stack(to_metres.transform(ground[:, 0], ground[:, 1]))


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
