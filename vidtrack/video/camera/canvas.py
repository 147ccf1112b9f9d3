"""The canvas: the scene extended beyond the picture, while the camera moves."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import affine
from vidtrack.arrays.types import Floats, Ints
from vidtrack.compiled import inlined, kernel
from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import NEVER, UNKNOWN, UNSEEN, Levels, Scene
from vidtrack.video.frame import Image

_NEW_NOISE = np.float32(6)  # grey levels assumed of what has just come into the picture
_RIM, _CHROMA_RIM = 1.5, 0.5  # unused px at the picture's edge, where filters mirror
_ALIKE_PX = 0.08  # largest error of position within pixels that are interpolated together
_SPARE = 8  # px that the canvas grows beyond what is needed, at least
_LARGEST = 0.15  # share of the picture's longer side that the canvas reaches beyond it on each side


def lay(picture: Picture, motion: Floats, scene: Scene) -> tuple[Picture, Ints]:
    """The picture resampled on the canvas, and (h, 2) its first and last columns in each row.

    Pixels seen for the first time become scene; outside the picture the scene is repeated.

    motion  (2, 3) from canvas to picture
    """
    laid = Picture(*(np.empty(p.shape, np.uint8) for p in scene[:3]))
    span, half_span = (np.empty((len(p), 2), np.int64) for p in laid[:2])
    _lay(picture.luma, motion, _RIM, scene.luma, laid.luma, span)
    if picture.cb.size:
        half = affine.rescaled(motion, 0.5)
        _lay(picture.cb, half, _CHROMA_RIM, scene.cb, laid.cb, half_span)
        _lay(picture.cr, half, _CHROMA_RIM, scene.cr, laid.cr, half_span)
    _reveal(laid, scene, span)
    return laid, span


@kernel
def mark_unseen(covered: Image, span: Ints) -> None:
    """Set covered (h, w) to UNSEEN outside the picture."""
    for y in range(len(span)):
        covered[y, : span[y, 0]] = UNSEEN
        covered[y, span[y, 1] :] = UNSEEN


def fitting(scene: Scene, motion: Floats, shape: tuple[int, int]) -> tuple[int, int, int, int] | None:
    """Left, top, right, bottom of a new canvas that contains a picture (h, w); None if the present one does."""
    h, w = scene.luma.shape
    edges = affine.points(affine.inverse(motion), affine.corners(shape[1], shape[0]))
    need = np.concatenate([np.floor(edges.min(axis=0)), np.ceil(edges.max(axis=0)) + 1]).astype(int)
    now = np.array([0, 0, w, h])
    outward = np.array([-1, -1, 1, 1])
    missing = outward * (need - now) > 0
    if not missing.any() and not (h % 2 or w % 2):
        return None
    cut = np.where(missing, need + outward * _SPARE, now)
    most = np.array([shape[1], shape[0]]) + 2 * (int(_LARGEST * max(shape)) + _SPARE)
    for axis in range(2):
        excess = cut[axis + 2] - cut[axis] - most[axis]
        if excess > 0:  # drop the side that the camera moves away from
            if missing[axis + 2]:
                cut[axis] += min(excess, need[axis] - cut[axis])
            else:
                cut[axis + 2] -= min(excess, cut[axis + 2] - need[axis + 2])
    cut[:2] -= cut[:2] % 2
    cut[2:] += cut[2:] % 2
    left, top, right, bottom = cut.tolist()
    return left, top, right, bottom


def recut(scene: Scene, left: int, top: int, right: int, bottom: int) -> Scene:
    """The scene from column left to right and row top to bottom, all even; added pixels are unknown."""
    fills = (0.0, 128.0, 128.0, float(UNKNOWN), 0.0, float(NEVER), 0.0, 0.0)
    whole = (left, top, right, bottom)
    half = (left // 2, top // 2, right // 2, bottom // 2)
    planes = [
        _cut(old, half if name in ("cb", "cr") else whole, fill) if old.size else old
        for name, old, fill in zip(Scene._fields, scene, fills, strict=True)
    ]
    return Scene(*planes)


def settled(scene: Scene, motion: Floats, shape: tuple[int, int]) -> Scene:
    """The scene resampled to a picture (h, w) with this motion."""
    size, back = (shape[1], shape[0]), affine.inverse(motion)
    half, half_size = affine.rescaled(back, 0.5), ((shape[1] + 1) // 2, (shape[0] + 1) // 2)
    return Scene(
        _warped(scene.luma, back, size, cv2.BORDER_REPLICATE, cv2.INTER_CUBIC),
        *(_warped(p, half, half_size, cv2.BORDER_REPLICATE) if p.size else p for p in (scene.cb, scene.cr)),
        *(_warped(p, back, size, cv2.BORDER_REPLICATE, cv2.INTER_NEAREST) for p in scene[3:]),
    )


def _warped(
    source: NDArray, to_source: Floats, size: tuple[int, int], border: int = cv2.BORDER_CONSTANT,
    how: int = cv2.INTER_LINEAR,
) -> NDArray:  # fmt: skip
    """An image of size (width, height), resampled from the source by the map `to_source`."""
    return np.asarray(cv2.warpAffine(source, to_source, size, flags=how | cv2.WARP_INVERSE_MAP, borderMode=border))


def _cut(old: Levels, cut: tuple[int, int, int, int], fill: float) -> Levels:
    left, top, right, bottom = cut
    h, w = old.shape
    new = np.full((bottom - top, right - left), fill, np.float32)
    rows, columns = slice(max(top, 0), min(bottom, h)), slice(max(left, 0), min(right, w))
    to_rows = slice(rows.start - top, rows.stop - top)
    new[to_rows, columns.start - left : columns.stop - left] = old[rows, columns]
    return new


@kernel
def _lay(source: Image, motion: Floats, rim: float, scene: Levels, laid: Image, span: Ints) -> None:
    """Fill laid (h, w) from source (H, W), bilinear; outside it, from the scene. Sets span (h, 2).

    Neighbouring pixels whose subpixel positions differ by less than _ALIKE_PX are interpolated together: for a pure
    translation, whole rows.
    """
    H, W = source.shape
    h, w = laid.shape
    (a, b, x_off), (c, d, y_off) = motion
    change = max(abs(a - 1), abs(c), 1e-9)
    block = int(min(max(_ALIKE_PX / change, 1.0), float(w)))
    for y in range(h):
        x0, y0 = b * y + x_off, d * y + y_off
        low, high = _narrowed(0.0, w - 1.0, a, x0, rim, W - 1 - rim)
        low, high = _narrowed(low, high, c, y0, rim, H - 1 - rim)
        first, last = int(np.ceil(low)), int(np.floor(high)) + 1
        if last <= first:
            first = last = 0
        span[y, 0], span[y, 1] = first, last
        for x in range(first):
            laid[y, x] = np.uint8(scene[y, x] + np.float32(0.5))
        for x in range(last, w):
            laid[y, x] = np.uint8(scene[y, x] + np.float32(0.5))
        for x in range(first, last, block):
            n = min(block, last - x)
            reach = (n - 1) / 2
            px, py = a * (x + reach) + x0 - reach, c * (x + reach) + y0
            i, j = int(px), int(py)
            _blend(source[j, i : i + n + 1], source[j + 1, i : i + n + 1], px - i, py - j, laid[y, x : x + n])


@inlined
def _blend(upper: Image, lower: Image, u: float, v: float, out: Image) -> None:
    """Fill out (n,) by bilinear interpolation of two rows (n + 1,), with fractions u to the right and v down."""
    ends = np.uint16(256 * u * v + 0.5)
    right, below = np.uint16(256 * u + 0.5) - ends, np.uint16(256 * v + 0.5) - ends
    own = np.uint16(256) - right - below - ends
    for k in range(len(out)):
        row = own * upper[k] + right * upper[k + 1]
        out[k] = (row + below * lower[k] + ends * lower[k + 1] + 128) >> 8


@inlined
def _narrowed(low: float, high: float, slope: float, offset: float, least: float, most: float) -> tuple[float, float]:
    """The part of low..high in which slope x + offset is within least..most."""
    if abs(slope) < 1e-9:
        return (low, high) if least <= offset <= most else (0.0, -1.0)
    one, other = (least - offset) / slope, (most - offset) / slope
    return max(low, min(one, other)), min(high, max(one, other))


@kernel
def _reveal(laid: Picture, scene: Scene, span: Ints) -> None:
    coloured = len(laid.cb) > 0
    for y in range(len(span)):
        for x in range(span[y, 0], span[y, 1]):
            if scene.noise[y, x] >= UNKNOWN:
                scene.luma[y, x] = laid.luma[y, x]
                scene.noise[y, x] = _NEW_NOISE
                scene.covered_s[y, x] = 0
                scene.former[y, x] = NEVER
                if coloured:
                    scene.cb[y // 2, x // 2] = laid.cb[y // 2, x // 2]
                    scene.cr[y // 2, x // 2] = laid.cr[y // 2, x // 2]
