"""From the points of a site to its road plane, and what the points say about each other."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import ConfigError
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.calibration.homography import Fit, by_point, depth, picture_of, plane_of
from vidtrack.traffic.calibration.hull import hull
from vidtrack.traffic.calibration.lens import Lens
from vidtrack.traffic.calibration.pairs import Pairs, pairs_of
from vidtrack.traffic.calibration.straight_road import straight_road
from vidtrack.traffic.site import LEAST_FOR_LENS, Site

_log = logging.getLogger(__name__)

_FALSE_ALARM = 0.01
_LEAST_SHARE = 1e-6
"""Smallest singular value over the largest, of the fit: below it the points determine no homography."""


@dataclass(frozen=True, slots=True)
class Check:
    """What the pairs of a calibration say about each other.

    residual_px, residual_m   (N,) distance of each point from where the fit puts it
    without_px, without_m     (N,) the same where the fit did not know the point; NaN with four pairs
    d2                        (N,) those errors squared over their covariance, chi-square with 2 degrees; NaN with four
    chi2, spare               sum of squares of the fit, and its degrees of freedom, 2 N - 8, or 2 N - 9 with the lens
    wrong                     numbers of the pairs, from 0, that contradict the others
    contradiction             the pairs do not agree within their standard deviations, whether or not one is named
    lens                      one that explains this better than wrong pairs do; None: there is none
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
    lens: Lens | None


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
    """The fit through all pairs. Raises ConfigError where there is none that a camera above the road sees."""
    _, fit = pairs.best()
    if pairs.free and not np.isfinite([*fit.k, *pairs.p.ravel()]).all():
        raise ConfigError(
            'calibration: distortion = "fit", but the lens that fits the pairs best folds the picture back inside '
            "them: some are wrong; without distortion each is compared with the others; or state k1 and k2"
        )
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
    center, focal_px, sigma = np.array(site.center), calibration.focal_px, calibration.sigma_picture_px
    lens = pairs.lens if pairs.free or pairs.lens.bends else None
    return Ground(pairs.plane, pairs.picture, fit.k, wider * fit.cov, lens, center, focal_px, hull(picture), sigma)


def checked(pairs: Pairs, fit: Fit) -> Check:
    """The fit's residuals, and each pair against the others."""
    count = len(pairs.X)
    spare = 2 * count - pairs.parameters
    residual_px, residual_m = _distances(pairs, fit.k)
    without_px, without_m, d2 = np.full((3, count), np.nan)
    contradiction = bool(spare and _too_large(fit.chi2, spare))
    wrong: list[int] = []
    if count >= 5:
        for i in range(count):
            without_px[i], without_m[i], d2[i] = _left_out(pairs, np.delete(np.arange(count), i), i)
        wrong = _wrong(pairs)
    contradiction = contradiction or bool(wrong)
    lens = _lens_instead(pairs, wrong) if contradiction else None
    named = () if lens else tuple(wrong)
    return Check(residual_px, residual_m, without_px, without_m, d2, fit.chi2, spare, named, contradiction, lens)


def doubts(site: Site, check: Check) -> list[str]:
    """What the user should know about the calibration, in words."""
    calibration = site.calibration
    assert calibration is not None
    said = []
    if check.spare == 0:
        said.append("4 pairs of points leave nothing to check the calibration with; give a fifth, better eight")
    for i in check.wrong:
        (x, y), (east, north) = calibration.picture[i], calibration.ground[i]
        px, m = check.without_px[i], check.without_m[i]
        off = f"{px:.1f} px" if np.isfinite(px) else "far"
        off += f" ({m:.2f} m)" if np.isfinite(m) else ""
        said.append(
            f"pair {i + 1} of the calibration, picture ({x:g}, {y:g}) and ground ({east:g}, {north:g}), is {off} from "
            "where the other pairs put it; correct it or leave it out"
        )
    if check.lens is not None:
        said.append(
            f"the pairs of the calibration do not agree where straight lines are straight (chi-square {check.chi2:.1f} "
            f"with {check.spare} degrees of freedom), and do so with a lens that moves the picture's corner by "
            f'{corner_px(site, check.lens):+.0f} px; write distortion = "fit" into [calibration], or its k1 and k2'
        )
    elif check.contradiction and not check.wrong:
        blame = "too few to say which is wrong" if check.spare < 4 else "none stands out"
        said.append(
            f"the pairs of the calibration do not agree within their standard deviations (chi-square {check.chi2:.1f} "
            f"with {check.spare} degrees of freedom); {blame}; errors are given larger by as much"
        )
    return said


def corner_px(site: Site, lens: Lens) -> float:
    """By how much a lens moves the corner of the picture that is farthest from its axis, outwards [px]."""
    axis, last = np.array(site.center), np.array([site.camera.width, site.camera.height]) - 1
    arm = float(np.linalg.norm(np.maximum(axis, last - axis))) / lens.focal_px
    return lens.focal_px * (lens.k1 * arm**3 + lens.k2 * arm**5)


def _wrong(pairs: Pairs) -> list[int]:
    """Pairs that contradict the rest: while leaving one out helps most, and it is far from where the others put it.

    Among five pairs none can be named: whichever is left out, the other four agree exactly.
    """
    count = len(pairs.X)
    kept, wrong = np.arange(count), list[int]()
    limit = chdtri(2, _FALSE_ALARM / count)
    while len(kept) >= 6:
        rests = [kept[kept != i] for i in kept]
        best = int(np.argmin([pairs.best(rest)[1].chi2 for rest in rests]))
        if not _left_out(pairs, rests[best], int(kept[best]))[2] > limit:
            break
        wrong.append(int(kept[best]))
        kept = rests[best]
    return sorted(wrong)


def _lens_instead(pairs: Pairs, wrong: list[int]) -> Lens | None:
    """The lens with which pairs that no lens was fitted to agree, if it explains them better than wrong ones do.

    By Schwarz's criterion: a lens is one number more, and each pair that is left out two.
    """
    count, spare = len(pairs.X), 2 * len(pairs.X) - 9
    if pairs.free or pairs.lens.bends or count < LEAST_FOR_LENS:
        return None
    seen, fit = pairs.with_free_lens().best()
    if not np.isfinite(seen.p).all():  # it would fold the picture back
        return None
    _, rest = pairs.best(np.delete(np.arange(count), wrong))
    better = fit.chi2 < rest.chi2 + (2 * len(wrong) - 1) * math.log(2 * count)
    return seen.lens if better and not _too_large(fit.chi2, spare) else None


def _too_large(chi2: float, spare: int) -> bool:
    return chi2 > chdtri(spare, _FALSE_ALARM)


def _left_out(pairs: Pairs, rest: Ints, i: int) -> tuple[float, float, float]:
    """Distance of a pair from where the rest puts it [px, m], and its square over its covariance.

    NaN, NaN and infinite where the rest has a lens that shows nothing there.
    """
    pairs, fit = pairs.best(rest)
    if not np.isfinite([*fit.k, *pairs.p[i]]).all():
        return np.nan, np.nan, np.inf
    off = (picture_of(fit.k, pairs.X[[i]]) - pairs.p[[i]])[0]
    J = pairs.by_fit(fit.k)[i]
    cov = pairs.residual_cov(fit.k)[i] + J @ fit.cov @ J.T
    px, m = _distances(pairs, fit.k)
    return px[i], m[i], float(off @ np.linalg.solve(cov, off))


def _distances(pairs: Pairs, k: Floats) -> tuple[Floats, Floats]:
    """(N,) px and m between the points and where a homography puts them."""
    in_picture = np.linalg.norm(picture_of(k, pairs.X) - pairs.p, axis=1) * pairs.picture.scale
    on_road = np.linalg.norm(plane_of(k, pairs.p) - pairs.X, axis=1) * pairs.plane.scale
    return in_picture, on_road
