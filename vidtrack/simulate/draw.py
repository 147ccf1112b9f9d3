"""Anti-aliased drawing: polygons become sprites once, sprites become pixels in every frame."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats
from vidtrack.simulate.camera import Camera
from vidtrack.simulate.scene import Actor, Look, Scene, bounds

Image = NDArray[np.uint8]
Window = tuple[slice, slice]

SUPERSAMPLING = 3  # sprite and drawing grid per picture pixel: edges cover three thirds of a pixel
SUBPIXEL_BITS = 6
SHADOW = 0.55  # light left in a shadow, alike in all colours: the sky's share


@dataclass(frozen=True, slots=True, eq=False)
class Sprite:
    """A look as a picture: (h, w, 4) BGR times coverage, and coverage; `to_body` (2, 3) leads from texel to body."""

    image: Image
    to_body: Floats


def sprite(look: Look, density: float, rng: Generator) -> Sprite:
    """Draw a look at `density` texels per scene pixel, with a fixed texture of dirt and reflections."""
    left, top, right, bottom = bounds(look.outline) + np.array([-1, -1, 1, 1]) * 2 / density
    size = int(np.ceil((right - left) * density)), int(np.ceil((bottom - top) * density))
    to_texel = np.array([[density, 0, -left * density], [0, density, -top * density]])
    image = np.zeros((size[1], size[0], 4), np.uint8)
    for part in look.parts:
        _fill(image, apply(to_texel, part.polygon), (*part.colour, 255.0))
    dirt = 1 + 0.06 * texture(size, np.array([density, density]), rng)
    image[..., :3] = np.clip(np.rint(image[..., :3] * dirt[..., None]), 0, image[..., 3:])
    return Sprite(image, np.array([[1 / density, 0, left], [0, 1 / density, top]]))


def ground(scene: Scene, camera: Camera, margin: int, rng: Generator) -> Image:
    """The empty scene with its textures, `margin` px larger than the picture on every side."""
    size = camera.size[0] + 2 * margin, camera.size[1] + 2 * margin
    colour = np.zeros((size[1], size[0], 3), np.uint8)
    grain = np.zeros((size[1], size[0]), np.uint8)
    for part in scene.ground:
        polygon = part.polygon * camera.scale + margin
        _fill(colour, polygon, part.colour)
        _fill(grain, polygon, (16 * part.grain,))
    relief = texture(size, camera.scale, rng) * (grain / np.float32(16))
    return np.clip(np.rint(colour + relief[..., None]), 0, 255).astype(np.uint8)


def texture(size: tuple[int, int], scale: Floats, rng: Generator) -> NDArray[np.float32]:
    """(h, w) noise of unit standard deviation with grains of 1, 5 and 25 scene pixels."""
    field = np.zeros((size[1], size[0]), np.float32)
    for cell, weight in ((1.0, 0.7), (5.0, 0.5), (25.0, 0.5)):
        grid = np.ceil(np.array(size) / (cell * scale)).astype(int) + 1
        coarse = rng.standard_normal((grid[1], grid[0]), dtype=np.float32)
        field += weight * cv2.resize(coarse, size, interpolation=cv2.INTER_CUBIC)
    return field


def place(canvas: Image, look: Sprite, to_picture: Floats, corners: Floats) -> None:
    """Blend a sprite into the canvas; to_picture (2, 3) leads from body to picture, corners (V, 2) is its outline."""
    roi = window(corners, canvas, 1)
    if roi is None:
        return
    rows, cols = roi
    inner = compose(to_picture, look.to_body)
    inner[:, 2] -= (cols.start, rows.start)
    cover = _warp(look.image, inner, (cols.stop - cols.start, rows.stop - rows.start))
    below = canvas[roi].astype(np.uint16)
    canvas[roi] = cover[..., :3] + ((below * (255 - cover[..., 3:].astype(np.uint16)) + 127) // 255).astype(np.uint8)


def shade(canvas: Image, polygon: Floats, softness: float, left: float = SHADOW) -> None:
    """Darken a polygon (V, 2) of the canvas to a share `left`, its edge blurred over about `softness` px."""
    roi = window(polygon, canvas, int(np.ceil(3 * softness)))
    if roi is None:
        return
    rows, cols = roi
    mask = np.zeros((rows.stop - rows.start, cols.stop - cols.start), np.float32)
    _fill(mask, polygon - (cols.start, rows.start), (1.0,))
    light = 1 - (1 - left) * cv2.GaussianBlur(mask, (0, 0), softness)
    canvas[roi] = np.rint(canvas[roi] * light[..., None])


def shadow(actor: Actor, time: float, sun: tuple[float, float]) -> Floats:
    """The convex polygon (V, 2) between an actor's base and the base moved to where the sun throws its top."""
    base = actor.place(actor.look.base, np.array([time]))[0]
    points = np.concatenate([base, base + actor.look.height * np.array(sun)])
    return cv2.convexHull(points.astype(np.float32))[:, 0].astype(float)


def window(polygon: Floats, canvas: NDArray, margin: int) -> Window | None:
    """The part of the canvas that a polygon (V, 2) and a margin cover; None: nothing of it."""
    left, top = np.floor(polygon.min(axis=0)).astype(int) - margin
    right, bottom = np.ceil(polygon.max(axis=0)).astype(int) + margin
    rows = slice(max(int(top), 0), min(int(bottom), canvas.shape[0]))
    cols = slice(max(int(left), 0), min(int(right), canvas.shape[1]))
    return (rows, cols) if rows.start < rows.stop and cols.start < cols.stop else None


def apply(affine: Floats, points: Floats) -> Floats:
    """Points (..., 2) through an affine map (2, 3)."""
    return points @ affine[:, :2].T + affine[:, 2]


def compose(outer: Floats, inner: Floats) -> Floats:
    """The affine map (2, 3) that does `inner` first."""
    return np.column_stack([outer[:, :2] @ inner[:, :2], outer[:, :2] @ inner[:, 2] + outer[:, 2]])


def _fill(image: NDArray, polygon: Floats, colour: tuple[float, ...]) -> None:
    """Fill a polygon given in continuous coordinates; OpenCV's name the centres of pixels."""
    fixed = np.rint((polygon - 0.5) * 2**SUBPIXEL_BITS).astype(np.int32)
    line = cv2.LINE_AA if image.dtype == np.uint8 else cv2.LINE_8
    cv2.fillPoly(image, [fixed], colour, line, SUBPIXEL_BITS)


def _warp(image: Image, affine: Floats, size: tuple[int, int]) -> Image:
    """Resample by an affine map between continuous coordinates, averaging over each pixel."""
    finer = affine * SUPERSAMPLING
    finer[:, 2] += finer[:, :2].sum(axis=1) / 2 - 0.5
    fine = cv2.warpAffine(image, finer, (size[0] * SUPERSAMPLING, size[1] * SUPERSAMPLING), flags=cv2.INTER_LINEAR)
    return np.asarray(cv2.resize(fine, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
