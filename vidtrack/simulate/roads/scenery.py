"""The empty road as the camera sees it: surfaces and marks in perspective, with texture that lies on the ground."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats
from vidtrack.simulate.draw import SUBPIXEL_BITS, Image
from vidtrack.simulate.ground import GRASS
from vidtrack.simulate.moment import pixel_centres
from vidtrack.simulate.roads.pinhole import NEAR_M, Pinhole
from vidtrack.simulate.scene import Part

EDGE_M = 1.0  # between the points along an edge: lenses bend edges
GRAINS_M = ((0.12, 0.6), (0.8, 0.5), (5.0, 0.6))  # sizes of the texture's grains, and their weights
TILE = 256  # grains until the texture repeats
HORIZON, ZENITH = np.array([226.0, 216.0, 206.0]), np.array([214.0, 168.0, 122.0])


def empty_road(parts: tuple[Part, ...], camera: Pinhole, size: tuple[int, int], rng: Generator) -> Image:
    """(H, W, 3) picture of the ground parts (polygons in metres) and the sky."""
    colour = np.empty((size[1], size[0], 3), np.uint8)
    colour[:] = np.rint(GRASS[0])
    grain = np.full((size[1], size[0]), 16 * GRASS[1], np.uint8)
    for part in parts:
        polygon = on_picture(part.polygon, camera)
        if len(polygon) > 2:
            fixed = np.rint((polygon - 0.5) * 2**SUBPIXEL_BITS).astype(np.int32)
            cv2.fillPoly(colour, [fixed], part.colour, cv2.LINE_AA, SUBPIXEL_BITS)
            cv2.fillPoly(grain, [fixed], (16 * part.grain,), cv2.LINE_AA, SUBPIXEL_BITS)
    ground = camera.on_ground(pixel_centres(slice(0, size[1]), slice(0, size[0])))
    picture = colour + (_texture(ground, rng) * grain / np.float32(16))[..., None]
    sky = np.isnan(ground[..., 0])
    if sky.any():
        height = np.broadcast_to(np.linspace(1, 0, size[1])[:, None], sky.shape)[sky][:, None]
        picture[sky] = HORIZON + (ZENITH - HORIZON) * (height - height.min()) / max(float(np.ptp(height)), 1e-6)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def on_picture(polygon: Floats, camera: Pinhole, step_m: float = EDGE_M) -> Floats:
    """A ground polygon (V, 2) m in the picture (W, 2) px, a point each `step_m`, what is behind the camera left out."""
    points = []
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        count = max(int(np.ceil(np.linalg.norm(b - a) / step_m)), 1)
        points.append(a + np.linspace(0, 1, count, endpoint=False)[:, None] * (b - a))
    along = np.concatenate(points)
    xy, depth = camera.project(np.column_stack([along, np.zeros(len(along))]))
    return xy[depth > NEAR_M]


def _texture(ground: Floats, rng: Generator) -> NDArray[np.float32]:
    """(H, W) noise that lies on the ground; grains smaller than a pixel fade."""
    where = np.nan_to_num(ground, nan=0.0).astype(np.float32)
    footprint = np.abs(np.gradient(where, axis=0)).max(axis=-1)
    field = np.zeros(where.shape[:2], np.float32)
    for grain, weight in GRAINS_M:
        tile = rng.standard_normal((TILE, TILE), dtype=np.float32)
        at = np.mod(where / grain, TILE).astype(np.float32)
        noise = cv2.remap(np.pad(tile, ((0, 1), (0, 1)), mode="wrap"), at[..., 0], at[..., 1], cv2.INTER_LINEAR)
        field += weight * noise * np.clip(grain / np.maximum(footprint, 1e-3), 0, 1)
    return field
