"""Registration of a picture with the scene: robust inverse-compositional Gauss-Newton steps on points of the scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from vidtrack.arrays import affine
from vidtrack.arrays.median import median
from vidtrack.arrays.types import Floats, Mask
from vidtrack.compiled import inlined, kernel
from vidtrack.video.background.filters import area_average
from vidtrack.video.background.scene import Levels
from vidtrack.video.camera.points import CELLS, Points
from vidtrack.video.frame import Image

FEWEST = 24
"""Smallest number of points for a registration."""
_STEPS = (3, 3, 6)  # at full, half and quarter size
_SIGMA = 1.0  # grey levels; the smallest assumed spread of residuals
_TUKEY = 4.685
_SAMPLED = 200  # points for the spread
_GREY = 64.0  # grey levels; luminance in this unit is of the size of gradients
_GAIN = 5.0  # largest change of exposure
_INSIDE = 0.3  # share of the points that must be in the picture
_SETTLED_PX = 0.03  # a smaller step is the last one
_FITS_LEVELS, _FITS_PX = 4.0, 0.3  # a point fits if residual < the first + the second * gradient
_STILL = affine.IDENTITY
_TELLING = 2.0  # grey levels; a smaller difference does not tell a motion from standing still
_LEFT = 0.3  # least share of an edge's step that must be left


class Fit(NamedTuple):
    """The result of a registration.

    motion  (2, 3) map from canvas to picture, in pixels of both
    share   share of the points that fit
    """

    motion: Floats
    share: float


def pyramid(luma: Image, levels: int) -> list[Image]:
    """The picture at full, half, quarter size."""
    found = [luma]
    for _ in range(levels - 1):
        h, w = found[-1].shape
        found.append(area_average(found[-1], (h // 2, w // 2), 2))
    return found


def align(pictures: Sequence[Image], points: Points, free: Mask, motion: Floats, every: int = 1) -> Fit:
    """Register the picture with the points from an initial motion, coarse to fine.

    pictures  the picture at full, half, ... size, one for each level of points used
    free      (N,) points where no traffic is expected
    every     every n-th point is used
    """
    fit = Fit(motion, 0.0)
    for level in reversed(range(len(pictures))):
        part = (points.start[level], points.start[level + 1], every)
        stiff = level == len(CELLS) - 1
        fit = Fit(*_fit(pictures[level], 2.0**level, points, free, part, fit.motion, _STEPS[level], stiff))
    return fit


def leap(scene: Levels, luma: Image, motion: Floats) -> Floats:
    """An initial motion if the last one is far off: phase correlation at quarter size."""
    h, w = luma.shape[0] // 4, luma.shape[1] // 4
    quarter = affine.rescaled(affine.inverse(motion), 0.25)
    small = cv2.resize(scene, (scene.shape[1] // 4, scene.shape[0] // 4), interpolation=cv2.INTER_AREA)
    back = cv2.WARP_INVERSE_MAP | cv2.INTER_LINEAR
    expected = np.asarray(cv2.warpAffine(small, quarter, (w, h), flags=back, borderMode=cv2.BORDER_REPLICATE))
    seen = cv2.resize(luma[: 4 * h, : 4 * w], (w, h), interpolation=cv2.INTER_AREA).astype(np.float32)
    window = cv2.createHanningWindow((w, h), cv2.CV_32F)
    (x, y), _ = cv2.phaseCorrelate(expected - expected.mean(), seen - seen.mean(), window)
    return affine.after(affine.shift(4 * x, 4 * y), motion)


@kernel
def agreement(luma: Image, points: Points, free: Mask, motion: Floats) -> float:
    """Share of the points which the motion explains better than standing still, among those that tell the two apart.

    All points of a camera that moves tell of the same motion. Light that sweeps over a still scene makes some points
    seem to move; at the others the motion is seen to be wrong.
    """
    x, y, value, _, _ = _used(points, free, (points.start[0], points.start[1], 1))
    stood, moved = np.empty(len(x)), np.empty(len(x))
    _sample(luma, 1.0, x, y, _STILL, stood)
    _sample(luma, 1.0, x, y, motion, moved)
    light, _ = _spread(moved, 1.0, 0.0, value)
    telling, better = 0, 0
    for k in range(len(x)):
        gain = abs(stood[k] - value[k] - light) - abs(moved[k] - value[k] - light)
        if abs(gain) > _TELLING:  # false for NaN, too
            telling += 1
            better += gain > 0
    return better / telling if telling >= FEWEST else 0.0


@kernel
def edges_seen(luma: Image, points: Points) -> float:
    """Share of the scene's edges that are in the picture at the same place, in whatever light."""
    h, w = luma.shape
    seen, inside = 0, 0
    for k in range(points.start[1]):
        i, j = int(points.x[k] + np.float32(0.5)), int(points.y[k] + np.float32(0.5))
        if not (1 <= i < w - 1 and 1 <= j < h - 1):
            continue
        gx, gy = points.gx[k], points.gy[k]
        across = (np.float32(luma[j, i + 1]) - luma[j, i - 1]) / 2
        down = (np.float32(luma[j + 1, i]) - luma[j - 1, i]) / 2
        inside += 1
        seen += gx * across + gy * down > _LEFT * (gx * gx + gy * gy)
    return seen / max(inside, 1)


@kernel
def _fit(
    luma: Image, size: float, points: Points, free: Mask, part: tuple[int, int, int], motion: Floats, steps: int,
    stiff: bool,
) -> tuple[Floats, float]:  # fmt: skip
    """Motion, and share of the points that fit.

    I(A q) = g (T(q) + grad T . W'(q) d) + b is solved for the displacement d (a translation if `stiff`), gain and bias
    by least squares with Tukey's weights; then A becomes A W(d)^-1. luma (h, w) is the picture at 1/size of the points'
    scale; part: start, stop and step of the points.
    """
    x, y, value, gx, gy = _used(points, free, part)
    count = len(x)
    if count < FEWEST:
        return motion, 0.0
    middle_x, middle_y, radius = _extent(x, y)
    rows = np.empty((count, 6))
    for k in range(count):
        dx, dy = (x[k] - middle_x) / radius, (y[k] - middle_y) / radius
        rows[k, 0], rows[k, 1] = gx[k], gy[k]
        rows[k, 2], rows[k, 3] = gx[k] * dx + gy[k] * dy, gy[k] * dx - gx[k] * dy
        rows[k, 4], rows[k, 5] = value[k] / _GREY, 1.0
    seen, normal, found = np.empty(count), np.empty((6, 6)), np.empty(6)
    A = motion.copy()
    gain, bias = 1.0, 0.0
    inside, settled = 0, False
    for step in range(steps + 1):
        inside = _sample(luma, size, x, y, A, seen)
        if settled or step == steps:
            break
        if inside < _INSIDE * count:
            return A, 0.0
        centre, sigma = _spread(seen, gain, bias, value)
        normal[:], found[:] = 0.0, 0.0
        for k in range(count):
            r = (seen[k] - gain * value[k] - bias - centre) / (_TUKEY * sigma)
            if not abs(r) < 1:  # NaN, too
                continue
            weight = (1 - r * r) ** 2
            for i in range(6):
                found[i] += weight * rows[k, i] * seen[k]
                for j in range(i + 1):
                    normal[i, j] += weight * rows[k, i] * rows[k, j]
        for i in range(6):
            normal[i, i] += 1e-6 * normal[i, i] + 1e-3
        if stiff:
            normal[2, 2], normal[3, 3] = 1e12, 1e12
        _solve(normal, found)
        gain, bias = found[4] / _GREY, found[5]
        if not 1 / _GAIN < gain < _GAIN:
            return A, 0.0
        tx, ty, grow, turn = found[0] / gain, found[1] / gain, found[2] / gain / radius, found[3] / gain / radius
        A = _undone(A, tx, ty, 1 + grow, turn, middle_x, middle_y)
        settled = abs(tx) + abs(ty) + radius * (abs(grow) + abs(turn)) < _SETTLED_PX * size
    fits = 0
    for k in range(count):
        off, slope = abs(seen[k] - gain * value[k] - bias), np.sqrt(gx[k] ** 2 + gy[k] ** 2) * gain
        if off < _FITS_LEVELS + _FITS_PX * slope:
            fits += 1
    return A, fits / max(inside, 1)


@inlined
def _used(points: Points, free: Mask, part: tuple[int, int, int]) -> tuple[Levels, Levels, Levels, Levels, Levels]:
    """x, y, value, gx, gy (N,) of the free points of a part."""
    x, y, value = np.empty_like(points.x), np.empty_like(points.x), np.empty_like(points.x)
    gx, gy, n = np.empty_like(points.x), np.empty_like(points.x), 0
    for k in range(part[0], part[1], part[2]):
        if free[k]:
            x[n], y[n], value[n], gx[n], gy[n] = points.x[k], points.y[k], points.value[k], points.gx[k], points.gy[k]
            n += 1
    return x[:n], y[:n], value[:n], gx[:n], gy[:n]


@inlined
def _extent(x: Levels, y: Levels) -> tuple[float, float, float]:
    """Middle of points (N,), and root mean square distance from it."""
    middle_x, middle_y, square = 0.0, 0.0, 0.0
    for k in range(len(x)):
        middle_x += x[k] / len(x)
        middle_y += y[k] / len(x)
    for k in range(len(x)):
        square += ((x[k] - middle_x) ** 2 + (y[k] - middle_y) ** 2) / len(x)
    return middle_x, middle_y, np.sqrt(square) + 1.0


@inlined
def _solve(A: Floats, b: Floats) -> None:
    """Replace b (n,) by A^-1 b; A (n, n) is positive definite, and its lower triangle becomes its Cholesky factor."""
    n = len(b)
    for i in range(n):
        for j in range(i + 1):
            for k in range(j):
                A[i, j] -= A[i, k] * A[j, k]
            A[i, j] = np.sqrt(A[i, i]) if i == j else A[i, j] / A[j, j]
        for k in range(i):
            b[i] -= A[i, k] * b[k]
        b[i] /= A[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= A[k, i] * b[k]
        b[i] /= A[i, i]


@inlined
def _spread(seen: Floats, gain: float, bias: float, value: Levels) -> tuple[float, float]:
    """Median and robust standard deviation of the residuals, from a sample of the points."""
    stride = max(1, len(seen) // _SAMPLED)
    off = np.empty(len(seen) // stride + 1)
    n = 0
    for k in range(0, len(seen), stride):
        if not np.isnan(seen[k]):
            off[n] = seen[k] - gain * value[k] - bias
            n += 1
    if not n:
        return 0.0, _SIGMA
    centre = median(off[:n])
    for k in range(n):
        off[k] = abs(off[k] - centre)
    return centre, max(1.4826 * median(off[:n]), _SIGMA)


@inlined
def _undone(A: Floats, tx: float, ty: float, c: float, s: float, middle_x: float, middle_y: float) -> Floats:
    """A composed with the inverse of q -> middle + (c, -s; s, c) (q - middle) + t."""
    norm = c * c + s * s
    a, b = c / norm, s / norm
    x, y = middle_x + tx, middle_y + ty
    shift_x, shift_y = middle_x - a * x - b * y, middle_y + b * x - a * y
    undone = np.empty((2, 3))
    for i in range(2):
        undone[i, 0] = A[i, 0] * a - A[i, 1] * b
        undone[i, 1] = A[i, 0] * b + A[i, 1] * a
        undone[i, 2] = A[i, 0] * shift_x + A[i, 1] * shift_y + A[i, 2]
    return undone


@inlined
def _sample(luma: Image, size: float, x: Levels, y: Levels, A: Floats, seen: Floats) -> int:
    """Fill seen (N,) with the luminance at the points, bilinear, NaN outside the picture; returns the number inside."""
    h, w = luma.shape
    inside = 0
    for k in range(len(x)):
        px = (A[0, 0] * x[k] + A[0, 1] * y[k] + A[0, 2] + 0.5) / size - 0.5
        py = (A[1, 0] * x[k] + A[1, 1] * y[k] + A[1, 2] + 0.5) / size - 0.5
        if not (1 <= px < w - 2 and 1 <= py < h - 2):
            seen[k] = np.nan
            continue
        i, j = int(px), int(py)
        u, v = px - i, py - j
        above = (1 - u) * luma[j, i] + u * luma[j, i + 1]
        below = (1 - u) * luma[j + 1, i] + u * luma[j + 1, i + 1]
        seen[k] = (1 - v) * above + v * below
        inside += 1
    return inside
