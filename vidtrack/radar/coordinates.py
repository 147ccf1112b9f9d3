"""Conversion of range, azimuth and elevation to x, y, z and back: x east, y north, z up, azimuth from north clockwise.

Angles are in radians. The range of a plot without elevation is the ground range.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays.types import Floats


def wrap(angle: Floats) -> Floats:
    """The same angles in -pi..pi."""
    return np.asarray(angle - 2 * np.pi * np.round(angle / (2 * np.pi)))


def to_cartesian(polar: Floats) -> Floats:
    """(M, 2) range, azimuth to x, y, or (M, 3) with elevation to x, y, z."""
    r, azimuth = polar[:, 0], polar[:, 1]
    if polar.shape[1] == 2:
        return np.column_stack([r * np.sin(azimuth), r * np.cos(azimuth)])
    ground, elevation = r * np.cos(polar[:, 2]), polar[:, 2]
    return np.column_stack([ground * np.sin(azimuth), ground * np.cos(azimuth), r * np.sin(elevation)])


def to_polar(xyz: Floats) -> Floats:
    """(M, 2) x, y to range, azimuth, or (M, 3) x, y, z to range, azimuth, elevation; azimuth in -pi..pi."""
    ground = np.hypot(xyz[:, 0], xyz[:, 1])
    azimuth = np.arctan2(xyz[:, 0], xyz[:, 1])
    if xyz.shape[1] == 2:
        return np.column_stack([ground, azimuth])
    return np.column_stack([np.hypot(ground, xyz[:, 2]), azimuth, np.arctan2(xyz[:, 2], ground)])


def unbiased(polar: Floats, R: Floats) -> tuple[Floats, Floats]:
    """Unbiased positions (M, d) and the covariances (M, d, d) of their errors.

    polar (M, d) range, azimuth[, elevation] with independent errors; R (M, d, d) has their variances.

    An angle's error multiplies the mean of its cosine by lambda = exp(-sigma^2 / 2); division by it removes the bias.
    The covariance is E[(z_u - z)(z_u - z)'] given the measurement. S. Longbin, Z. Xiaoquan, Z. Yiyu, "Unbiased
    Converted Measurements for Tracking", IEEE Trans. Aerospace and Electronic Systems 34(3), 1998.
    """
    r2 = polar[:, 0] ** 2
    mean2 = r2 + R[:, 0, 0]
    shrink = np.exp(-R[:, 1, 1] / 2)
    s, c, s2, c2 = _circular(polar[:, 1], shrink)
    position = to_cartesian(polar) / shrink[:, None]
    cov = np.empty((len(polar), polar.shape[1], polar.shape[1]))
    if polar.shape[1] == 2:
        level, both = r2 * (shrink**-2 - 2), mean2 / 2
        cov[:, 0, 0] = level * s**2 + both * (1 - c2)
        cov[:, 1, 1] = level * c**2 + both * (1 + c2)
        cov[:, 0, 1] = cov[:, 1, 0] = level * s * c + both * s2
        return position, cov

    tilt = np.exp(-R[:, 2, 2] / 2)
    se, ce, se2, ce2 = _circular(polar[:, 2], tilt)
    position /= tilt[:, None]
    position[:, 2] *= shrink  # the height does not depend on the azimuth
    level, both = r2 * ce**2 * ((shrink * tilt) ** -2 - 2), mean2 / 4 * (1 + ce2)
    cov[:, 0, 0] = level * s**2 + both * (1 - c2)
    cov[:, 1, 1] = level * c**2 + both * (1 + c2)
    cov[:, 2, 2] = r2 * se**2 * (tilt**-2 - 2) + mean2 / 2 * (1 - ce2)
    cov[:, 0, 1] = cov[:, 1, 0] = level * s * c + both * s2
    across = r2 * se * ce * (tilt**-2 / shrink - 1 / shrink - shrink) + mean2 / 2 * shrink * se2
    cov[:, 0, 2] = cov[:, 2, 0] = across * s
    cov[:, 1, 2] = cov[:, 2, 1] = across * c
    return position, cov


def _circular(angle: Floats, shrink: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Sine and cosine of the measured angles, and the means of sin 2a and cos 2a of the true angles."""
    twice = shrink**4
    return np.sin(angle), np.cos(angle), twice * np.sin(2 * angle), twice * np.cos(2 * angle)


def sector(angle: Floats) -> tuple[float, float]:
    """Where the smallest sector with all angles (N,) begins, and its width: the circle without the widest gap [rad].

    Angles are within one turn of each other, as in 0..2 pi or -pi..pi.
    """
    turn = np.sort(angle)
    gap = np.diff(turn, append=turn[0] + 2 * np.pi)
    widest = int(gap.argmax())
    return float(turn[(widest + 1) % len(turn)]), float(2 * np.pi - gap[widest])
