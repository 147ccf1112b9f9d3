"""A homography and k1 of the lens through the same points.

Residuals are taken in the picture as the lens shows it, where the errors of the points are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.traffic.calibration.homography import (
    Fit,
    Normal,
    by_k,
    by_point,
    picture_of,
    reweighted,
    start,
    whitening,
)
from vidtrack.traffic.calibration.lens import Lens


def fitted_with_lens(
    X: Floats, shown: Floats, plane_cov: Floats, sigma_px: float, view: Normal, lens: Lens
) -> tuple[Lens, Fit]:
    """Least squares over points on the plane X (N, 2) and in the picture as the lens shows them (N, 2) [px].

    plane_cov  (N, 2, 2) of the points on the plane
    view       normalised coordinates of the picture without distortion, those of k
    lens       whose k1 is looked for; the fit's covariance is (9, 9), of k and k1

    Where there is no fit, all is NaN and chi-square infinite.
    """

    def off(theta: Floats) -> Floats:
        straight = view.back(picture_of(theta[:8], X))
        return np.asarray(replace(lens, k1=theta[8]).bent(straight) - shown)

    def derivative(theta: Floats) -> Floats:
        straight, one = view.back(picture_of(theta[:8], X)), replace(lens, k1=theta[8])
        by_homography = one.jacobian(straight) @ by_k(theta[:8], X) * view.scale
        return np.concatenate([by_homography, one.by_k1(straight)[:, :, None]], axis=2)

    def weights(theta: Floats) -> Floats:
        straight = view.back(picture_of(theta[:8], X))
        J = replace(lens, k1=theta[8]).jacobian(straight) @ by_point(theta[:8], X) * view.scale
        return whitening(J, plane_cov, sigma_px**2 * np.eye(2))

    try:
        theta, cov, chi2 = reweighted(np.append(start(X, view.into(shown)), 0.0), off, derivative, weights)
    except (np.linalg.LinAlgError, ValueError):  # wrong points led to where nothing is finite
        return replace(lens, k1=np.nan), Fit(np.full(8, np.nan), np.full((9, 9), np.nan), np.inf)
    return replace(lens, k1=float(theta[8])), Fit(theta[:8], cov, chi2)
