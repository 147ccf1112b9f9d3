"""Measurement noise R, one function per kind of measurement, and its lasting part: errors correlated over scans.

source                    R                                          lasting part
a blob's centroid         (jitter_px step)^2 I + jitter_share^2 cov  jitter_share^2 cov
an edge of a shared blob  (share side)^2 + pixel^2                   all
a blob without own edge   by the error of its size                   all
a detector's box          max(jitter longer side, 0.5 px)^2 I        none
a file of boxes           the same, with the jitter of `file_noise`   none

Radar plots have their own errors, see `radar.scans`.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats
from vidtrack.compiled import inlined
from vidtrack.scan import Scan

LASTING_S = 0.5
"""s; correlation time of a detector's errors at a vehicle's ends. In the simulated junction the errors of the centroids
of single blobs decorrelate in part within half a second; the rest lasts for seconds."""
BOX_JITTER = 0.05
"""Default standard deviation of a box's centre, in longer sides of the box."""
LEAST_SIGMA_PX = 0.5
"""px; smallest standard deviation of a box's centre."""


def blob_noise(cov: Floats, step: int, jitter_px: float, jitter_share: float) -> tuple[Floats, Floats]:
    """R (B, 2, 2) of the centroids of blobs with second moments cov (B, 2, 2), and its lasting part.

    The border is uncertain by a part of a processed pixel, `step` px wide. Parts missed or added at an end move the
    centroid along the extent for many frames. From frame to frame centroids of vehicles jitter by 0.1 to 0.25 px at
    240 to 360 rows; the defaults are larger, because of shadow and of parts that look like the road.
    """
    lasting = jitter_share**2 * cov
    return lasting + (jitter_px * step) ** 2 * np.eye(2), lasting


def box_noise(longer: Floats, jitter: float) -> Floats:
    """R (M, 2, 2) of the centres of boxes with these longer sides (M,); jitter in longer sides."""
    sigma = np.maximum(jitter * longer, LEAST_SIGMA_PX)
    return sigma[:, None, None] ** 2 * np.eye(2)


def file_noise(lag: Floats, variance: Floats, hold_s: float) -> tuple[float, float]:
    """Jitter of a file's boxes and acceleration of the objects, from second differences of centres over lags [s].

    The variance (L,) of (c(t) - 2 c(t + lag) + c(t + 2 lag)) / size is 6 jitter^2 + 2/3 accel^2 hold_s lag^3 on each
    axis, for independent errors and white acceleration; the lags (L,) separate the two terms.
    """
    from scipy.optimize import nnls

    terms = np.column_stack([np.full(len(lag), 6.0), 2 / 3 * hold_s * lag**3])
    parts, _ = nnls(terms / variance[:, None], np.ones(len(lag)))
    jitter, accel = np.sqrt(parts)
    return jitter, accel


@inlined
def edge_variance(side: float, share: float, pixel: float) -> float:
    """Variance of a blob's edge, for a vehicle with this side: (share side)^2 plus a processed pixel squared."""
    return (share * side) ** 2 + pixel**2


@inlined
def edge_sigma(side: float, share: float, pixel: float) -> float:
    """Standard deviation of a blob's edge, see `edge_variance`."""
    return np.hypot(share * side, pixel)


def middle_variance(blob: Floats, vehicle: Floats) -> Floats:
    """Variances (G, 2) of a blob's middle as a vehicle's middle, from the error of its size; sizes (G, 2)."""
    return (0.5 * (blob - vehicle)) ** 2 + (0.1 * vehicle) ** 2 + 1.0


def inflation(dt: float) -> float:
    """Factor on the variance of lasting errors, for a filter that assumes independent errors, scans dt seconds apart.

    Errors of variance R and correlation time T have the spectral density 2 T R at frequency zero, as have independent
    errors of variance 2 T R / dt. A second of video then carries the same information at all frame rates.
    The factor is never below one, and one for a first scan (dt = 0).
    """
    return max(1.0, 2 * LASTING_S / dt) if dt > 0 else 1.0


def as_if_new(R: Floats, dt: float) -> Floats:
    """Variances for a filter's update if all of the errors R last."""
    return inflation(dt) * R


def for_update(scan: Scan, dt: float) -> Scan:
    """The scan for a filter's update, with the lasting part of R inflated; the gate uses R itself."""
    return scan.weakened(inflation(dt))
