"""What a calibration is worth: the account that `vidtrack calibrate` gives."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import chdtri

from vidtrack.arrays.types import Floats
from vidtrack.traffic.calibration.calibrate import checked, corner_px, doubts, road_plane, solved
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.calibration.pairs import pairs_of
from vidtrack.traffic.calibration.straight_road import straight_road
from vidtrack.traffic.footprint import velocity
from vidtrack.traffic.site import Site

_HEIGHT_FALSE_ALARM, _HEIGHT_SHARE = 1e-4, 0.1
"""A stated height of the camera contradicts the points when errors alone put it that far off as rarely as that, and it
is off by more than that share."""


@dataclass(frozen=True, slots=True)
class Account:
    """ground; the report as plain data; (N, 2) the points, and where the fit puts them, in the picture [px]."""

    ground: Ground
    report: dict[str, Any]
    picture: Floats
    fitted: Floats

    @property
    def against(self) -> list[str]:
        """What of its own points and its stated height contradicts the calibration, one line each."""
        return list(self.report["warnings"]) if self.report["contradiction"] else []


def examined(site: Site) -> Account:
    """The account of a site's calibration. Raises ConfigError as `calibrated` does."""
    calibration = site.calibration
    assert calibration is not None
    if not calibration.picture:
        return _without_map(site)
    with site.named():
        pairs = pairs_of(site)
        fit = solved(pairs)
    check = checked(pairs, fit)
    ground = road_plane(site, pairs, fit, check)
    picture = np.array(calibration.picture)
    fitted = ground.pixels(pairs.plane.back(pairs.X))
    found = camera(ground)
    height = height_doubt(found, calibration.camera_height_m)
    columns = {
        "residual_px": check.residual_px,
        "residual_m": check.residual_m,
        "without_px": check.without_px,
        "without_m": check.without_m,
        "d2": check.d2,
    }
    report = {
        "site": site.camera.name,
        "pairs": [
            {"picture": list(calibration.picture[i]), "ground": list(calibration.ground[i])}
            | {name: _finite(values[i]) for name, values in columns.items()}
            for i in range(len(picture))
        ],
        "chi2": check.chi2,
        "degrees_of_freedom": check.spare,
        "wrong": [i + 1 for i in check.wrong],
        "contradiction": check.contradiction or bool(height),
        "camera": found,
        "lens": lens_told(ground, site, found),
        "homography": homography_told(ground),
        "places": places(ground, fitted),  # wrong pairs may lie above the horizon in the picture
        "warnings": doubts(site, check) + height,
    }
    return Account(ground, report, picture, fitted)


def _without_map(site: Site) -> Account:
    """The account of a calibration by segments of a straight road."""
    calibration = site.calibration
    assert calibration is not None
    with site.named():
        fit = straight_road(site)
    found = camera(fit.ground)
    height = height_doubt(found, calibration.camera_height_m)
    picture = np.array([point for _, point in calibration.points()])
    report = {
        "site": site.camera.name,
        "pairs": [],
        "chi2": fit.chi2,
        "degrees_of_freedom": fit.spare,
        "wrong": [],
        "contradiction": fit.contradiction or bool(height),
        "camera": found,
        "lens": lens_told(fit.ground, site, found),
        "homography": homography_told(fit.ground),
        "places": places(fit.ground, picture),
        "warnings": fit.doubts() + height,
    }
    return Account(fit.ground, report, picture, picture)


def places(ground: Ground, picture: Floats) -> list[dict[str, Any]]:
    """What a pixel is worth and what the calibration does to speeds, near, in the middle and far.

    picture  (N, 2) points whose nearest and farthest are looked at, and their middle on the road [px]
    """
    road = ground.metres(picture)
    order = np.argsort(ground.depth(road))
    xy_m = np.vstack([road[order[0]], road.mean(axis=0), road[order[-1]]])
    xy = ground.pixels(xy_m)
    own = np.linalg.svd(ground.by_own_error(xy_m), compute_uv=False)
    shared = np.linalg.norm(ground.by_shared_error(xy_m), axis=(1, 2))
    speed = _speed_share(ground, xy)
    return [
        {
            "where": where,
            "picture_px": xy[i].round(1).tolist(),
            "ground_m": xy_m[i].round(3).tolist(),
            "m_per_px_away": float(own[i, 0]),
            "m_per_px_across": float(own[i, 1]),
            "position_sigma_m": float(shared[i]),
            "speed_sigma_percent": _finite(100 * speed[i]),
        }
        for i, where in enumerate(("near", "middle", "far"))
    ]


def camera(ground: Ground) -> dict[str, Any] | None:
    """Focal length and height of the camera with the height's standard deviation; None where they cannot be told."""
    pose = ground.pose()
    if pose is None:
        return None
    poses = [(above.pose(), below.pose()) for above, below in ground.varied()]
    changes = [(a.height_m - b.height_m) / 2 if a and b else np.inf for a, b in poses]
    return {
        "focal_px": pose.focal_px,
        "height_m": pose.height_m,
        "height_sigma_m": _finite(float(np.linalg.norm(changes))),
    }


def lens_told(ground: Ground, site: Site, found: dict[str, Any] | None) -> dict[str, float] | None:
    """k1 and k2 of the lens in focal lengths of the camera, if it was found, and by how much the picture's corner is
    moved outwards, with standard deviations where the points told the lens; None without a lens."""
    lens = ground.lens
    if lens is None:
        return None
    k1_sigma = math.sqrt(ground.cov[8, 8]) if len(ground.cov) > 8 else 0.0
    focal_px = lens.focal_px if found is None else found["focal_px"]
    share = (focal_px / lens.focal_px) ** 2
    corner_sigma_px = abs(corner_px(site, replace(lens, k1=k1_sigma, k2=0.0)))
    return {
        "k1": share * lens.k1,
        "k1_sigma": share * k1_sigma,
        "k2": share**2 * lens.k2,
        "focal_px": focal_px,
        "corner_px": corner_px(site, lens),
        "corner_sigma_px": corner_sigma_px,
    }


def homography_told(ground: Ground) -> dict[str, Any]:
    """The matrix from metres, less an origin, to homogeneous picture points without distortion [px], its last element
    1, and the covariance of the other eight, row by row; then of k1, if the points told the lens."""
    return {
        "origin_m": ground.plane.origin.tolist(),
        "matrix": ground.about_origin.tolist(),
        "covariance": ground.homography_cov.tolist(),
    }


def height_doubt(found: dict[str, Any] | None, stated_m: float | None) -> list[str]:
    """A word about a stated height of the camera that the points contradict."""
    if found is None or stated_m is None or found["height_sigma_m"] is None:
        return []
    off, sigma = abs(found["height_m"] - stated_m), found["height_sigma_m"]
    if off**2 <= chdtri(1, _HEIGHT_FALSE_ALARM) * sigma**2 or off <= _HEIGHT_SHARE * stated_m:
        return []
    decimals = max(1, 1 - math.floor(math.log10(sigma))) if sigma > 0 else 1
    return [
        f"camera_height_m = {stated_m:g}, but the points put the camera {found['height_m']:.{decimals}f} m above the "
        f"road (standard deviation {sigma:.{decimals}f} m); check both, and the unit of ground"
    ]


def _speed_share(ground: Ground, xy: Floats) -> Floats:
    """(N,) standard deviation that the calibration gives to speeds at picture points, as a share: the worst way."""
    J = ground.px_per_m(ground.metres(xy))
    changes = np.zeros((2, len(xy), 2, len(ground.cov)))
    for i, e in enumerate(np.eye(2)):
        for k, (above, below) in enumerate(ground.varied()):
            changes[i, :, :, k] = (velocity(above, xy, xy, J @ e)[0] - velocity(below, xy, xy, J @ e)[0]) / 2
    angles = np.linspace(0, np.pi, 36, endpoint=False)
    e = np.column_stack([np.cos(angles), np.sin(angles)])
    along = np.einsum("ai,aj,injp->anp", e, e, changes)
    return np.asarray(np.linalg.norm(along, axis=2).max(axis=0))


def _finite(value: float) -> float | None:
    """A number for a report; None where it is not known."""
    return float(value) if np.isfinite(value) else None
