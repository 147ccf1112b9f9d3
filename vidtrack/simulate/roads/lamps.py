"""Roads at dusk and at night: beams on the road, lamps in their glow, pools of street lamps."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats
from vidtrack.simulate.light import AMBIENT, BEAM, RED, WARM, add_spot
from vidtrack.simulate.moment import Canvas, pixel_centres, rounded
from vidtrack.simulate.roads.pinhole import NEAR_M, Pinhole
from vidtrack.simulate.roads.stage import Actor, fill

COARSE_ROWS = 90  # beams are soft and are drawn on a coarser grid of about so many rows
REACHES_M = (5.0, 9.0, 15.0, 24.0)
BEAM_LIGHT = 0.8
POOL_M = 7.0
LAMP_M, HALO_M = 0.1, 0.4


def street_lamps(points: Floats, camera: Pinhole, size: tuple[int, int]) -> NDArray[np.float32]:
    """(H, W) light of lamps above ground points (L, 2) m."""
    ground = camera.on_ground(pixel_centres(slice(0, size[1]), slice(0, size[0])))
    light = sum(np.exp(-((ground - point) ** 2).sum(axis=-1) / POOL_M**2) for point in points)
    return np.nan_to_num(np.asarray(light, np.float32))


def lit(
    picture: Canvas, actors: list[Actor], camera: Pinhole, light: str, pools: NDArray[np.float32] | None, wet: bool
) -> Canvas:
    """The picture by the sky's remaining light and by lamps; `actors` from the farthest to the nearest."""
    height, width = picture.shape[:2]
    coarse = max(1, round(height / COARSE_ROWS))  # px
    beams = np.zeros((height // coarse + 1, width // coarse + 1), np.uint8)
    glow = np.zeros(picture.shape, np.float32)
    for actor in actors:
        _add_beams(beams, actor, camera, coarse)
        for polygon in actor.silhouette:
            cv2.fillConvexPoly(glow, np.rint(polygon - 0.5).astype(np.int32), (0.0, 0.0, 0.0))
        _add_lamps(glow, actor, camera, wet)
    wide = cv2.resize(cv2.blur(beams, (5, 5)), (beams.shape[1] * coarse, beams.shape[0] * coarse))
    shining = (BEAM_LIGHT / 255 * wide[:height, :width, None]) * BEAM
    shining += AMBIENT[light] * np.array([1.15, 1.0, 0.9], np.float32)
    if pools is not None:
        shining += 0.3 * pools[..., None] * WARM
    return rounded(picture * shining + glow)


def _add_beams(beams: Canvas, actor: Actor, camera: Pinhole, coarse: int) -> None:
    """Light on the road ahead, less with the distance."""
    front = float(actor.solid.headlamps[0, 0])
    half = float(np.abs(actor.solid.headlamps[:, 1]).max())
    step = np.zeros_like(beams)
    for reach in REACHES_M[::-1]:
        far = half + 0.25 * reach
        body = np.array([(front, -half, 0), (front + reach, -far, 0), (front + reach, far, 0), (front, half, 0)])
        xy, depth = camera.project(body @ actor.turn + actor.place)
        if depth.min() > NEAR_M:
            fill(step, xy / coarse, 255 * (1 - reach / (REACHES_M[-1] + 8)))
    np.maximum(beams, step, out=beams)


def _add_lamps(glow: NDArray[np.float32], actor: Actor, camera: Pinhole, wet: bool) -> None:
    """Lamps that face the camera, their halos, and their reflections on a wet road."""
    eye_x = float((actor.turn @ (camera.position - actor.place))[0])
    solid = actor.solid
    facing = eye_x > solid.headlamps[0, 0], eye_x < solid.tail_lamps[0, 0]
    for lamps, colour, power, faces in zip(
        (solid.headlamps, solid.tail_lamps), (BEAM, RED), (255, 160), facing, strict=True
    ):
        points = lamps @ actor.turn + actor.place
        for point in points if faces else ():
            (at, _), large = camera.project(point), float(camera.px_per_m(point))
            core, halo = max(LAMP_M * large, 0.7), max(HALO_M * large, 1.5)
            add_spot(glow, at, (core, core), power * colour)
            add_spot(glow, at, (halo, halo), 0.2 * power * colour)
            if wet:
                below = camera.project(point * [1, 1, -1])[0]
                add_spot(glow, below, (halo / 2, 2 * halo), 0.3 * power * colour)
