"""The canvas: the scene larger than the picture, while the camera moves over it."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack import plane
from vidtrack.compiled import kernel
from vidtrack.scan import Floats
from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import NEVER, UNKNOWN, Levels, Scene
from vidtrack.video.frame import Image

_NEW_NOISE = np.float32(6)  # grey levels assumed of what has just come into the picture
_RIM = 1  # px at the picture's edge that are not used: filters have mirrored them
_SPARE = 8  # px that the canvas grows beyond what is needed, at least
_LARGEST = 0.15  # share of the picture's longer side that the canvas reaches beyond it on each side


def lay(picture: Picture, motion: Floats, scene: Scene) -> tuple[Picture, Image]:
    """The picture on the canvas, and (h, w) 255 where it is seen; what is seen first becomes scene, and elsewhere
    the scene is repeated.

    motion  (2, 3) from canvas to picture
    """
    size = (scene.luma.shape[1], scene.luma.shape[0])
    half = plane.rescaled(motion, 0.5)
    frame = np.zeros(picture.luma.shape, np.uint8)
    frame[_RIM:-_RIM, _RIM:-_RIM] = 255
    seen = _warped(frame, motion, size)
    chroma_size = (scene.cb.shape[1], scene.cb.shape[0])
    cb, cr = (_warped(p, half, chroma_size, cv2.BORDER_REPLICATE) if p.size else p for p in (picture.cb, picture.cr))
    laid = Picture(_warped(picture.luma, motion, size), cb, cr)
    _complete(laid, scene, seen)
    return laid, seen


def fitting(scene: Scene, motion: Floats, shape: tuple[int, int]) -> tuple[int, int, int, int] | None:
    """Left, top, right, bottom on the canvas to cut it to, so that a picture (h, w) fits; None if it does already."""
    h, w = scene.luma.shape
    edges = plane.points(plane.inverse(motion), plane.corners(shape[1], shape[0]))
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
        if excess > 0:  # what the camera moves away from goes
            if missing[axis + 2]:
                cut[axis] += min(excess, need[axis] - cut[axis])
            else:
                cut[axis + 2] -= min(excess, cut[axis + 2] - need[axis + 2])
    cut[:2] -= cut[:2] % 2
    cut[2:] += cut[2:] % 2
    left, top, right, bottom = cut.tolist()
    return left, top, right, bottom


def recut(scene: Scene, left: int, top: int, right: int, bottom: int) -> Scene:
    """The scene from column left to right and row top to bottom, all even; nothing is known of what is added."""
    fills = (0.0, 128.0, 128.0, float(UNKNOWN), 0.0, float(NEVER))
    whole = (left, top, right, bottom)
    half = (left // 2, top // 2, right // 2, bottom // 2)
    planes = [
        _cut(old, half if name in ("cb", "cr") else whole, fill) if old.size else old
        for name, old, fill in zip(Scene._fields, scene, fills, strict=True)
    ]
    return Scene(*planes)


def settled(scene: Scene, motion: Floats, shape: tuple[int, int]) -> Scene:
    """The scene as a picture (h, w) at this motion shows it."""
    size, back = (shape[1], shape[0]), plane.inverse(motion)
    half, half_size = plane.rescaled(back, 0.5), ((shape[1] + 1) // 2, (shape[0] + 1) // 2)
    return Scene(
        _warped(scene.luma, back, size, cv2.BORDER_REPLICATE, cv2.INTER_CUBIC),
        *(_warped(p, half, half_size, cv2.BORDER_REPLICATE) if p.size else p for p in (scene.cb, scene.cr)),
        *(_warped(p, back, size, cv2.BORDER_REPLICATE, cv2.INTER_NEAREST) for p in scene[3:]),
    )


def _warped(
    source: NDArray, to_source: Floats, size: tuple[int, int], border: int = cv2.BORDER_CONSTANT,
    how: int = cv2.INTER_LINEAR,
) -> NDArray:  # fmt: skip
    """(height, width) of size (width, height): each pixel from where the map finds it in the source."""
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
def _complete(laid: Picture, scene: Scene, seen: Image) -> None:
    h, w = seen.shape
    coloured = len(laid.cb) > 0
    for y in range(h):
        for x in range(w):
            if seen[y, x] < 255:
                seen[y, x] = 0
                laid.luma[y, x] = np.uint8(scene.luma[y, x] + np.float32(0.5))
                if coloured:
                    laid.cb[y // 2, x // 2] = np.uint8(scene.cb[y // 2, x // 2] + np.float32(0.5))
                    laid.cr[y // 2, x // 2] = np.uint8(scene.cr[y // 2, x // 2] + np.float32(0.5))
            elif scene.noise[y, x] >= UNKNOWN:
                scene.luma[y, x] = laid.luma[y, x]
                scene.noise[y, x] = _NEW_NOISE
                scene.covered_s[y, x] = 0
                scene.former[y, x] = NEVER
                if coloured:
                    scene.cb[y // 2, x // 2] = laid.cb[y // 2, x // 2]
                    scene.cr[y // 2, x // 2] = laid.cr[y // 2, x // 2]
